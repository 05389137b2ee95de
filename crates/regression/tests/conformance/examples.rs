//! Examples to predict from, deterministic.

use std::fmt;
use std::ops::ControlFlow;

use regression::gplvm::{Gplvm, TrainingOptions, TrainingSet, train};
use regression::{Examples, Prediction, Query};

/// Where a coordinate stands that never moves.
pub const STILL: f64 = 12.5;

/// Numbers in [-1, 1].
pub fn numbers(count: usize, seed: u64) -> Vec<f64> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
    };
    (0..count).map(|_| next()).collect()
}

/// `A x + b`, one row of it.
pub fn line(x: &[f64], dof: usize) -> f64 {
    dof as f64 + x.iter().enumerate().map(|(i, v)| v * ((i + dof) as f64).cos()).sum::<f64>()
}

/// Examples and a query.
#[derive(Debug, Clone)]
pub struct Case {
    pub width: usize,
    pub dofs: usize,
    pub inputs: Vec<f64>,
    pub targets: Vec<f64>,
    pub distances_squared: Vec<f64>,
    pub inputs_now: Vec<f64>,
    pub recent: Vec<f64>,
}

impl Case {
    /// Examples that are `spread` apart, all at one squared distance from the query.
    pub fn spread(count: usize, width: usize, dofs: usize, spread: f64, distance: f64) -> Self {
        Self {
            width,
            dofs,
            inputs: numbers(count * width, 1).iter().map(|v| 3.0 + spread * v).collect(),
            targets: numbers(count * dofs, 2).iter().map(|v| 1.0 + spread * v).collect(),
            distances_squared: vec![distance; count],
            inputs_now: vec![3.0; width],
            recent: vec![1.0; 2 * dofs],
        }
    }

    /// A motion: examples are moments of it, the query is near the first.
    pub fn smooth(count: usize, width: usize, dofs: usize) -> Self {
        let pose = |t: f64| (0..dofs).map(move |d| motion(t, d));
        let time = |k: usize| 0.37 * k as f64;
        Self {
            width,
            dofs,
            inputs: (0..count * width).map(|i| motion(time(i / width) - 0.1, i % width)).collect(),
            targets: (0..count).flat_map(|k| pose(time(k))).collect(),
            distances_squared: (0..count).map(|k| 1.0 + k as f64).collect(),
            inputs_now: (0..width).map(|i| motion(-0.05, i)).collect(),
            recent: pose(-0.05).chain(pose(-0.15)).collect(),
        }
    }

    /// Targets that are affine in the inputs.
    pub fn affine(count: usize, width: usize, dofs: usize) -> Self {
        let inputs: Vec<f64> = numbers(count * width, 7).iter().map(|v| 10.0 * v).collect();
        let targets = inputs.chunks_exact(width).flat_map(|x| (0..dofs).map(|d| line(x, d)));
        Self { targets: targets.collect(), inputs, ..Self::smooth(count, width, dofs) }
    }

    /// The same examples, the last first.
    pub fn reversed(&self) -> Self {
        let mut other = self.clone();
        other.inputs = self.inputs.chunks_exact(self.width).rev().flatten().copied().collect();
        other.targets = self.targets.chunks_exact(self.dofs).rev().flatten().copied().collect();
        other.distances_squared.reverse();
        other
    }

    pub fn examples(&self) -> Examples<'_> {
        Examples {
            width: self.width,
            dofs: self.dofs,
            inputs: &self.inputs,
            targets: &self.targets,
            distances_squared: &self.distances_squared,
        }
    }

    pub fn query(&self) -> Query<'_> {
        Query { inputs: &self.inputs_now, recent: &self.recent }
    }
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (first, distance) = (self.targets.first(), self.distances_squared.first());
        write!(
            f,
            "{} examples, target {first:?}, squared distance {distance:?}",
            self.distances_squared.len()
        )
    }
}

/// A coordinate of a motion in time, degrees.
pub fn motion(time: f64, dof: usize) -> f64 {
    20.0 * (time + 0.9 * dof as f64).sin() + 8.0 * (2.0 * time + dof as f64).cos()
}

/// (Σ)_dd of a prediction.
pub fn variance(out: &Prediction, d: usize) -> f64 {
    let dofs = out.mean.len();
    let rows: f64 = (0..out.rows).map(|k| out.residuals[k * dofs + d].powi(2)).sum();
    rows + out.sigma[d].powi(2)
}

/// Poses of [`motion`], a tenth apart.
pub fn training_set(dofs: usize) -> TrainingSet {
    let time = |i: usize| 0.1 * i as f64;
    TrainingSet {
        dofs,
        poses: (0..120 * dofs).map(|i| motion(time(i / dofs), i % dofs)).collect(),
        velocities: (0..120 * dofs)
            .map(|i| motion(time(i / dofs), i % dofs) - motion(time(i / dofs) - 0.1, i % dofs))
            .collect(),
    }
}

fn trained(set: &TrainingSet) -> Gplvm {
    let options = TrainingOptions { latent_dims: 2, active: 24, max_iterations: 30 };
    train(set, &options, &mut |_, _| ControlFlow::Continue(())).expect("the set is large enough and finite")
}

/// A small model of [`motion`].
pub fn model(dofs: usize) -> Gplvm {
    trained(&training_set(dofs))
}

/// As [`model`], with the coordinate `still` at [`STILL`] all the time.
pub fn still_model(dofs: usize, still: usize) -> Gplvm {
    let mut set = training_set(dofs);
    set.poses.chunks_exact_mut(dofs).for_each(|pose| pose[still] = STILL);
    set.velocities.chunks_exact_mut(dofs).for_each(|velocity| velocity[still] = 0.0);
    trained(&set)
}
