//! What every method must be, whatever the examples: one suite, run over all of them.

mod examples;
mod gplvm;

use examples::Case;
use regression::gplvm::{GplvmParameters, GplvmPredictor};
use regression::{
    LocalPca, LocalRegression, LpcaParameters, LpcrParameters, NearestExample, Parameters, Prediction,
    Predictor, PrincipalRegression,
};

/// Most examples that a predictor under test is made for.
const MOST: usize = 64;

/// A name and a maker of a predictor, for inputs and targets of these widths.
type Maker<'a> = (&'static str, Box<dyn Fn(usize, usize) -> Box<dyn Predictor + 'a> + 'a>);

/// Every method. `model`, of poses of as many numbers as the targets, is that of the last.
fn methods(model: &regression::gplvm::Gplvm) -> Vec<Maker<'_>> {
    vec![
        ("local-regression", Box::new(|_, dofs| Box::new(LocalRegression::new(MOST, dofs)))),
        ("nearest", Box::new(|_, _| Box::new(NearestExample))),
        ("lpca", Box::new(|_, dofs| Box::new(LocalPca::new(MOST, dofs, LpcaParameters::default())))),
        (
            "lpcr",
            Box::new(|width, dofs| {
                Box::new(PrincipalRegression::new(MOST, width, dofs, LpcrParameters { components: 16 }))
            }),
        ),
        ("gplvm", Box::new(|_, _| Box::new(GplvmPredictor::new(model, GplvmParameters::default())))),
    ]
}

fn predict(predictor: &mut dyn Predictor, case: &Case) -> Prediction {
    let mut out = Prediction::new(MOST, case.dofs);
    predictor.predict(&case.examples(), &case.query(), &Parameters::default(), &mut out);
    out
}

/// Whether mean, E and σ are finite, every σ is positive and the weights are a distribution.
fn assert_proper(out: &Prediction, case: &Case, name: &str) {
    let rows = &out.residuals[..out.rows * case.dofs];
    let all = out.mean.iter().chain(rows).chain(&out.sigma);
    assert!(all.clone().all(|v| v.is_finite()), "{name}, {case}: {out:?}");
    // EᵀE + diag(σ²) with σ > 0 is positive definite.
    assert!(out.sigma.iter().all(|s| *s > 0.0), "{name}, {case}: {:?}", out.sigma);
}

#[test]
fn predictions_are_proper_whatever_the_examples() {
    let model = examples::model(3);
    for (name, make) in methods(&model) {
        let mut predictor = make(4, 3);
        for count in [1, 2, 3, 16, MOST] {
            for (spread, distance) in [
                (0.0, 0.0),
                (0.0, 4.0),
                (1e-9, 1e-18),
                (1.0, 2.0),
                (1e4, 1e8),
                (1e-3, 1e18),
                (1.0, f64::INFINITY),
            ] {
                let case = Case::spread(count, 4, 3, spread, distance);
                assert_proper(&predict(&mut *predictor, &case), &case, name);
            }
        }
    }
}

/// Joints that no recording moves are common: a thumb, a toe.
#[test]
fn coordinates_that_never_change_are_predicted_as_they_are() {
    let model = examples::still_model(5, 2);
    for (name, make) in methods(&model) {
        let mut case = Case::smooth(40, 6, 5);
        for pose in case.targets.chunks_exact_mut(5).chain(case.recent.chunks_exact_mut(5)) {
            pose[2] = examples::STILL;
        }
        let out = predict(&mut *make(6, 5), &case);
        assert_proper(&out, &case, name);
        assert!((out.mean[2] - examples::STILL).abs() < 1e-3, "{name}: {}", out.mean[2]);
    }
}

#[test]
fn without_examples_nothing_breaks() {
    let model = examples::model(3);
    for (_, make) in methods(&model) {
        let case = Case::spread(0, 4, 3, 1.0, 1.0);
        let out = predict(&mut *make(4, 3), &case);
        assert!(out.mean.iter().chain(&out.sigma).all(|v| v.is_finite()));
    }
}

