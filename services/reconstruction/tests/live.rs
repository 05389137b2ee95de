//! Live streams as a gateway has them: real gRPC, a real PostgreSQL, a real folder.

use proto::v1::{self, LiveDelivery, live_client::LiveClient, live_request, live_response};
use reconstruction::config::LiveConfig;
use testkit::{
    sandbox::{Sandbox, Service},
    walker,
};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Code, Status, Streaming};
use uuid::Uuid;

const POINTS: [&str; 6] = ["left_wrist", "right_wrist", "left_ankle", "right_ankle", "root", "head"];

/// A service that follows two performers at once.
struct Fixture {
    service: Service,
    motion_database: Uuid,
    _sandbox: Sandbox,
}

impl Fixture {
    async fn new() -> Self {
        let sandbox = Sandbox::new().await;
        let motion_database = sandbox.add_walks().await.id;
        let start = async |service, shutdown| {
            let live = LiveConfig { max_streams: 2, ..LiveConfig::default() };
            reconstruction::start(reconstruction::Config { service, live }, shutdown).await
        };
        let service = sandbox.serve(start, |config| config.worker.concurrency = 0).await;
        Self { service, motion_database, _sandbox: sandbox }
    }

    fn start(&self) -> v1::LiveStart {
        v1::LiveStart {
            database_id: self.motion_database.to_string(),
            skeleton_asf: walker::ASF.to_owned(),
            points: POINTS.map(str::to_owned).into(),
            ..Default::default()
        }
    }

    /// A stream whose first message this is.
    async fn open(&self, start: v1::LiveStart) -> Result<Performer, Status> {
        let (requests, receiver) = mpsc::channel(1000);
        let first = v1::LiveRequest { message: Some(live_request::Message::Start(start)) };
        requests.send(first).await.unwrap();
        let mut client = LiveClient::connect(self.service.address()).await.unwrap();
        let answers = client.follow(ReceiverStream::new(receiver)).await?.into_inner();
        Ok(Performer { requests, answers })
    }
}

struct Performer {
    requests: mpsc::Sender<v1::LiveRequest>,
    answers: Streaming<v1::LiveResponse>,
}

impl Performer {
    async fn send(&self, frame: v1::LiveFrame) {
        let message = Some(live_request::Message::Frame(frame));
        self.requests.send(v1::LiveRequest { message }).await.unwrap();
    }

    async fn answer(&mut self) -> Result<Option<live_response::Message>, Status> {
        Ok(self.answers.message().await?.and_then(|answer| answer.message))
    }

    /// Everything until the end, and how it ended.
    async fn rest(mut self) -> (Vec<live_response::Message>, Status) {
        drop(self.requests);
        let mut answers = Vec::new();
        loop {
            match self.answers.message().await {
                Ok(Some(answer)) => answers.extend(answer.message),
                Ok(None) => return (answers, Status::ok("")),
                Err(status) => return (answers, status),
            }
        }
    }
}

/// A frame of trial 7, which is not in the database.
fn frames(count: usize) -> Vec<v1::LiveFrame> {
    let paths = evaluation::control_trajectories(&walker::motion(7, 2 * count), &POINTS).unwrap();
    let frame = |i: usize| v1::LiveFrame {
        frame: i as u64 + 1,
        time: i as f64,
        positions_m: paths.frame(2 * i).iter().flat_map(|p| [p.x, p.y, p.z]).collect(),
        sigmas_m: vec![],
    };
    (0..count).map(frame).collect()
}

fn last_state(answers: &[live_response::Message]) -> &v1::LiveState {
    match answers.last() {
        Some(live_response::Message::State(state)) => state,
        other => panic!("{other:?}"),
    }
}

#[tokio::test]
async fn a_start_is_answered_with_what_was_started_and_a_frame_with_its_pose() {
    let fixture = Fixture::new().await;
    let mut performer = fixture.open(fixture.start()).await.unwrap();
    let Some(live_response::Message::Started(started)) = performer.answer().await.unwrap() else { panic!() };
    assert_eq!((started.joint_parents[0], started.is_resumed), (-1, false));
    for frame in frames(20) {
        performer.send(frame.clone()).await;
        let Some(live_response::Message::Pose(pose)) = performer.answer().await.unwrap() else { panic!() };
        assert_eq!((pose.frame, pose.time, pose.dropped), (frame.frame, frame.time, 0));
        assert_eq!(pose.pose.len(), started.dof_names.len());
    }
    let (rest, status) = performer.rest().await;
    assert_eq!((last_state(&rest).frame, status.code()), (20, Code::Ok));
}

#[tokio::test]
async fn there_is_a_limit_to_streams_and_one_that_ends_makes_room() {
    let fixture = Fixture::new().await;
    let first = fixture.open(fixture.start()).await.unwrap();
    let _second = fixture.open(fixture.start()).await.unwrap();
    let status = fixture.open(fixture.start()).await.err().unwrap();
    assert_eq!(status.code(), Code::ResourceExhausted);
    assert_eq!(status.message(), "too many live streams: this service follows 2 at once");
    first.rest().await;
    fixture.open(fixture.start()).await.unwrap();
}

