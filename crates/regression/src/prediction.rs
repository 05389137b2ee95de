/// The neighbours of a frame. Units are the features' (degrees and centimetres).
#[derive(Debug, Clone, Copy)]
pub struct Examples<'a> {
    /// number of inputs of an example
    pub width: usize,
    /// number of targets of an example, D
    pub dofs: usize,
    /// windows and control points, row-major, shape `[K, width]`
    pub inputs: &'a [f64],
    /// poses that followed, row-major, shape `[K, dofs]`
    pub targets: &'a [f64],
    /// squared distances of the inputs to the query, shape `[K]`
    pub distances_squared: &'a [f64],
}

impl Examples<'_> {
    /// Number of neighbours K.
    pub fn len(&self) -> usize {
        self.distances_squared.len()
    }

    /// Whether there is no neighbour.
    pub fn is_empty(&self) -> bool {
        self.distances_squared.is_empty()
    }

    /// The example nearest to the query, the first of several; `None` if there is none.
    pub fn nearest(&self) -> Option<usize> {
        let distances = self.distances_squared.iter().enumerate();
        distances.min_by(|a, b| a.1.total_cmp(b.1)).map(|(k, _)| k)
    }

    /// Target of example `k`, shape `[dofs]`.
    pub fn target(&self, k: usize) -> &[f64] {
        &self.targets[k * self.dofs..(k + 1) * self.dofs]
    }
}

/// What is known at a frame.
#[derive(Debug, Clone, Copy)]
pub struct Query<'a> {
    /// what the examples' inputs are compared with, shape `[width]`
    pub inputs: &'a [f64],
    /// the last poses in the units and the frame of the targets, newest first, row-major, shape `[window, dofs]`
    pub recent: &'a [f64],
}

impl<'a> Query<'a> {
    /// The pose `back` frames ago (1: the newest), shape `[dofs]`; `None` beyond the window.
    pub fn pose(&self, back: usize, dofs: usize) -> Option<&'a [f64]> {
        self.recent.get((back - 1) * dofs..back * dofs)
    }
}

/// What a prediction depends on besides its examples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters {
    /// ridge λ that is always there, squared feature units: (3°)²
    pub ridge: f64,
    /// further ridge per squared distance of the nearest example, divided by the number of inputs
    pub ridge_distance: f64,
    /// the kernel's h² relative to the median squared distance of the neighbours
    pub bandwidth: f64,
    /// least standard deviation of a target, feature units: 1°. A DOF on which the neighbours agree is not
    /// infinitely sure (docs/papers.md#residual-covariance)
    pub min_sigma: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        Self { ridge: 9.0, ridge_distance: 1.0, bandwidth: 1.0, min_sigma: 1.0 }
    }
}

/// A Gaussian over the next pose: mean μ and covariance `EᵀE + diag(σ²)`.
#[derive(Debug, Clone)]
pub struct Prediction {
    /// μ, shape `[dofs]`
    pub mean: Vec<f64>,
    /// E, row-major; the leading `rows` rows count, shape `[K, dofs]`: residuals of the examples, each times the root of
    /// its weight, or principal directions, each times its standard deviation
    pub residuals: Vec<f64>,
    /// number of rows of E
    pub rows: usize,
    /// σ: what is uncertain besides, shape `[dofs]`
    pub sigma: Vec<f64>,
    /// kernel weights ω of the examples, sum 1, shape `[K]`
    pub weights: Vec<f64>,
}

impl Prediction {
    /// Memory for `neighbours` examples of `dofs` targets.
    pub fn new(neighbours: usize, dofs: usize) -> Self {
        Self {
            mean: vec![0.0; dofs],
            residuals: vec![0.0; neighbours * dofs],
            rows: 0,
            sigma: vec![0.0; dofs],
            weights: vec![0.0; neighbours],
        }
    }
}

/// A method that predicts the next pose from examples. It keeps its memory from frame to frame, but nothing that a
/// prediction depends on, and does not allocate while the number of examples stays within what it was made for.
pub trait Predictor {
    /// Predicts at `query`.
    fn predict(
        &mut self,
        examples: &Examples<'_>,
        query: &Query<'_>,
        parameters: &Parameters,
        out: &mut Prediction,
    );

    /// For priors that are Gaussian only to first order: linearises the last prediction again about `found`, the most
    /// probable pose under it (shape `[dofs]`, units and frame of the targets), whose likelihood has energy `likelihood`.
    /// `false` if `out` is as good as it gets and `found` is the answer.
    fn relinearise(&mut self, _found: &[f64], _likelihood: f64, _out: &mut Prediction) -> bool {
        false
    }
}

/// Gaussian kernel weights `ω_k ∝ exp(−½ d_k²/h²)` with h² = `bandwidth` times the median of d² (docs/papers.md#example-weights),
/// shape `[K]`, sum 1. With all distances 0 they are equal.
pub fn kernel_weights(distances_squared: &[f64], bandwidth: f64, out: &mut [f64]) {
    let count = distances_squared.len();
    if count == 0 {
        return;
    }
    // Neighbours come nearest first; if not, the median is still found.
    let out = &mut out[..count];
    // What lies at infinity (a control point from a broken file) is far, but a number.
    let finite = |d: &f64| d.min(f64::MAX);
    for (out, d) in out.iter_mut().zip(distances_squared) {
        *out = finite(d);
    }
    out.sort_unstable_by(f64::total_cmp);
    let (nearest, median) = (out[0], out[count / 2]);
    let h_squared = (bandwidth * median).max(1e-12);
    let mut sum = 0.0;
    for (w, d) in out.iter_mut().zip(distances_squared) {
        // The nearest has exponent 0: a common factor that normalisation takes out again keeps the rest from underflow.
        *w = (-0.5 * (finite(d) - nearest) / h_squared).exp();
        sum += *w;
    }
    out.iter_mut().for_each(|w| *w /= sum);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_of_huge_distances_do_not_underflow() {
        let mut weights = [0.0; 3];
        kernel_weights(&[1e9, 1.1e9, 1.2e9], 1.0, &mut weights);
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(weights[0] > weights[1] && weights[1] > weights[2] && weights[2] > 0.1);
    }

    #[test]
    fn weights_of_equal_examples_are_equal() {
        let mut weights = [0.0; 4];
        kernel_weights(&[0.0; 4], 1.0, &mut weights);
        assert_eq!(weights, [0.25; 4]);
    }
}
