//! The service as a whole: a real PostgreSQL, a real folder, runs through the queue, poses through gRPC.

use formats::FileRole;
use jobs::{InputFile, PointChoice, SessionInputs, motion_database::MotionDatabaseFile, sparse::PlanSparse};
use proto::v1::{self, reconstruction_client::ReconstructionClient};
use queue::{Artefact, RunId, RunState};
use serde_json::Value;
use sparse::Parameters;
use std::{collections::BTreeMap, time::Duration};
use store::{Key, key};
use testkit::{
    sandbox::{Sandbox, Service},
    walker,
};
use tonic::Code;
use uuid::Uuid;

const POINTS: [&str; 6] = ["left_wrist", "right_wrist", "left_ankle", "right_ankle", "root", "head"];
/// Frames of a session at 120 Hz: 5 s, cut into chunks of one second.
const FRAMES: usize = 600;

/// A session and a motion database of one test.
struct Fixture {
    sandbox: Sandbox,
    session: Uuid,
    prior: MotionDatabaseFile,
}

impl Fixture {
    async fn new() -> Self {
        let sandbox = Sandbox::new().await;
        let session = sandbox.add_session("walk").await;
        let walks = sandbox.add_walks().await;
        let prior = MotionDatabaseFile {
            id: walks.id,
            name: walks.name,
            version: 1,
            store_key: walks.store_key,
            blake3: walks.blake3,
            gplvm: None,
        };
        Self { sandbox, session, prior }
    }

    /// A service that runs so many jobs at once.
    async fn serve(&self, jobs: usize) -> Service {
        self.sandbox.serve(reconstruction::start, |config| config.worker.concurrency = jobs).await
    }

    async fn upload(&self, name: &str, role: FileRole, content: impl Into<Vec<u8>>) -> InputFile {
        let key = key::file(self.sandbox.project, self.session, Uuid::now_v7());
        let stored = self.sandbox.put(&key, content).await;
        InputFile {
            name: name.to_owned(),
            role,
            store_key: stored.key.into(),
            bytes: stored.bytes,
            blake3: stored.blake3,
        }
    }

    /// Skeleton, control points and truth of trial 7, which is not in the database.
    async fn walk_files(&self) -> Vec<InputFile> {
        vec![
            self.upload("7.asf", FileRole::Skeleton, walker::ASF).await,
            self.upload("points.csv", FileRole::ControlPoints, points_csv(7, FRAMES)).await,
            self.upload("7_07.amc", FileRole::GroundTruth, walker::amc(7, FRAMES)).await,
        ]
    }

    fn request(&self, files: Vec<InputFile>) -> PlanSparse {
        let parameters = Parameters {
            chunk_frames: 60,
            warm_up_frames: 30,
            blend_frames: 10,
            neighbours: 16,
            ..Parameters::default()
        };
        PlanSparse {
            inputs: SessionInputs {
                session_id: self.session,
                session_name: "walk".to_owned(),
                files,
                up: None,
            },
            motion_database: self.prior.clone(),
            choice: PointChoice::default(),
            bvh_metres_per_unit: 0.01,
            parameters,
        }
    }

    async fn enqueue(&self, request: &PlanSparse) -> RunId {
        self.sandbox.enqueue("sparse", Some(self.session), request).await
    }

    async fn succeeded(&self, run: RunId) -> BTreeMap<String, Artefact> {
        let status = self.sandbox.finished(run).await;
        assert_eq!(status.state, RunState::Succeeded, "{:?} {:?}", status.error_message, status.error_detail);
        let mut connection = self.sandbox.pool.acquire().await.unwrap();
        let results = queue::run_results(&mut connection, run).await.unwrap();
        results.into_iter().map(|artefact| (artefact.name.clone(), artefact)).collect()
    }

    /// Runs the request to its end and reads the motion.
    async fn motion_from(&self, request: &PlanSparse) -> model::Motion {
        let results = self.succeeded(self.enqueue(request).await).await;
        let asf = formats::asf::read(self.text(&results["skeleton.asf"]).await.as_bytes()).unwrap().value;
        let amc = self.text(&results["motion.amc"]).await;
        formats::amc::read(amc.as_bytes(), &asf, 60.0).unwrap().value
    }