#[test]
fn without_last_poses_predictions_are_proper() {
    let model = examples::model(5);
    for (name, make) in methods(&model) {
        for poses in [0, 1] {
            let mut case = Case::smooth(20, 6, 5);
            case.recent.truncate(poses * 5);
            assert_proper(&predict(&mut *make(6, 5), &case), &case, name);
        }
    }
}

/// Nothing is carried from one prediction to the next: starts on trial and chunks give the same bits in any order.
#[test]
fn a_prediction_does_not_depend_on_the_one_before() {
    let model = examples::model(5);
    for (name, make) in methods(&model) {
        let (case, other) = (Case::smooth(40, 6, 5), Case::spread(MOST, 6, 5, 30.0, 9.0));
        let mut used = make(6, 5);
        let mut unused = predict(&mut *used, &other);
        used.relinearise(&other.recent[..5], 3.0, &mut unused);
        let (found, expected) = (predict(&mut *used, &case), predict(&mut *make(6, 5), &case));
        assert_eq!(found.mean, expected.mean, "{name}");
        assert_eq!(found.sigma, expected.sigma, "{name}");
        let rows = expected.rows * 5;
        assert_eq!(found.residuals[..rows], expected.residuals[..rows], "{name}");
    }
}

#[test]
fn the_order_of_the_examples_does_not_matter() {
    let model = examples::model(5);
    for (name, make) in methods(&model) {
        let case = Case::smooth(40, 6, 5);
        let (there, back) = (predict(&mut *make(6, 5), &case), predict(&mut *make(6, 5), &case.reversed()));
        for d in 0..5 {
            assert!((there.mean[d] - back.mean[d]).abs() < 1e-6, "{name}, target {d}");
            let (a, b) = (examples::variance(&there, d), examples::variance(&back, d));
            assert!((a - b).abs() < 1e-6 * a, "{name}, target {d}: variances {a} and {b}");
        }
    }
}

/// A local method knows no other poses than the examples': where they are moved, the prediction is moved with them.
#[test]
fn local_predictions_move_with_the_targets() {
    let model = examples::model(5);
    for (name, make) in methods(&model).into_iter().filter(|(name, _)| *name != "gplvm") {
        let case = Case::smooth(40, 6, 5);
        let mut moved = Case::smooth(40, 6, 5);
        for pose in moved.targets.chunks_exact_mut(5).chain(moved.recent.chunks_exact_mut(5)) {
            pose.iter_mut().enumerate().for_each(|(d, v)| *v += 10.0 * d as f64 - 15.0);
        }
        let (here, there) = (predict(&mut *make(6, 5), &case), predict(&mut *make(6, 5), &moved));
        for d in 0..5 {
            let shift = there.mean[d] - here.mean[d];
            assert!((shift - (10.0 * d as f64 - 15.0)).abs() < 1e-8, "{name}, target {d}: {shift}");
        }
    }
}

/// Methods that regress on the inputs claim it.
#[test]
fn what_is_affine_in_the_inputs_is_predicted_beyond_the_examples() {
    let model = examples::model(5);
    for (name, make) in
        methods(&model).into_iter().filter(|(name, _)| ["local-regression", "lpcr"].contains(name))
    {
        let mut case = Case::affine(40, 6, 5);
        case.inputs_now = (0..6).map(|i| 25.0 + f64::from(i)).collect();
        let mut out = Prediction::new(MOST, 5);
        let exact = Parameters { ridge: 1e-6, ridge_distance: 0.0, ..Parameters::default() };
        make(6, 5).predict(&case.examples(), &case.query(), &exact, &mut out);
        for d in 0..5 {
            let expected = examples::line(&case.inputs_now, d);
            assert!((out.mean[d] - expected).abs() < 1e-4, "{name}, target {d}: {} {expected}", out.mean[d]);
        }
    }
}

