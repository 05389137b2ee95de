//! Inverse kinematics with image constraints: at once by gRPC, and as the job of a run.

pub(crate) mod call;
pub(crate) mod job;

mod evidence;
mod export;
mod finished;
mod outliers;
mod report;

/// Most points of a figure that may be measured.
const MAX_POINTS: usize = 16;
/// Most steps of one solve.
const MAX_STEPS: usize = 200;
