//! The most probable pose: energy terms, one a file, and the solver that minimises their sum
//! (docs/papers.md#local-regression, eq. 1 and 2).
//!
//! ```text
//! E(x) = Σ_p ‖f_p(x) − c_p‖²/σ_p²  +  (x − μ)ᵀ Σ⁻¹ (x − μ)
//! ```
//!
//! - [`ControlPoints`]: the likelihood, where points were measured.
//! - [`GaussianPrior`]: the prior over coordinates, with a full or a diagonal covariance.
//! - [`MapSolver`]: Levenberg–Marquardt in the space of the measurements: a step is a solve of size 3P, at most 48
//!   (Woodbury, docs/papers.md#dual-form), and the inverse of Σ is never taken.

mod control_points;
mod linearisation;
mod prior;
mod solver;

pub use control_points::{ControlPoints, Measurement};
pub use prior::GaussianPrior;
pub use solver::{MapSolver, Solution, SolverParameters};
