//! What a prediction must be, whatever the examples.

use regression::{
    Examples, LocalRegression, NearestExample, Parameters, Prediction, Predictor, Query, kernel_weights,
};

const EXACT: Parameters = Parameters { ridge: 1e-6, ridge_distance: 0.0, bandwidth: 1.0, min_sigma: 1.0 };

fn at(inputs: &[f64]) -> Query<'_> {
    Query { inputs, recent: &[] }
}

/// Examples of `y = A x + b`, on a grid that is known in full.
fn affine(k: usize, width: usize, dofs: usize) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let inputs: Vec<f64> = (0..k * width).map(|i| 10.0 * (i as f64 * i as f64 * 0.7).sin()).collect();
    let targets = inputs.chunks_exact(width).flat_map(|x| (0..dofs).map(|d| line(x, d)).collect::<Vec<_>>());
    let targets = targets.collect();
    let distances = (0..k).map(|i| 1.0 + i as f64).collect();
    (inputs, targets, distances)
}

fn line(x: &[f64], dof: usize) -> f64 {
    dof as f64 + x.iter().enumerate().map(|(i, v)| v * ((i + dof) as f64).cos()).sum::<f64>()
}

#[test]
fn what_is_affine_is_predicted_beyond_the_examples() {
    let (k, width, dofs) = (40, 6, 5);
    let (inputs, targets, distances) = affine(k, width, dofs);
    let examples =
        Examples { width, dofs, inputs: &inputs, targets: &targets, distances_squared: &distances };
    let mut prediction = Prediction::new(k, dofs);
    let query: Vec<f64> = (0..width).map(|i| 25.0 + i as f64).collect();
    LocalRegression::new(k, dofs).predict(&examples, &at(&query), &EXACT, &mut prediction);
    for d in 0..dofs {
        assert!((prediction.mean[d] - line(&query, d)).abs() < 1e-4, "target {d}");
    }
    assert!(prediction.residuals.iter().all(|r| r.abs() < 1e-4));
}

/// The same memory gives the same prediction whatever it was used for before.
#[test]
fn a_prediction_does_not_depend_on_the_one_before() {
    let (width, dofs) = (6, 5);
    let (inputs, targets, distances) = affine(40, width, dofs);
    let with = |k: usize| Examples {
        width,
        dofs,
        inputs: &inputs[..k * width],
        targets: &targets[..k * dofs],
        distances_squared: &distances[..k],
    };
    let query = vec![1.0; width];
    let parameters = Parameters::default();
    let mut used = LocalRegression::new(40, dofs);
    let mut out = Prediction::new(40, dofs);
    used.predict(&with(40), &at(&[3.0; 6]), &parameters, &mut out);
    used.predict(&with(7), &at(&query), &parameters, &mut out);
    let (mut fresh, mut expected) = (LocalRegression::new(40, dofs), Prediction::new(40, dofs));
    fresh.predict(&with(7), &at(&query), &parameters, &mut expected);
    assert_eq!(out.mean, expected.mean);
    assert_eq!(out.residuals[..7 * dofs], expected.residuals[..7 * dofs]);
}

#[test]
fn a_strong_ridge_predicts_the_weighted_mean() {
    let (inputs, targets, distances) = affine(20, 3, 2);
    let examples =
        Examples { width: 3, dofs: 2, inputs: &inputs, targets: &targets, distances_squared: &distances };
    let parameters = Parameters { ridge: 1e12, ..EXACT };
    let mut out = Prediction::new(20, 2);
    LocalRegression::new(20, 2).predict(&examples, &at(&[50.0; 3]), &parameters, &mut out);
    for d in 0..2 {
        let mean: f64 = (0..20).map(|k| out.weights[k] * targets[2 * k + d]).sum();
        assert!((out.mean[d] - mean).abs() < 1e-6);
    }
}

#[test]
fn the_nearest_example_is_its_own_successor() {
    let (inputs, targets, mut distances) = affine(20, 3, 2);
    distances[11] = 0.5;
    let examples =
        Examples { width: 3, dofs: 2, inputs: &inputs, targets: &targets, distances_squared: &distances };
    let mut out = Prediction::new(20, 2);
    NearestExample.predict(&examples, &at(&[0.0; 3]), &Parameters::default(), &mut out);
    assert_eq!(out.mean, targets[22..24]);
    assert_eq!(out.residuals[22..24], [0.0, 0.0]);
}

/// Equal windows at distance 0, one window many times, two windows far apart: nothing is divided by zero.
#[test]
fn degenerate_examples_give_finite_predictions() {
    let (width, dofs) = (4, 3);
    for k in [1, 2, 16] {
        for (spread, distance) in [(0.0, 0.0), (0.0, 4.0), (1e-9, 1e-18), (1e6, 1e12), (1e-3, 1e18)] {
            let inputs: Vec<f64> = (0..k * width).map(|i| 3.0 + spread * (i as f64).sin()).collect();
            let targets: Vec<f64> = (0..k * dofs).map(|i| 1.0 + spread * (i as f64).cos()).collect();
            let distances = vec![distance; k];
            let examples =
                Examples { width, dofs, inputs: &inputs, targets: &targets, distances_squared: &distances };
            let mut out = Prediction::new(k, dofs);
            let mut regression = LocalRegression::new(k, dofs);
            regression.predict(&examples, &at(&[3.0; 4]), &Parameters::default(), &mut out);
            let all = out.mean.iter().chain(&out.residuals).chain(&out.weights);
            assert!(all.clone().all(|v| v.is_finite()), "{k} examples, spread {spread}, {distance}: {out:?}");
            assert!((out.weights.iter().sum::<f64>() - 1.0).abs() < 1e-9);
        }
    }
}

/// A control point from a broken file may be anywhere: its distances overflow, the weights must not.
#[test]
fn weights_of_infinite_distances_are_finite() {
    for distances in [[f64::INFINITY; 3], [1.0, f64::INFINITY, f64::INFINITY], [f64::MAX; 3]] {
        let mut weights = [0.0; 3];
        kernel_weights(&distances, 1.0, &mut weights);
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{distances:?}: {weights:?}");
    }
}
