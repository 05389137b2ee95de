//! How far a reconstruction is from the truth, and the protocols under which that is asked (method §2).
//!
//! - [`Errors`]: all metrics of one trial, always together.
//! - [`evaluate_sparse`]: trials reconstructed from their own control points, by protocol, into [`Row`]s.
//! - [`table`]: rows as text.

mod metrics;
mod sparse_protocol;
mod summary;

pub use metrics::{Errors, compare};
pub use sparse_protocol::{
    ControlSet, Error, Protocol, SparseEvaluation, TrialResult, at_database_rate, control_trajectories,
    evaluate_sparse,
};
pub use summary::{Row, summarise, table};