    async fn text(&self, artefact: &Artefact) -> String {
        let key: Key = artefact.store_key.parse().unwrap();
        let content = self.sandbox.store.get_checked(&key, &artefact.blake3, 1 << 30).await.unwrap();
        String::from_utf8(content.to_vec()).unwrap()
    }
}

fn points_csv(number: usize, frames: usize) -> String {
    let motion = walker::motion(number, frames);
    formats::points_csv::write(&evaluation::control_trajectories(&motion, &POINTS).unwrap())
}

#[tokio::test]
async fn a_session_comes_back_as_motion_files_near_the_truth() {
    let fixture = Fixture::new().await;
    let service = fixture.serve(2).await;
    let run = fixture.enqueue(&fixture.request(fixture.walk_files().await)).await;
    let results = fixture.succeeded(run).await;
    let names: Vec<&str> = results.keys().map(String::as_str).collect();
    assert_eq!(
        names,
        [
            "evaluation.json",
            "motion.amc",
            "motion.bvh",
            "poses.csv",
            "positions.csv",
            "quality.csv",
            "run.json",
            "sigma.csv",
            "skeleton.asf"
        ]
    );

    let errors: Value = serde_json::from_str(&fixture.text(&results["evaluation.json"]).await).unwrap();
    assert_eq!(errors["frames"], 300);
    assert!(errors["rms_deg"].as_f64().unwrap() < 6.0, "{errors}");
    assert!(errors["mpjpe_cm"].as_f64().unwrap() < 3.0, "{errors}");

    let report: Value = serde_json::from_str(&fixture.text(&results["run.json"]).await).unwrap();
    assert_eq!(report["parameters"]["chunk_frames"], 60);
    assert_eq!(report["parameters"]["covariance"], "full", "parameters are all resolved");
    assert_eq!(report["motion_database"]["blake3"], fixture.prior.blake3);
    assert_eq!(report["session"]["points"].as_array().unwrap().len(), 6);
    assert_eq!(report["timings"]["chunks"].as_array().unwrap().len(), 5);
    assert!(report["timings"]["chunks"][4]["worker"].as_str().unwrap().starts_with("reconstruction@"));

    // The files are read again, by the formats that people will use.
    let bvh = fixture.text(&results["motion.bvh"]).await;
    let bvh = formats::bvh::read(bvh.as_bytes(), &formats::BvhOptions::default()).unwrap().value;
    assert_eq!((bvh.num_frames(), bvh.frame_rate().round()), (300, 60.0));
    let asf = formats::asf::read(fixture.text(&results["skeleton.asf"]).await.as_bytes()).unwrap().value;
    let amc = fixture.text(&results["motion.amc"]).await;
    assert_eq!(formats::amc::read(amc.as_bytes(), &asf, 60.0).unwrap().value.num_frames(), 300);
    assert_eq!(fixture.text(&results["quality.csv"]).await.lines().count(), 301);
    assert!(report["fitted_skeleton"].is_null(), "{report}");
    let feet = &report["feet"];
    if feet["contacts"].as_u64().unwrap() > 0 {
        let [before, after] = ["slide_before_cm_s", "slide_after_cm_s"].map(|name| feet[name].as_f64());
        assert!(after <= before, "{feet}");
    }
    service.stop().await;
}

#[tokio::test]
async fn the_result_is_bit_identical_with_one_worker_and_with_many() {
    let fixture = Fixture::new().await;
    let request = fixture.request(fixture.walk_files().await);
    let one = fixture.serve(1).await;
    let alone = fixture.succeeded(fixture.enqueue(&request).await).await;
    one.stop().await;
    let many = [fixture.serve(2).await, fixture.serve(2).await];
    let shared = fixture.succeeded(fixture.enqueue(&request).await).await;
    for name in ["motion.bvh", "motion.amc", "poses.csv", "positions.csv", "quality.csv", "evaluation.json"] {
        assert_eq!(alone[name].blake3, shared[name].blake3, "{name}");
    }
    for service in many {
        service.stop().await;
    }
}

