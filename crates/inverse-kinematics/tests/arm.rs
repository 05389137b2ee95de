//! An arm of two joints with three rotations each: gradient, limits, tasks, memory.

mod chains;

use chains::{arm, joints, raised, views};
use evaluation::limbs::limb::{self, END, INNER, LOWER, UPPER};
use inverse_kinematics::{Error, Evidence, Options, Overlap, Solver};
use kinematics::check_jacobian;
use nalgebra::Vector3;

fn targets(end: Vector3<f64>) -> [Option<Vector3<f64>>; 3] {
    [None, None, Some(end)]
}

#[test]
fn the_gradient_of_the_overlap_is_that_of_differences() {
    let arm = arm();
    let views = views(&joints(&arm, &raised()));
    let mut x = raised();
    for (i, value) in x[UPPER..].iter_mut().enumerate() {
        *value += 0.07 * (i as f64 - 2.3);
    }
    let segments = [[0, 1], [1, 2]];
    let chain = &arm.chain;
    for seen in [&views[..1], &views[..]] {
        let mut overlap = Overlap::new(chain, 12);
        let mut state = chain.kinematics().state();
        let mut positions = vec![Vector3::zeros(); 3];
        let mut jacobian = vec![0.0; 9 * limb::DOFS];
        let mut gradient = vec![0.0; limb::DOFS];
        chain.points().positions(chain.kinematics(), &x, &mut state, &mut positions);
        chain.points().jacobian(chain.kinematics(), &state, &positions, &mut jacobian);
        overlap.update(&segments, &positions, seen);
        overlap.gradient(&jacobian, &mut gradient);
        assert!(gradient.iter().any(|g| g.abs() > 0.1), "{gradient:?}");
        check_jacobian(&x, 1, &gradient, 1e-3, |x, out| {
            chain.points().positions(chain.kinematics(), x, &mut state, &mut positions);
            overlap.update(&segments, &positions, seen);
            out[0] = overlap.value;
        })
        .unwrap();
    }
}

#[test]
fn two_views_put_the_elbow_where_it_is() {
    let arm = arm();
    let truth = joints(&arm, &raised());
    let views = views(&truth);
    let mut start = raised();
    arm.swivel(&mut start, &(truth[END] - truth[0]), 0.5);
    let posture = start.clone();
    let elbow = |options: Options| {
        let mut solver = Solver::new(arm.chain.clone(), Options { steps: 60, ..options }).unwrap();
        let mut x = start.clone();
        let targets = targets(truth[END]);
        let evidence = Evidence { targets: &targets, views: &views, posture: &posture };
        let outcome = solver.solve(&mut x, &evidence).unwrap();
        ((solver.positions()[INNER] - truth[INNER]).norm(), outcome)
    };
    let (blind, _) = elbow(Options::reach(&[END]));
    assert!(blind > 0.05, "{blind}");
    let modes = [Options::image_constrained, Options::extended, Options::image_first];
    for mode in modes {
        let (error, outcome) = elbow(mode(&[END]));
        println!("{blind:.4} m blind, {error:.4} m, {outcome:?}");
        assert!(error < 0.015 && outcome.residual_m < 0.005, "{error} m, {outcome:?}");
    }
    // the posture, which is where it started, only gets what the image leaves
    let (error, outcome) = elbow(Options::reach_then_image_then_posture(&[END]));
    assert!(error < 0.03 && outcome.residual_m < 0.005, "{error} m, {outcome:?}");
}

#[test]
fn a_coordinate_at_its_limit_stays_there_and_the_others_reach() {
    let arm = arm();
    let wanted = joints(&arm, &raised())[END];
    let mut limits = arm.chain.limits().to_vec();
    let mut solve = |low_twist: f64, high_twist: f64| {
        limits[UPPER + 1] = [low_twist, high_twist];
        let chain = arm.chain.clone().with_limits(limits.clone()).unwrap();
        let mut solver = Solver::new(chain, Options { steps: 60, ..Options::reach(&[END]) }).unwrap();
        let mut x = raised();
        x[UPPER..].copy_from_slice(&[0.0, 0.0, 0.0, 0.4, 0.0, 0.0]);
        let posture = x.clone();
        let evidence = Evidence { targets: &targets(wanted), views: &[], posture: &posture };
        let outcome = solver.solve(&mut x, &evidence).unwrap();
        assert!(outcome.residual_m < 1e-5, "{outcome:?} {x:?}");
        for (value, [low, high]) in x.iter().zip(&limits) {
            assert!(low == high || (low..=high).contains(&value), "{value} in {low} to {high}");
        }
        x
    };
    let free = solve(-1.5, 1.5)[UPPER + 1];
    assert!(free.abs() > 0.02, "{free}");
    let stopped = solve(-0.25 * free.abs(), 0.25 * free.abs());
    assert!((stopped[UPPER + 1].abs() - 0.25 * free.abs()).abs() < 1e-12, "it is on the limit: {stopped:?}");
}

