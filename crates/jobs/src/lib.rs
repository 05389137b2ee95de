//! What jobs are given: payloads that the gateway enqueues and a service runs.
//!
//! A payload names everything that the job reads, store keys included, so that a job gives the same result whatever is
//! uploaded, built or deleted after it was asked for. The same JSON is the run's `parameters`, which the user sees.

mod augment;
mod body_model;
mod cameras;
mod database;
mod inverse_kinematics;
mod run_report;
mod silhouettes;

pub use augment::{Augment, Error};
pub use body_model::{BUILD_BODY_MODEL, BodyModelFile, BodyModelName, BuildBodyModel, SHIPPED};
pub use cameras::{PLAN_MULTI_VIEW, PlanMultiView};
pub use database::{
    MotionDatabaseFile, MotionDatabaseName, PLAN_MOTION_DATABASE, PlanMotionDatabase, TRAIN_GPLVM, TrainGplvm,
};

pub use inverse_kinematics::{
    BodyDescription, CamerasPlanned, IkSolver, InverseKinematics, SOLVE_INVERSE_KINEMATICS,
    SolveInverseKinematics, frame_rate,
};
pub use run_report::{Code, FileReport, MultiViewReport, SessionReport, TrackingParts};
pub use silhouettes::{
    CameraReport, ClipPlace, Members, Source, SourceKind, clip_name, file_part, matches_name, picture_name,
    report_name,
};

use serde::{Deserialize, Serialize};

/// An uploaded file as a job sees it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputFile {
    /// Name given by the user.
    pub name: String,
    /// `skeleton`, `control-points`, `ground-truth`, `motion`, `scans`, `calibration`, `video`, `images`, `masks` or `plate`.
    #[serde(default)]
    pub role: String,
    /// Where it is in the object store.
    pub store_key: String,
    /// Size, bytes.
    pub bytes: u64,
    /// BLAKE3 of the content, hex.
    pub blake3: String,
}

/// Something an earlier job wrote.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Object {
    /// Where it is in the object store.
    pub store_key: String,
    /// BLAKE3 of the content, hex.
    pub blake3: String,
}

/// Who did a job, and how long it took. Goes to `run.json`, never into a motion or a body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JobReport {
    /// The worker process.
    pub worker: String,
    /// Which attempt it was, from 1.
    pub attempt: i32,
    /// Time it took, seconds.
    pub seconds: f64,
    /// Frames that it computed.
    pub frames: usize,
}
