use crate::prediction::kernel_weights;
use crate::{Examples, Parameters, Prediction, Predictor, Query};

/// The plain baseline: the next pose is the successor of the nearest window; its uncertainty is the weighted spread
/// of the neighbours' successors about it.
#[derive(Debug, Clone, Default)]
pub struct NearestExample;

impl Predictor for NearestExample {
    fn predict(
        &mut self,
        examples: &Examples<'_>,
        _query: &Query<'_>,
        parameters: &Parameters,
        out: &mut Prediction,
    ) {
        let Some(nearest) = examples.nearest() else { return };
        out.rows = examples.len();
        out.sigma.fill(parameters.min_sigma);
        kernel_weights(examples.distances_squared, parameters.bandwidth, &mut out.weights);
        out.mean.copy_from_slice(examples.target(nearest));
        for k in 0..examples.len() {
            let root = out.weights[k].sqrt();
            let residuals = &mut out.residuals[k * examples.dofs..(k + 1) * examples.dofs];
            for ((r, y), m) in residuals.iter_mut().zip(examples.target(k)).zip(&out.mean) {
                *r = root * (y - m);
            }
        }
    }
}
