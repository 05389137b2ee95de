//! How long one frame's solve takes: points drawn a few frames away from the prior's mean, K = 64 residuals.

use divan::Bencher;
use kinematics::{Kinematics, Parametrisation, PointSet, References, control_points};
use nalgebra::Vector3;
use posterior::{ControlPoints, GaussianPrior, MapSolver, Measurement, SolverParameters};
use sample_motion::{Action, DrawOptions, Model};

fn main() {
    divan::main();
}

const NAMES: [&str; 6] = ["left_wrist", "right_wrist", "left_ankle", "right_ankle", "root", "head"];

struct Problem {
    kinematics: Kinematics,
    likelihood: ControlPoints,
    measured: Vec<Option<Measurement>>,
    prior: GaussianPrior,
    residuals: Vec<f64>,
}

fn problem(points: usize) -> Option<Problem> {
    let motion = Model::bundled().draw(Action::Walk, 1, &DrawOptions { frames: 60, subject: 1 }).ok()?;
    let skeleton = motion.skeleton();
    let smooth = Parametrisation::smooth(skeleton, &References::rest(skeleton)).ok()?;
    let dofs = skeleton.num_dofs();
    let (mut mean, mut truth) = (vec![0.0; dofs], vec![0.0; dofs]);
    smooth.coordinates_from_pose(skeleton, motion.pose(30), 0.0, &mut mean);
    smooth.coordinates_from_pose(skeleton, motion.pose(31), 0.0, &mut truth);
    let kinematics = Kinematics::new(skeleton, smooth);
    let points = PointSet::new(&kinematics, control_points(skeleton, &NAMES[..points]).ok()?);
    let mut positions = vec![Vector3::zeros(); points.len()];
    points.positions(&kinematics, &truth, &mut kinematics.state(), &mut positions);
    let measured = positions.into_iter().map(|position| Some(Measurement { position, sigma: 0.0015 }));
    let residuals: Vec<f64> = (0..64 * dofs).map(|i| 0.01 * (i as f64 * 1.37).sin()).collect();
    let mut prior = GaussianPrior::new(dofs);
    prior.set_full(&residuals, &vec![0.017; dofs]);
    prior.mean = mean;
    Some(Problem {
        likelihood: ControlPoints::new(&kinematics, points),
        measured: measured.collect(),
        kinematics,
        prior,
        residuals,
    })
}

#[divan::bench(args = [2, 6])]
fn solve(bencher: Bencher, points: usize) {
    let Some(mut p) = problem(points) else { return };
    let mut solver = MapSolver::new(points, p.prior.mean.len());
    let parameters = SolverParameters::default();
    bencher
        .bench_local(|| solver.solve(&p.kinematics, &mut p.likelihood, &p.measured, &p.prior, &parameters));
}

#[divan::bench(args = [2, 6])]
fn standard_deviations(bencher: Bencher, points: usize) {
    let Some(mut p) = problem(points) else { return };
    let mut solver = MapSolver::new(points, p.prior.mean.len());
    solver.solve(&p.kinematics, &mut p.likelihood, &p.measured, &p.prior, &SolverParameters::default());
    let mut out = vec![0.0; p.prior.mean.len()];
    bencher.bench_local(|| {
        solver.standard_deviations(&p.kinematics, &mut p.likelihood, &p.measured, &p.prior, &mut out);
    });
}

#[divan::bench(args = [64, 128])]
fn covariance(bencher: Bencher, neighbours: usize) {
    let Some(mut p) = problem(6) else { return };
    let residuals = p.residuals.repeat(neighbours / 64);
    let min_sigma = vec![0.017; p.prior.mean.len()];
    bencher.bench_local(|| p.prior.set_full(&residuals, &min_sigma));
}
