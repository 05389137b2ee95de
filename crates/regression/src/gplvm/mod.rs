//! The Scaled Gaussian Process Latent Variable Model of Grochow et al. (2004; docs/papers.md#latent-variable-model):
//! one global model of poses, learned offline, one for a database.
//!
//! A pose and its velocity are features `y` of a point `x` in a space of 2 to 5 latent dimensions. Each feature is a
//! Gaussian process over the latent space, with its own scale `w_k`, seen at an *active set* of a few hundred poses:
//!
//! ```text
//! k(x, x') = exp(−γ/2 ‖x − x'‖²) + β⁻¹ δ(x, x'),     K_ij = k(x_i, x_j)
//! f(x) = μ + Yᵀ K⁻¹ k(x),     σ²(x) = k(x, x) − k(x)ᵀ K⁻¹ k(x)
//! L(x_1 … x_N, γ, β, w) = F/2 ln|K| + ½ Σ_k w_k² Y_kᵀ K⁻¹ Y_k − N Σ_k ln w_k + ½ Σ_i ‖x_i‖² + ln γ + ln β
//! ```
//!
//! - [`train`] chooses the active set and minimises L: `train(&TrainingSet, &TrainingOptions, &mut progress) -> Gplvm`.
//!   The crate `sparse` makes the training set of a motion database: `sparse::train_gplvm`.
//! - [`Gplvm::to_bytes`], [`Gplvm::from_bytes`]: the trained model as one small file (a few hundred kilobytes),
//!   versioned and checksummed; any bytes may be read. It belongs to one version of one database.
//! - [`GplvmPredictor`]: the prior over the next pose. The most probable pose and latent point are sought together:
//!   the latent point is linearised about its best value and integrated out, which gives the solver a Gaussian; the
//!   pose it finds gives a better latent point; and so on until the joint energy no longer falls.
//!
//! The same training set and options give the same bits.

mod active_set;
mod bytes;
mod kernel;
mod lbfgs;
mod linearisation;
mod model;
mod objective;
mod predictor;
mod stored;
mod training;
mod training_set;

pub use model::Gplvm;
pub use predictor::{GplvmParameters, GplvmPredictor};
pub use training::{TrainingOptions, train};
pub use training_set::TrainingSet;