#[test]
fn what_cannot_be_reached_is_pointed_at_within_the_limits() {
    let arm = arm();
    let mut solver =
        Solver::new(arm.chain.clone(), Options { steps: 100, ..Options::reach(&[END]) }).unwrap();
    let mut x = raised();
    let posture = x.clone();
    let far = chains::SHOULDER + Vector3::new(0.0, 0.0, 3.0);
    let evidence = Evidence { targets: &targets(far), views: &[], posture: &posture };
    let outcome = solver.solve(&mut x, &evidence).unwrap();
    let reach = solver.positions()[END] - chains::SHOULDER;
    assert!(reach.normalize().z > 0.99 && outcome.residual_m < 2.5, "{outcome:?} {reach}");
    assert!(x.iter().all(|v| v.is_finite()) && x[LOWER] >= -0.2);
}

#[test]
fn a_point_that_was_not_measured_is_not_pursued() {
    let arm = arm();
    let mut solver = Solver::new(arm.chain.clone(), Options::reach(&[INNER, END])).unwrap();
    let mut x = raised();
    let posture = x.clone();
    for missing in [None, Some(Vector3::repeat(f64::NAN))] {
        let evidence = Evidence { targets: &[None, missing, None], views: &[], posture: &posture };
        let outcome = solver.solve(&mut x, &evidence).unwrap();
        assert!(outcome.residual_m == 0.0 && x == posture);
    }
}

#[test]
fn solving_takes_no_memory_and_gives_the_same_bits() {
    let arm = arm();
    let truth = joints(&arm, &raised());
    let views = views(&truth);
    let mut posture = raised();
    posture[LOWER] = 0.8;
    let modes: [fn(&[usize]) -> Options; 4] = [
        Options::image_constrained,
        Options::image_first,
        Options::extended,
        Options::reach_then_image_then_posture,
    ];
    for mode in modes {
        let mut solver = Solver::new(arm.chain.clone(), mode(&[END])).unwrap();
        let targets = targets(truth[END] + Vector3::new(0.05, 0.02, -0.03));
        let evidence = Evidence { targets: &targets, views: &views, posture: &posture };
        let (mut first, mut second) = (raised(), raised());
        let counted = allocation_counter::measure(|| {
            solver.solve(&mut first, &evidence).unwrap();
        });
        assert_eq!(counted.count_total, 0, "{counted:?}");
        solver.solve(&mut second, &evidence).unwrap();
        assert_eq!(first, second);
    }
}

#[test]
fn what_does_not_fit_the_chain_is_named() {
    let arm = arm();
    let error = Solver::new(arm.chain.clone(), Options::reach(&[7])).unwrap_err();
    assert_eq!(error.to_string(), "a task names point 7, the chain has 3");
    let error = Solver::new(arm.chain.clone(), Options { gain: 0.0, ..Options::reach(&[END]) }).unwrap_err();
    assert_eq!(error.to_string(), "gain is 0, expected a positive number");
    let mut solver = Solver::new(arm.chain.clone(), Options::reach(&[END])).unwrap();
    let mut x = raised();
    let posture = x.clone();
    let evidence = Evidence { targets: &[None], views: &[], posture: &posture };
    let error = solver.solve(&mut x, &evidence).unwrap_err();
    assert_eq!(error, Error::Count { what: "targets", found: 1, expected: 3 });
    x[3] = f64::NAN;
    let evidence = Evidence { targets: &[None; 3], views: &[], posture: &posture };
    assert!(matches!(solver.solve(&mut x, &evidence), Err(Error::NotFinite { dof: 3, .. })));
}
