use std::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};

/// Number of samples over a segment to which a basis is fitted.
pub(crate) const SAMPLES: usize = 64;

/// Functions of phase in [0, 1] whose sums describe one channel over one segment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Basis {
    /// 1, cos 2πφ, sin 2πφ, cos 4πφ, …: for what repeats
    Cycle {
        /// number of harmonics H; 1 + 2H functions
        harmonics: usize,
    },
    /// 1, cos πφ, cos 2πφ, …: for what happens once, at rest at both ends
    Once {
        /// number of functions
        cosines: usize,
    },
}

impl Basis {
    /// Number of functions.
    pub fn len(self) -> usize {
        match self {
            Self::Cycle { harmonics } => 1 + 2 * harmonics,
            Self::Once { cosines } => cosines,
        }
    }

    /// Phase of a sample, 0..[`SAMPLES`], at which the functions are orthogonal.
    pub fn sample_phase(self, sample: usize) -> f64 {
        match self {
            Self::Cycle { .. } => sample as f64 / SAMPLES as f64,
            Self::Once { .. } => (sample as f64 + 0.5) / SAMPLES as f64,
        }
    }

    /// Values of all functions at a phase, shape `[len]`.
    pub fn values(self, phase: f64, out: &mut [f64]) {
        out[0] = 1.0;
        match self {
            Self::Cycle { .. } => {
                for (h, pair) in out[1..].chunks_exact_mut(2).enumerate() {
                    let (sin, cos) = ((h + 1) as f64 * TAU * phase).sin_cos();
                    pair[0] = cos;
                    pair[1] = sin;
                }
            }
            Self::Once { .. } => {
                for (k, value) in out.iter_mut().enumerate().skip(1) {
                    *value = (k as f64 * PI * phase).cos();
                }
            }
        }
    }

    /// Coefficients of the least-squares fit to [`SAMPLES`] samples of one channel, shape `[len]`.
    pub fn fit(self, samples: &[f64], out: &mut [f64]) {
        let mut values = vec![0.0; self.len()];
        out.fill(0.0);
        for (sample, x) in samples.iter().enumerate() {
            self.values(self.sample_phase(sample), &mut values);
            for (coefficient, value) in out.iter_mut().zip(&values) {
                *coefficient += x * value * 2.0 / samples.len() as f64;
            }
        }
        out[0] *= 0.5;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fit_finds_the_coefficients_of_its_own_functions() {
        for basis in [Basis::Cycle { harmonics: 3 }, Basis::Once { cosines: 7 }] {
            let expected = [0.5, -1.0, 2.0, 0.25, 0.1, -0.3, 0.7];
            let mut values = vec![0.0; basis.len()];
            let samples: Vec<f64> = (0..SAMPLES)
                .map(|s| {
                    basis.values(basis.sample_phase(s), &mut values);
                    values.iter().zip(&expected).map(|(v, c)| v * c).sum()
                })
                .collect();
            let mut found = vec![0.0; basis.len()];
            basis.fit(&samples, &mut found);
            for (f, e) in found.iter().zip(expected) {
                assert!((f - e).abs() < 1e-12, "{found:?} is not {expected:?}");
            }
        }
    }
}
