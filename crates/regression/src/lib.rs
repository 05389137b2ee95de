//! Predicting the next pose from the K nearest windows of motion (docs/papers.md#local-regression).
//!
//! A [`Predictor`] sees [`Examples`] (inputs: windows and control points; targets: the poses that followed) and a
//! query, and gives a Gaussian over the next pose: a mean and the factor of a covariance.
//!
//! - [`LocalRegression`]: weighted ridge regression in its dual form, leave-one-out residuals
//!   (docs/papers.md#local-regression, eq. 4–10, changed).
//! - [`LocalPca`]: principal components of the successors, and smoothness (Chai & Hodgins;
//!   docs/papers.md#local-principal-components).
//! - [`PrincipalRegression`]: least squares on the principal components of the inputs
//!   (Liu et al.; docs/papers.md#principal-component-regression).
//! - [`gplvm`]: a global latent variable model, trained offline.
//! - [`NearestExample`]: the successor of the nearest window; the plain baseline.
//!
//! ```
//! use regression::{Examples, LocalRegression, Parameters, Prediction, Predictor, Query};
//! let (inputs, targets) = (vec![0.0, 1.0, 2.0, 3.0], vec![0.0, 2.0, 4.0, 6.0]);
//! let examples = Examples { width: 1, dofs: 1, inputs: &inputs, targets: &targets, distances_squared: &[2.2, 0.2, 0.3, 2.3] };
//! let mut prediction = Prediction::new(4, 1);
//! let parameters = Parameters { ridge: 1e-6, ridge_distance: 0.0, ..Parameters::default() };
//! LocalRegression::new(4, 1).predict(&examples, &Query { inputs: &[1.5], recent: &[] }, &parameters, &mut prediction);
//! assert!((prediction.mean[0] - 3.0).abs() < 1e-3);
//! ```

mod error;
pub mod gplvm;
mod local;
mod lpca;
mod lpcr;
mod nearest;
mod prediction;
mod principal;

pub use error::Error;
pub use local::LocalRegression;
pub use lpca::{LocalPca, LpcaParameters};
pub use lpcr::{LpcrParameters, PrincipalRegression};
pub use nearest::NearestExample;
pub use prediction::{Examples, Parameters, Prediction, Predictor, Query, kernel_weights};

/// Result of the fallible functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;
