//! The jobs of every run kind, a module each: what they are given and what they leave for each other.
//!
//! What is given to a job names everything that it reads, store keys included, so that a job gives the same result whatever
//! is uploaded, built or deleted after it was asked for. That of a run's first job is also the run's `parameters`, which the
//! user sees.

mod artefacts;
pub mod body_model;
pub mod inverse_kinematics;
pub mod motion_database;
pub mod multi_view;
mod report;
pub mod run_json;
mod session;
pub mod sparse;
mod versions;

pub use artefacts::{InputFile, Object, file_part, named};
pub use report::JobReport;
pub use session::{CameraChoice, PointChoice, SessionInputs, bvh_centimetres};
