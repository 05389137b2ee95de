//! Inverse kinematics with image constraints: at once by gRPC, and as the job of a run.

pub(crate) mod call;
pub(crate) mod job;

mod evidence;
mod export;
mod finished;
mod report;

use inverse_kinematics::Method;
use jobs::inverse_kinematics::IkSolver;

/// Most points of a figure that may be measured.
const MAX_POINTS: usize = 16;
/// Most steps of one solve.
const MAX_STEPS: usize = 200;

fn method(solver: IkSolver) -> Method {
    match solver {
        IkSolver::Plain => Method::Plain,
        IkSolver::Priority => Method::Priority,
        IkSolver::ImageConstrained => Method::ImageConstrained,
        IkSolver::Extended => Method::Extended,
        IkSolver::ImageFirst => Method::ImageFirst,
        IkSolver::ReachThenImageThenPosture => Method::ReachThenImageThenPosture,
    }
}