#[tokio::test]
async fn cut_and_uncut_differ_by_less_than_half_a_degree() {
    let fixture = Fixture::new().await;
    let service = fixture.serve(2).await;
    let files = fixture.walk_files().await;
    let cut = fixture.request(files.clone());
    let mut uncut = fixture.request(files);
    uncut.parameters.chunk_frames = 1000;
    let (cut, uncut) = (fixture.motion_from(&cut).await, fixture.motion_from(&uncut).await);
    let errors = evaluation::compare(&uncut, &cut);
    assert!(errors.rms_deg < 0.5, "{errors:?}");
    service.stop().await;
}

#[tokio::test]
async fn a_marker_file_is_read_through_the_mapping() {
    let fixture = Fixture::new().await;
    let service = fixture.serve(1).await;
    let csv = points_csv(7, 240).replace("left_wrist", "LWRA").replace("right_ankle", "RANK");
    let files = vec![fixture.upload("markers.csv", FileRole::ControlPoints, csv).await];
    let mut request = fixture.request(files);
    let pairs = [("LWRA", "left_wrist"), ("RANK", "right_ankle"), ("head", "head")];
    request.choice.mapping = pairs.map(|(from, to)| (from.to_owned(), to.to_owned())).into();
    let results = fixture.succeeded(fixture.enqueue(&request).await).await;
    let report: Value = serde_json::from_str(&fixture.text(&results["run.json"]).await).unwrap();
    assert_eq!(report["session"]["points"], serde_json::json!(["left_wrist", "right_ankle", "head"]));
    assert!(report["warnings"][0].as_str().unwrap().contains("no skeleton file"), "{}", report["warnings"]);
    assert!(report["fitted_skeleton"]["sizes"]["height_m"].as_f64().unwrap() > 0.5, "{report}");
    let asf = formats::asf::read(fixture.text(&results["skeleton.asf"]).await.as_bytes()).unwrap().value;
    let height = skeleton_fit::Sizes::from_skeleton(&asf.skeleton).height_m;
    assert!((height - report["fitted_skeleton"]["sizes"]["height_m"].as_f64().unwrap()).abs() < 1e-3);
    assert!(!results.contains_key("evaluation.json"));
    service.stop().await;
}

#[tokio::test]
async fn bad_input_fails_the_run_with_a_message_that_names_the_place() {
    let fixture = Fixture::new().await;
    let service = fixture.serve(1).await;
    let asf = fixture.upload("7.asf", FileRole::Skeleton, walker::ASF).await;
    let good = fixture.upload("points.csv", FileRole::ControlPoints, points_csv(7, 60)).await;
    let torn = points_csv(7, 60).replacen("\n0.0", "\n0.0,oops,", 1);
    let torn = fixture.upload("torn.csv", FileRole::ControlPoints, torn).await;
    let other = fixture.upload("notes.txt", FileRole::ControlPoints, "hello").await;
    let gone = InputFile {
        store_key: key::file(fixture.sandbox.project, fixture.session, Uuid::nil()).into(),
        ..good.clone()
    };
    let cut_asf = fixture.upload("cut.asf", FileRole::Skeleton, &walker::ASF.as_bytes()[..900]).await;
    let cases = [
        (vec![asf.clone()], vec![], "the session has no file of control points"),
        (vec![good.clone(), good.clone()], vec![], "the session has 2 files of control points"),
        (vec![torn], vec![], "torn.csv: line"),
        (vec![other], vec![], "notes.txt: not a .csv, .trc or .c3d file"),
        (vec![gone], vec![], "is not in the store any more"),
        (vec![cut_asf, good.clone()], vec![], "cut.asf: "),
        (vec![asf.clone(), good.clone()], vec!["left_wrist", "tail"], "tail"),
        (vec![asf, good], vec!["left_wrist"], "only 1 control point; "),
    ];
    for (files, points, expected) in cases {
        let mut request = fixture.request(files);
        request.choice.points = points.into_iter().map(str::to_owned).collect();
        let status = fixture.sandbox.finished(fixture.enqueue(&request).await).await;
        assert_eq!(status.state, RunState::Failed, "{expected}");
        let message = status.error_message.unwrap();
        assert!(message.contains(expected), "{message:?} does not say {expected:?}");
    }
    service.stop().await;
}

