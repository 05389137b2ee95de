//! The service as a whole: a real PostgreSQL, a real folder, jobs through the queue, questions through gRPC.

mod fixture;

use fixture::{Fixture, plan};
use proto::v1::{self, motion_index_client::MotionIndexClient};
use service::Config;
use std::time::Duration;
use store::Location;
use testkit::walker;
use tokio_util::sync::CancellationToken;
use tonic::{Code, transport::Channel};
use uuid::Uuid;

#[tokio::test]
async fn a_database_is_built_from_uploads_and_answers_questions() {
    let fixture = Fixture::new().await;
    let id = fixture.build_walks(&[1, 2, 3]).await;
    let mut client = fixture.client().await;

    let list = v1::ListDatabasesRequest { project_id: fixture.project.to_string(), ..Default::default() };
    let listed = client.list_databases(list).await.unwrap().into_inner().databases;
    assert_eq!(listed.len(), 1);
    assert_eq!((listed[0].name.as_str(), listed[0].num_clips, listed[0].num_poses), ("walks", 3, 3 * 120));

    let describe = v1::DescribeDatabaseRequest { database_id: id.to_string() };
    let described = client.describe_database(describe).await.unwrap().into_inner();
    assert_eq!(described.frame_rate_hz, 60.0);
    assert_eq!(described.clips[1].name, "7_02");
    assert_eq!(described.clips[1].subject, "7");
    assert!(described.dof_names.contains(&"lfemur.rx".to_owned()));

    // A window of trial 2 (every other frame of 120 Hz) is found where it is.
    let motion = walker::motion(2, 240);
    let window = [100, 102, 104].map(|frame| proto::poses::to_wire(motion.pose(frame)));
    let question = v1::NearestWindowsRequest {
        database_id: id.to_string(),
        window: window.to_vec(),
        num_matches: 5,
        shard: None,
    };
    let found = client.nearest_windows(question.clone()).await.unwrap().into_inner().matches;
    assert_eq!(found.len(), 5);
    let best = found[0].pose.clone().unwrap();
    assert_eq!((best.clip.as_str(), best.frame), ("7_02", 52));
    assert!(found[0].distance < 1e-2, "{}", found[0].distance);
    assert!(found.is_sorted_by(|a, b| a.distance <= b.distance));

    // The same by a stream, in the order asked.
    let questions = tokio_stream::iter(vec![question.clone(), question]);
    let mut answers = client.stream_nearest_windows(questions).await.unwrap().into_inner();
    for _ in 0..2 {
        assert_eq!(answers.message().await.unwrap().unwrap().matches, found);
    }
    assert!(answers.message().await.unwrap().is_none());
    fixture.stop().await;
}

#[tokio::test]
async fn control_points_find_the_pose_they_come_from_wherever_the_person_stands() {
    let fixture = Fixture::new().await;
    let id = fixture.build_walks(&[1, 2, 3]).await;
    let motion = walker::motion(3, 240);
    let names = ["left_wrist", "right_wrist", "left_ankle", "right_ankle", "head"];
    let kinematics = kinematics::Kinematics::new(
        motion.skeleton(),
        kinematics::Parametrisation::channels(motion.skeleton()),
    );
    let points = kinematics::control_points(motion.skeleton(), &names).unwrap();
    let mut state = kinematics.state();
    kinematics.update(motion.pose(88), &mut state);
    // Turned by 90 degrees about y, and moved.
    let sample = |point: &kinematics::ControlPoint| {
        let p = state.point(point.joint, &point.offset);
        let position = Some(v1::Point { x_m: p.z + 3.0, y_m: p.y, z_m: -p.x - 1.0 });
        v1::ControlPointSample { name: point.name.clone(), position }
    };
    let frame = v1::ControlPointFrame { samples: points.iter().map(sample).collect() };
    let request = v1::FindPosesByControlPointsRequest {
        database_id: id.to_string(),
        control_points: Some(frame),
        num_matches: 3,
        shard: None,
    };
    let mut client = fixture.client().await;
    let found = client.find_poses_by_control_points(request).await.unwrap().into_inner().matches;
    let best = found[0].pose.clone().unwrap();
    assert_eq!((best.clip.as_str(), best.frame), ("7_03", 44));
    assert!(found[0].residual_m < 1e-4, "{}", found[0].residual_m);
    fixture.stop().await;
}

