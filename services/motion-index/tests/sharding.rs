//! A divided database, served by replicas that share its shards, answers as an undivided one.

mod fixture;

use fixture::{Fixture, plan};
use jobs::motion_database::PlanMotionDatabase;
use proto::v1::{self, motion_index_client::MotionIndexClient};
use std::net::{SocketAddr, TcpListener};
use testkit::walker;
use tonic::{Code, transport::Channel};
use uuid::Uuid;

/// Ports that nobody uses.
fn free_ports(count: usize) -> Vec<SocketAddr> {
    let listeners: Vec<TcpListener> = (0..count).map(|_| TcpListener::bind("127.0.0.1:0").unwrap()).collect();
    listeners.iter().map(|listener| listener.local_addr().unwrap()).collect()
}

/// Replicas that know of each other.
async fn replicas(count: usize) -> Fixture {
    let mut fixture = Fixture::without_service().await;
    let ports = free_ports(count);
    let all: Vec<String> = ports.iter().map(|port| format!("http://{port}")).collect();
    for (port, own) in ports.iter().zip(&all) {
        let (all, own) = (all.clone(), Some(own.clone()));
        fixture
            .serve(|config| {
                config.service.grpc.listen = *port;
                config.peers = motion_index::config::PeersConfig { all, own };
            })
            .await;
    }
    fixture
}

type Windows = Vec<v1::WindowMatch>;
type Poses = Vec<v1::ControlPointMatch>;

/// Answers to many questions, of windows of 1 to 3 poses and of control points.
async fn answers(client: &mut MotionIndexClient<Channel>, id: Uuid) -> (Vec<Windows>, Vec<Poses>) {
    let mut windows = Vec::new();
    for (question, trial) in (0..6).zip([1, 3, 8, 9, 2, 5]) {
        let motion = walker::motion(trial, 240);
        let newest = 40 + 11 * question;
        let length = 1 + question % 3;
        let window =
            (0..length).rev().map(|back| proto::poses::to_wire(motion.pose(newest - 2 * back))).collect();
        let request = v1::NearestWindowsRequest {
            database_id: id.to_string(),
            window,
            num_matches: [1, 5, 64, 1024][question % 4],
            shard: None,
        };
        windows.push(client.nearest_windows(request).await.unwrap().into_inner().matches);
    }
    let mut poses = Vec::new();
    for shift in [0.0, 0.3] {
        let sample = |name: &str, x_m: f64, y_m: f64| v1::ControlPointSample {
            name: name.to_owned(),
            position: Some(v1::Point { x_m: x_m + shift, y_m, z_m: 0.1 }),
        };
        let samples =
            vec![sample("left_wrist", 0.6, 1.1), sample("right_ankle", -0.1, 0.1), sample("head", 0.0, 1.6)];
        let request = v1::FindPosesByControlPointsRequest {
            database_id: id.to_string(),
            control_points: Some(v1::ControlPointFrame { samples }),
            num_matches: 20,
            shard: None,
        };
        poses.push(client.find_poses_by_control_points(request).await.unwrap().into_inner().matches);
    }
    (windows, poses)
}

#[tokio::test]
async fn three_shards_on_three_replicas_answer_as_one_index_and_so_do_those_that_are_left() {
    let mut fixture = replicas(3).await;
    let trials: Vec<usize> = (1..=8).collect();
    let whole = fixture.new_database("whole").await;
    let files = fixture.walks(whole, &trials, 240).await;
    fixture.build(&plan(whole, files.clone())).await;
    let divided = fixture.new_database("divided").await;
    fixture.build(&PlanMotionDatabase { shards: 3, ..plan(divided, files) }).await;

    let expected = answers(&mut fixture.client_at(0).await, whole).await;
    assert_eq!(expected.0[3].len(), 8 * 119, "all windows of all clips");
    for replica in 0..3 {
        let mut client = fixture.client_at(replica).await;
        assert_eq!(answers(&mut client, divided).await, expected, "replica {replica}");
    }
    // The same by a stream.
    let motion = walker::motion(3, 240);
    let request = v1::NearestWindowsRequest {
        database_id: divided.to_string(),
        window: vec![proto::poses::to_wire(motion.pose(100))],
        num_matches: 9,
        shard: None,
    };
    let mut client = fixture.client_at(1).await;
    let once = client.nearest_windows(request.clone()).await.unwrap().into_inner();
    let stream = tokio_stream::iter(vec![request.clone(), request.clone()]);
    let mut stream = client.stream_nearest_windows(stream).await.unwrap().into_inner();
    for _ in 0..2 {
        assert_eq!(stream.message().await.unwrap().unwrap(), once);
    }
    drop((stream, client));

    let describe = v1::DescribeDatabaseRequest { database_id: divided.to_string() };
    let mut client = fixture.client_at(2).await;
    let described = client.describe_database(describe).await.unwrap().into_inner();
    assert_eq!(described.clips.len(), 8);
    assert_eq!(described.summary.unwrap().num_shards, 3);

    // What can't be asked is refused whoever keeps it.
    let refused = |request| {
        let mut client = client.clone();
        async move { client.nearest_windows(request).await.unwrap_err() }
    };
    let bad = v1::NearestWindowsRequest { shard: Some(3), ..request.clone() };
    assert_eq!(refused(bad).await.code(), Code::InvalidArgument);
    let bad =
        v1::NearestWindowsRequest { window: vec![v1::Pose { values: vec![0.0; 3] }], ..request.clone() };
    assert_eq!(refused(bad).await.code(), Code::InvalidArgument);
    let bad =
        v1::NearestWindowsRequest { window: vec![proto::poses::to_wire(motion.pose(0)); 17], ..request };
    assert_eq!(refused(bad).await.code(), Code::InvalidArgument);
    drop(client);

    for left in [2, 1] {
        fixture.stop_service(0).await;
        for replica in 0..left {
            let mut client = fixture.client_at(replica).await;
            assert_eq!(answers(&mut client, divided).await, expected, "{left} left, replica {replica}");
        }
    }
    fixture.stop().await;
}