#[tokio::test]
async fn a_shutdown_gives_every_stream_its_state_to_go_on_elsewhere() {
    let (fixture, elsewhere) = (Fixture::new().await, Fixture::new().await);
    let mut performer = fixture.open(fixture.start()).await.unwrap();
    performer.answer().await.unwrap();
    let frames = frames(60);
    for frame in &frames[..30] {
        performer.send(frame.clone()).await;
        performer.answer().await.unwrap();
    }
    fixture.service.shut_down();
    let (rest, status) = performer.rest().await;
    assert_eq!(status.code(), Code::Unavailable, "{status}");
    let state = last_state(&rest);
    assert_eq!(state.frame, 30);
    let start = v1::LiveStart { state: state.state.clone(), ..elsewhere.start() };
    let mut performer = elsewhere.open(start).await.unwrap();
    let Some(live_response::Message::Started(started)) = performer.answer().await.unwrap() else { panic!() };
    assert!(started.is_resumed);
    performer.send(frames[30].clone()).await;
    let Some(live_response::Message::Pose(pose)) = performer.answer().await.unwrap() else { panic!() };
    assert!(pose.residual_m < 0.05, "{}", pose.residual_m);
    fixture.service.stop().await;
}

#[tokio::test]
async fn frames_that_come_too_fast_are_dropped_and_counted_or_all_computed() {
    let fixture = Fixture::new().await;
    let frames = frames(100);
    for (delivery, may_drop) in [(LiveDelivery::Latest, true), (LiveDelivery::Every, false)] {
        let start = v1::LiveStart { delivery: delivery.into(), state_every: 1000, ..fixture.start() };
        let performer = fixture.open(start).await.unwrap();
        for frame in &frames {
            performer.send(frame.clone()).await;
        }
        let (rest, status) = performer.rest().await;
        assert_eq!(status.code(), Code::Ok);
        let poses: Vec<_> = rest
            .iter()
            .filter_map(|answer| match answer {
                live_response::Message::Pose(pose) => Some(pose),
                _ => None,
            })
            .collect();
        assert_eq!(poses.last().unwrap().frame, 100);
        assert_eq!(poses.len() as u64 + poses.last().unwrap().dropped, 100);
        assert!(may_drop || poses.len() == 100);
    }
}

#[tokio::test]
async fn a_frame_that_makes_no_sense_ends_the_stream_and_is_named() {
    let fixture = Fixture::new().await;
    let good = &frames(1)[0];
    let change = |change: &dyn Fn(&mut v1::LiveFrame)| {
        let mut frame = v1::LiveFrame { frame: 2, ..good.clone() };
        change(&mut frame);
        frame
    };
    let cases = [
        (change(&|f| f.positions_m.truncate(17)), "frame 2 has 17 coordinates, expected 18"),
        (change(&|f| f.positions_m = vec![0.0; 100_000]), "frame 2 has 100000 coordinates"),
        (change(&|f| f.positions_m[4] = f64::INFINITY), "frame 2: a coordinate of point 1 is inf"),
        (change(&|f| f.sigmas_m = vec![0.1]), "frame 2 has 1 standard deviations, expected 6 or none"),
        (change(&|f| f.sigmas_m = vec![-0.1; 6]), "frame 2: the standard deviation of point 0 is -0.1"),
        (change(&|f| f.frame = 1), "frame 1 came after frame 1, expected rising numbers"),
    ];
    for (bad, expected) in cases {
        let performer = fixture.open(fixture.start()).await.unwrap();
        performer.send(good.clone()).await;
        performer.send(bad).await;
        let (rest, status) = performer.rest().await;
        assert_eq!(last_state(&rest).frame, 1);
        assert_eq!(status.code(), Code::InvalidArgument);
        assert!(status.message().contains(expected), "{:?} does not say {expected:?}", status.message());
    }
}

#[tokio::test]
async fn a_start_that_makes_no_sense_is_refused() {
    let fixture = Fixture::new().await;
    let good = fixture.start();
    let cases = [
        (v1::LiveStart { database_id: "x".into(), ..good.clone() }, Code::InvalidArgument),
        (v1::LiveStart { database_id: Uuid::nil().to_string(), ..good.clone() }, Code::NotFound),
        (v1::LiveStart { points: vec!["root".into()], ..good.clone() }, Code::InvalidArgument),
        (v1::LiveStart { parameters_json: "{\"window\":0}".into(), ..good.clone() }, Code::InvalidArgument),
        (v1::LiveStart { delivery: 7, ..good.clone() }, Code::InvalidArgument),
        (v1::LiveStart { state: vec![1, 2, 3], ..good.clone() }, Code::InvalidArgument),
    ];
    for (start, code) in cases {
        let status = fixture.open(start).await.err().expect("refused");
        assert_eq!(status.code(), code, "{status}");
    }
}
