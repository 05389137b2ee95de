//! Reports as one page of HTML each: nothing is loaded from elsewhere, no script runs.

mod curves;
mod page;
mod plot;
mod run;
mod sparse;

pub use page::About;
pub use run::{run_errors, run_report};
pub use sparse::sparse_report;

/// What the numbers mean, for who reads a report without this documentation.
const READING: &str = "\
RMS and MAE: root mean square and mean absolute difference of the joint angles (the root's left out), degrees; of the Euler angles \
that mean the same rotation the nearest are compared. Geodesic: mean angle between true and found rotation of a joint. MPJPE: mean \
distance of joints and bone ends from their true places; aligned: after the roots were brought together. Foot slide: mean horizontal speed \
of the ball of a foot while it stands. Every figure over several trials is the mean of the trials' figures, with their standard \
deviation in brackets.";
