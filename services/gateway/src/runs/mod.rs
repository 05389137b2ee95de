//! Runs: what they are asked for by, one request type a kind; how they are started, and how they stand.

mod body_model;
mod build;
mod cameras;
pub(crate) mod enqueue;
mod inverse_kinematics;
mod markers;
mod motion_database;
mod multi_view;
pub(crate) mod request;
pub(crate) mod run;
pub(crate) mod session_run;
mod sparse;
mod training;
mod units;

pub(crate) use body_model::NewBodyModelBuild;
pub(crate) use build::build;
pub(crate) use motion_database::NewBuild;
pub(crate) use run::{Run, RunWithJobs};
pub(crate) use sparse::resolve_parameters;
pub(crate) use training::{NewTraining, train};
pub use units::UNITS;

use session_run::Kind;

/// The kinds of runs on sessions: another one is a file and a line here.
const KINDS: &[Kind] = &[
    Kind::new::<sparse::SparseRun>(),
    Kind::new::<multi_view::MultiViewRun>(),
    Kind::new::<inverse_kinematics::InverseKinematicsRun>(),
];

/// The fields that requests for runs on sessions have, of all kinds.
pub fn session_run_fields() -> std::collections::BTreeSet<String> {
    KINDS.iter().flat_map(|kind| (kind.object)().properties.into_keys()).collect()
}

/// The kinds of runs on sessions, as requests name them.
pub fn session_run_kinds() -> impl Iterator<Item = &'static str> {
    KINDS.iter().map(|kind| kind.name)
}