#[tokio::test]
async fn a_parameter_out_of_range_fails_the_run_and_is_named() {
    let fixture = Fixture::new().await;
    let service = fixture.serve(1).await;
    let mut request = fixture.request(vec![]);
    request.parameters.window = 99;
    let status = fixture.sandbox.finished(fixture.enqueue(&request).await).await;
    assert_eq!(status.error_message.as_deref(), Some("window is 99, expected 1 to 16 frames"));
    service.stop().await;
}

#[tokio::test]
async fn a_pose_is_solved_at_once() {
    let fixture = Fixture::new().await;
    let service = fixture.serve(1).await;
    let mut client = ReconstructionClient::new(service.channel().await);
    let motion = walker::motion(7, 60);
    let trajectories = evaluation::control_trajectories(&motion, &POINTS).unwrap();
    let request = v1::SolvePoseRequest {
        database_id: fixture.prior.id.to_string(),
        skeleton_asf: walker::ASF.to_owned(),
        frames: proto::points::frames(&trajectories),
        frame_rate_hz: 120.0,
    };
    let answer = client.solve_pose(request.clone()).await.unwrap().into_inner();
    assert_eq!(answer.frames.len(), 30);
    assert_eq!(answer.dof_names, motion.skeleton().dof_names());
    let last = &answer.frames[29];
    assert!(last.residual_m < 0.01, "{}", last.residual_m);
    let hand = answer.joint_names.iter().position(|n| n == "lhand").unwrap();
    let (found, truth) = (last.joint_positions[hand], trajectories.position(58, 0).unwrap());
    assert!((found.x_m - truth.x).abs() < 0.02 && (found.y_m - truth.y).abs() < 0.02);

    let single = v1::SolvePoseRequest { frames: request.frames[..1].to_vec(), ..request.clone() };
    assert_eq!(client.solve_pose(single).await.unwrap().into_inner().frames.len(), 1);

    let cases = [
        (v1::SolvePoseRequest { frames: vec![], ..request.clone() }, Code::InvalidArgument, "found 0 frames"),
        (
            v1::SolvePoseRequest { database_id: Uuid::nil().to_string(), ..request.clone() },
            Code::NotFound,
            "exist",
        ),
        (
            v1::SolvePoseRequest { skeleton_asf: "x".into(), ..request.clone() },
            Code::InvalidArgument,
            "skeleton_asf: ",
        ),
        (
            v1::SolvePoseRequest { frame_rate_hz: 1.0, ..request.clone() },
            Code::InvalidArgument,
            "frame_rate_hz is 1, expected 10 to 10000",
        ),
        (
            v1::SolvePoseRequest {
                frames: vec![request.frames[0].clone(); 300],
                frame_rate_hz: 10.0,
                ..request.clone()
            },
            Code::InvalidArgument,
            "length of the frames is 30 s, expected at most 20 s",
        ),
        (
            v1::SolvePoseRequest { frame_rate_hz: f64::NAN, ..request },
            Code::InvalidArgument,
            "frame_rate_hz is NaN",
        ),
    ];
    for (request, code, message) in cases {
        let status = client.solve_pose(request).await.unwrap_err();
        assert_eq!(status.code(), code, "{status}");
        assert!(status.message().contains(message), "{status}");
    }
    service.stop().await;
}

#[tokio::test]
async fn health_says_when_the_service_stops() {
    use tonic_health::pb::{
        HealthCheckRequest, health_check_response::ServingStatus, health_client::HealthClient,
    };
    let fixture = Fixture::new().await;
    let service = fixture.serve(1).await;
    let request = HealthCheckRequest { service: "marey.v1.Reconstruction".to_owned() };
    let mut watch = HealthClient::new(service.channel().await).watch(request).await.unwrap().into_inner();
    let until = async |wanted: ServingStatus, watch: &mut tonic::Streaming<_>| {
        let follow = async {
            loop {
                let next: Option<tonic_health::pb::HealthCheckResponse> = watch.message().await.unwrap();
                if next.unwrap().status() == wanted {
                    return;
                }
            }
        };
        tokio::time::timeout(Duration::from_secs(30), follow).await.expect("health did not change")
    };
    until(ServingStatus::Serving, &mut watch).await;
    service.shut_down();
    until(ServingStatus::NotServing, &mut watch).await;
    drop(watch);
    service.stop().await;
}
