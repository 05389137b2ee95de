//! The promise: 2,000 solves a second of 15 steps with two views on one thread (the paper: 19).

#[path = "../tests/chains/mod.rs"]
mod chains;

use chains::{arm, joints, raised, views};
use divan::{Bencher, black_box};
use evaluation::limbs::limb::END;
use inverse_kinematics::{Evidence, Options, Solver};

fn main() {
    divan::main();
}

/// 15 steps of one arm, 9 cm and a turn away from its goal, in as many views.
#[divan::bench(args = [0, 1, 2])]
fn fifteen_steps(bencher: Bencher, num_views: usize) {
    let arm = arm();
    let truth = joints(&arm, &raised());
    let views = views(&truth);
    let mut start = raised();
    arm.swivel(&mut start, &(truth[END] - truth[0]), 0.4);
    start[6] += 0.2;
    let posture = start.clone();
    let Ok(mut solver) = Solver::new(arm.chain.clone(), Options::image_constrained(&[END])) else { return };
    let targets = [None, None, Some(truth[END])];
    let mut x = start.clone();
    bencher.bench_local(|| {
        x.copy_from_slice(&start);
        let evidence = Evidence { targets: &targets, views: &views[..num_views], posture: &posture };
        black_box(solver.solve(black_box(&mut x), &evidence)).is_ok_and(|outcome| outcome.steps > 1)
    });
}