#[tokio::test]
async fn questions_that_make_no_sense_get_the_right_code() {
    let fixture = Fixture::new().await;
    let id = fixture.build_walks(&[1]).await;
    let open = fixture.new_database("open").await;
    let mut client = fixture.client().await;
    let windows = |poses: usize, values: usize| vec![v1::Pose { values: vec![0.0; values] }; poses];
    let window = |values: usize| windows(1, values);
    let dofs = walker::motion(1, 2).skeleton().num_dofs();
    let cases = [
        (Uuid::now_v7().to_string(), window(dofs), 1, Code::NotFound, "does not exist"),
        (open.to_string(), window(dofs), 1, Code::FailedPrecondition, "not ready"),
        ("x".to_owned(), window(dofs), 1, Code::InvalidArgument, "database_id is \"x\""),
        (id.to_string(), window(dofs), 0, Code::InvalidArgument, "num_matches is 0"),
        (id.to_string(), window(3), 1, Code::InvalidArgument, "pose 0 has 3 values"),
        (id.to_string(), vec![], 1, Code::InvalidArgument, "window is missing"),
        (id.to_string(), windows(17, dofs), 1, Code::InvalidArgument, "17"),
    ];
    for (database_id, window, num_matches, code, message) in cases {
        let request = v1::NearestWindowsRequest { database_id, window, num_matches, shard: None };
        let status = client.nearest_windows(request).await.unwrap_err();
        assert_eq!(status.code(), code, "{status}");
        assert!(status.message().contains(message), "{status}");
    }
    fixture.stop().await;
}

#[tokio::test]
async fn a_damaged_upload_fails_the_run_with_the_file_and_line() {
    let fixture = Fixture::new().await;
    let id = fixture.new_database("broken").await;
    let damaged = walker::amc(1, 20).replacen("rtibia", "rtibia x", 1);
    let files =
        vec![fixture.upload(id, "7.asf", walker::ASF).await, fixture.upload(id, "7_01.amc", damaged).await];
    let message = fixture.fail_to_build(&plan(id, files)).await;
    assert!(message.contains("7_01.amc") && message.contains("line"), "{message}");
    fixture.stop().await;
}

#[tokio::test]
async fn a_database_that_was_deleted_meanwhile_fails_the_run() {
    let fixture = Fixture::new().await;
    let id = Uuid::now_v7();
    let files = vec![
        fixture.upload(id, "7.asf", walker::ASF).await,
        fixture.upload(id, "7_01.amc", walker::amc(1, 60)).await,
    ];
    assert!(fixture.fail_to_build(&plan(id, files)).await.contains("deleted"));
    fixture.stop().await;
}

#[tokio::test]
async fn health_and_reflection_are_served() {
    use tonic_health::pb::{
        HealthCheckRequest, health_check_response::ServingStatus, health_client::HealthClient,
    };
    use tonic_reflection::pb::v1::{
        ServerReflectionRequest, server_reflection_client::ServerReflectionClient,
        server_reflection_request::MessageRequest, server_reflection_response::MessageResponse,
    };
    let fixture = Fixture::new().await;
    let mut health = HealthClient::new(fixture.channel_at(0).await);
    for service in ["", "marey.v1.MotionIndex"] {
        let mut watch =
            health.watch(HealthCheckRequest { service: service.to_owned() }).await.unwrap().into_inner();
        let serving =
            async { while watch.message().await.unwrap().unwrap().status() != ServingStatus::Serving {} };
        tokio::time::timeout(Duration::from_secs(30), serving).await.expect("never became ready");
    }
    let mut reflection = ServerReflectionClient::new(fixture.channel_at(0).await);
    let request = ServerReflectionRequest {
        host: String::new(),
        message_request: Some(MessageRequest::ListServices(String::new())),
    };
    let mut answers =
        reflection.server_reflection_info(tokio_stream::iter(vec![request])).await.unwrap().into_inner();
    let Some(MessageResponse::ListServicesResponse(services)) =
        answers.message().await.unwrap().unwrap().message_response
    else {
        panic!("reflection does not list services");
    };
    let names: Vec<String> = services.service.into_iter().map(|s| s.name).collect();
    assert!(names.contains(&"marey.v1.MotionIndex".to_owned()), "{names:?}");
    fixture.stop().await;
}

#[tokio::test]
async fn a_service_started_before_its_database_waits_and_stops_when_told() {
    let folder = tempfile::tempdir().unwrap();
    let nowhere = format!("postgres:///marey?host={}", folder.path().display());
    let config = Config::new(nowhere, Location::folder(folder.path()), "127.0.0.1:0".parse().unwrap());
    let shutdown = CancellationToken::new();
    let running = motion_index::start(config, shutdown.clone()).await.unwrap();
    let channel =
        Channel::from_shared(format!("http://{}", running.address)).unwrap().connect().await.unwrap();
    let request = v1::DescribeDatabaseRequest { database_id: Uuid::nil().to_string() };
    let status = MotionIndexClient::new(channel).describe_database(request).await.unwrap_err();
    assert_eq!(status.code(), Code::Unavailable, "{status}");
    shutdown.cancel();
    tokio::time::timeout(Duration::from_secs(30), running.stopped()).await.unwrap().unwrap();
}
