//! How long one prediction takes, by the number of neighbours: windows of two 62-DOF poses and six control points.

use divan::Bencher;
use regression::{Examples, LocalRegression, Parameters, Prediction, Predictor, Query};

fn main() {
    divan::main();
}

const WIDTH: usize = 2 * 62 + 18;
const DOFS: usize = 62;

#[divan::bench(args = [32, 64, 128, 256])]
fn local_regression(bencher: Bencher, neighbours: usize) {
    let wave = |count: usize, speed: f64| -> Vec<f64> {
        (0..count).map(|i| 10.0 * (i as f64 * speed + (i as f64).sqrt()).sin()).collect()
    };
    let (inputs, targets) = (wave(neighbours * WIDTH, 0.71), wave(neighbours * DOFS, 0.37));
    let distances_squared: Vec<f64> = (0..neighbours).map(|k| 100.0 + k as f64).collect();
    let inputs_now = wave(WIDTH, 1.3);
    let query = Query { inputs: &inputs_now, recent: &[] };
    let examples = Examples {
        width: WIDTH,
        dofs: DOFS,
        inputs: &inputs,
        targets: &targets,
        distances_squared: &distances_squared,
    };
    let mut regression = LocalRegression::new(neighbours, DOFS);
    let mut prediction = Prediction::new(neighbours, DOFS);
    let parameters = Parameters::default();
    bencher.bench_local(|| regression.predict(&examples, &query, &parameters, &mut prediction));
}