/// Methods with smoothness follow a pose that keeps its velocity where examples say nothing.
#[test]
fn a_steady_velocity_is_kept_where_examples_say_nothing() {
    let parameters = LpcaParameters { smooth_sigma: 0.01, ..LpcaParameters::default() };
    let case = Case::smooth(40, 6, 5);
    let out = predict(&mut LocalPca::new(MOST, 5, parameters), &case);
    for d in 0..5 {
        let onwards = 2.0 * case.recent[d] - case.recent[5 + d];
        assert!((out.mean[d] - onwards).abs() < 0.01, "target {d}");
    }
}

/// The product of the two Gaussians, against dense algebra.
#[test]
fn the_prior_of_lpca_is_the_product_of_its_two_terms() {
    use faer::prelude::Solve;
    use faer::{Mat, linalg::solvers::DenseSolveCore};
    let (dofs, parameters) = (5, LpcaParameters { variance: 1.0, smooth_sigma: 1.7 });
    let case = Case::smooth(40, 6, dofs);
    let out = predict(&mut LocalPca::new(MOST, dofs, parameters), &case);
    let mean: Vec<f64> =
        (0..dofs).map(|d| (0..40).map(|k| out.weights[k] * case.targets[k * dofs + d]).sum()).collect();
    let spread = |d: usize, e: usize| -> f64 {
        let product =
            |k: usize| (case.targets[k * dofs + d] - mean[d]) * (case.targets[k * dofs + e] - mean[e]);
        (0..40).map(|k| out.weights[k] * product(k)).sum()
    };
    // min_sigma is 1.
    let covariance = Mat::from_fn(dofs, dofs, |d, e| spread(d, e) + if d == e { 1.0 } else { 0.0 });
    let smoothness = 1.7f64.powi(-2);
    let precision = covariance.partial_piv_lu().inverse();
    let both = Mat::from_fn(dofs, dofs, |d, e| precision[(d, e)] + if d == e { smoothness } else { 0.0 });
    let pulled = Mat::from_fn(dofs, 1, |d, _| {
        let onwards = 2.0 * case.recent[d] - case.recent[dofs + d];
        (0..dofs).map(|e| precision[(d, e)] * mean[e]).sum::<f64>() + smoothness * onwards
    });
    let (expected, covariance) = (both.partial_piv_lu().solve(&pulled), both.partial_piv_lu().inverse());
    for d in 0..dofs {
        assert!((out.mean[d] - expected[(d, 0)]).abs() < 1e-8, "target {d}");
        assert!((examples::variance(&out, d) - covariance[(d, d)]).abs() < 1e-8, "target {d}");
    }
}

/// Also after a new linearisation, and whatever the number of examples up to the one the memory was made for.
#[test]
fn predictions_take_no_memory() {
    let model = examples::model(62);
    for (name, make) in methods(&model) {
        let mut predictor = make(142, 62);
        for count in [MOST, MOST - 1, 2, 1] {
            let case = Case::smooth(count, 142, 62);
            let mut out = Prediction::new(MOST, 62);
            let mut run = || {
                predictor.predict(&case.examples(), &case.query(), &Parameters::default(), &mut out);
                predictor.relinearise(&case.recent[..62], 3.0, &mut out)
            };
            // Matrix products set themselves up the first time a thread uses them.
            run();
            let counted = allocation_counter::measure(|| {
                run();
            });
            assert_eq!(counted.count_total, 0, "{name}, {count} examples");
        }
    }
}

/// The loop of a frame ends, and where it ends the pose is as probable as anything near it.
#[test]
fn relinearising_comes_to_an_end() {
    let model = examples::model(5);
    for (name, make) in methods(&model) {
        let case = Case::smooth(20, 6, 5);
        let mut predictor = make(6, 5);
        let mut out = predict(&mut *predictor, &case);
        let mut rounds = 0;
        // Nothing is measured: the most probable pose is the mean.
        while predictor.relinearise(&out.mean.clone(), 0.0, &mut out) {
            rounds += 1;
            assert!(rounds < 50, "{name}");
            assert_proper(&out, &case, name);
        }
    }
}
