//! The most probable pose: energy terms, one a file, and the solver that minimises their sum (method §2).
//!
//! ```text
//! E(x) = Σ_p ‖f_p(x) − c_p‖²/σ_p²  +  (x − μ)ᵀ Σ⁻¹ (x − μ)
//! ```
//!
//! - [`ControlPoints`]: the likelihood, where points were measured.
//! - [`GaussianPrior`]: the prior over coordinates, with a full or a diagonal covariance.
//! - [`MapSolver`]: Levenberg–Marquardt in the space of the measurements: a step is a solve of size 3P ≤ 18
//!   (Woodbury, method §2, mend 5), and the inverse of Σ is never taken.

mod control_points;
mod linearisation;
mod prior;
mod solver;

pub use control_points::{ControlPoints, Measurement};
pub use prior::GaussianPrior;
pub use solver::{MapSolver, Solution, SolverParameters};
