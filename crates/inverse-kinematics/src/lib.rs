//! Inverse kinematics whose freedom is used by images (Jaume-i-Capó et al. 2010;
//! docs/papers.md#image-constrained-inverse-kinematics).
//!
//! A chain has more joints than its end effectors need. `Δθ = J⁺Δx + α (I − J⁺J) ∇h` moves the end effectors to where they
//! were measured, and what that leaves free is moved so that the chain's segments, seen by the cameras, lie inside the
//! silhouettes. h is the mean of an image support along the projected segments; its gradient is that of the image times the
//! projection's Jacobian times the kinematic Jacobian.
//!
//! - [`Chain`]: any `model::Skeleton` with its points, segments and limits: four links in a plane, a limb, a body
//!   ([`rig::RigChain`]).
//! - [`Task`], [`Options`]: what is wanted, in levels of strict priority (Baerlocher and Boulic 2004), and what the last
//!   null space is used for.
//! - [`Support`], [`ImageView`]: silhouettes made ready. Any number of views.
//! - [`Solver`]: the steps. They take no memory.
//! - [`Figure`], [`sequence::SequenceSolver`]: a body or a skeleton through frames of measured points and silhouettes, by a [`Method`].
//!
//! ```
//! use inverse_kinematics::{Chain, Evidence, Options, Solver};
//! use kinematics::Parametrisation;
//! use model::{Axis, Channel, Joint, Skeleton};
//! use nalgebra::Vector3;
//! let mut upper = Joint::root("upper", vec![Channel::rotation(Axis::Z)]);
//! upper.tip = Vector3::x();
//! let mut lower = Joint::child("lower", 0, Vector3::x(), vec![Channel::rotation(Axis::Z)]);
//! lower.tip = Vector3::x();
//! let arm = Skeleton::new("arm", vec![upper, lower]).unwrap();
//! let points = kinematics::control_points(&arm, &["lower.tip"]).unwrap();
//! let chain = Chain::new(&arm, Parametrisation::channels(&arm), points).unwrap();
//! let mut solver = Solver::new(chain, Options { steps: 50, ..Options::reach(&[0]) }).unwrap();
//! let mut x = [0.3, 0.3];
//! let evidence = Evidence { targets: &[Some(Vector3::new(1.0, 1.0, 0.0))], views: &[], posture: &[0.0, 0.0] };
//! let outcome = solver.solve(&mut x, &evidence).unwrap();
//! assert!(outcome.residual_m < 1e-6 && x[0].abs() < 1e-5);
//! ```

mod chain;
mod error;
mod figure;
pub mod flesh;
mod gain;
mod image;
mod method;
mod options;
mod priority;
pub mod rig;
pub mod sequence;
mod solver;
mod support;

pub use chain::Chain;
pub use error::Error;
pub use figure::Figure;
pub use image::{ImageView, Overlap};
pub use method::Method;
pub use options::{Criterion, Options, Task};
pub use priority::Priorities;
pub use solver::{Evidence, Outcome, Solver};
pub use support::{Support, SupportWidth};

/// Result of the fallible functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;
