//! A prediction takes no memory, whatever the number of examples up to the one it was made for.

use regression::{Examples, LocalRegression, NearestExample, Parameters, Prediction, Predictor, Query};

fn numbers(count: usize, seed: u64) -> Vec<f64> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
    };
    (0..count).map(|_| next()).collect()
}

fn allocations(predictor: &mut dyn Predictor, k: usize, width: usize, dofs: usize) -> u64 {
    let (inputs, targets) = (numbers(k * width, 1), numbers(k * dofs, 2));
    let mut distances_squared: Vec<f64> = numbers(k, 3).iter().map(|d| 100.0 * d.abs()).collect();
    distances_squared.sort_by(f64::total_cmp);
    let examples =
        Examples { width, dofs, inputs: &inputs, targets: &targets, distances_squared: &distances_squared };
    let inputs = numbers(width, 4);
    let query = Query { inputs: &inputs, recent: &[] };
    let mut prediction = Prediction::new(64, dofs);
    // The matrix product sets itself up the first time a thread uses it.
    predictor.predict(&examples, &query, &Parameters::default(), &mut prediction);
    let counted = allocation_counter::measure(|| {
        predictor.predict(&examples, &query, &Parameters::default(), &mut prediction);
    });
    assert!(prediction.mean.iter().chain(&prediction.residuals).all(|v| v.is_finite()));
    counted.count_total
}

#[test]
fn a_prediction_takes_no_memory() {
    for k in [64, 63, 2, 1] {
        assert_eq!(allocations(&mut LocalRegression::new(64, 62), k, 142, 62), 0, "{k} examples");
        assert_eq!(allocations(&mut NearestExample, k, 142, 62), 0, "{k} examples");
    }
}
