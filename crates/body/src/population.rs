//! Measurements of the people a model was learned from: coefficients are standard normal among them, and each
//! measurement is a linear function of these with some rest: `f = f̄ + B α + e`.

use model::Mesh;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::DENSITY_KG_M3;
use crate::extremes::heights;
use crate::subject::{Sex, Subject};

/// One measurement as a function of the coefficients.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Feature {
    pub mean: f64,
    /// for one standard deviation of every component
    pub slope: Vec<f64>,
    /// of what the coefficients don't tell
    pub variance: f64,
}

/// How measurements and coefficients go together; a measurement is `None` if too few scans told it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Population {
    /// stature, mass, sex, age
    pub features: [Option<Feature>; 4],
}

impl Population {
    /// Learns from shapes and their coefficients. Stature and mass are measured on the shapes.
    pub fn learn(
        faces: &[[u32; 3]],
        shapes: &[&[Vector3<f64>]],
        subjects: &[Subject],
        alphas: &[Vec<f64>],
    ) -> Self {
        let measured = shapes.iter().map(|shape| {
            let [low, high] = heights(shape);
            let mesh = Mesh { vertices: shape.to_vec(), faces: faces.to_vec() };
            [high - low, mesh.volume() * DENSITY_KG_M3]
        });
        let sex = |sex: Sex| if sex == Sex::Male { 1.0 } else { -1.0 };
        let values: Vec<[Option<f64>; 4]> = measured
            .zip(subjects)
            .map(|([stature, mass], s)| [Some(stature), Some(mass), s.sex.map(sex), s.age_years])
            .collect();
        Self { features: std::array::from_fn(|f| Feature::learn(values.iter().map(|v| v[f]), alphas)) }
    }

    /// Whether every number is finite and there are as many as coefficients.
    pub fn fits(&self, components: usize) -> bool {
        let is_fit = |f: &Feature| {
            f.slope.len() == components
                && f.slope.iter().chain([&f.mean, &f.variance]).all(|x| x.is_finite())
                && f.variance >= 0.0
        };
        self.features.iter().flatten().all(is_fit)
    }
}

impl Feature {
    fn learn(values: impl Iterator<Item = Option<f64>> + Clone, alphas: &[Vec<f64>]) -> Option<Self> {
        let known: Vec<(f64, &Vec<f64>)> =
            values.zip(alphas).filter_map(|(value, alpha)| Some((value?, alpha))).collect();
        let components = alphas.first()?.len();
        // A regression on all components needs more people than components, or it says nothing.
        if known.len() < components + 10 {
            return None;
        }
        let count = known.len() as f64;
        let mean = known.iter().map(|(value, _)| value).sum::<f64>() / count;
        // Scores of the scans are uncorrelated and of unit variance, so each slope is a covariance.
        let slope: Vec<f64> = (0..components)
            .map(|i| {
                known.iter().map(|(value, alpha)| (value - mean) * alpha[i]).sum::<f64>() / (count - 1.0)
            })
            .collect();
        let rest = |(value, alpha): &(f64, &Vec<f64>)| {
            let told: f64 = slope.iter().zip(alpha.iter()).map(|(s, a)| s * a).sum();
            (value - mean - told).powi(2)
        };
        let variance = known.iter().map(rest).sum::<f64>() / (count - 1.0 - components as f64);
        Some(Self { mean, slope, variance })
    }
}
