//! The promise: forward kinematics and the Jacobian of six control points on the 62-DOF skeleton within 5 µs.

use divan::{Bencher, black_box};
use kinematics::{Kinematics, Parametrisation, PointSet, References, control_points};
use model::Motion;
use nalgebra::Vector3;
use sample_motion::{Action, DrawOptions, Model};

fn main() {
    divan::main();
}

const NAMES: [&str; 6] = ["left_wrist", "right_wrist", "left_ankle", "right_ankle", "root", "head"];

fn walk() -> Option<Motion> {
    Model::bundled().draw(Action::Walk, 1, &DrawOptions { frames: 60, subject: 1 }).ok()
}

fn smooth(motion: &Motion) -> Option<Parametrisation> {
    let skeleton = motion.skeleton();
    Parametrisation::smooth(skeleton, &References::rest(skeleton)).ok()
}

fn points_and_jacobian(
    bencher: Bencher,
    parametrisation: fn(&Motion) -> Option<Parametrisation>,
    count: usize,
) {
    let Some(motion) = walk() else { return };
    let Some(parametrisation) = parametrisation(&motion) else { return };
    let skeleton = motion.skeleton();
    let mut x = vec![0.0; skeleton.num_dofs()];
    parametrisation.coordinates_from_pose(skeleton, motion.pose(30), 0.0, &mut x);
    let kinematics = Kinematics::new(skeleton, parametrisation);
    let Ok(points) = control_points(skeleton, &NAMES[..count]) else { return };
    let points = PointSet::new(&kinematics, points);
    let mut state = kinematics.state();
    let mut positions = vec![Vector3::zeros(); points.len()];
    let mut jacobian = vec![0.0; 3 * points.len() * x.len()];
    bencher.bench_local(|| {
        points.positions(&kinematics, black_box(&x), &mut state, &mut positions);
        points.jacobian(&kinematics, &state, &positions, &mut jacobian);
        black_box(&mut jacobian);
    });
}

#[divan::bench(args = [2, 6])]
fn points_and_jacobian_smooth(bencher: Bencher, points: usize) {
    points_and_jacobian(bencher, smooth, points);
}

#[divan::bench(args = [2, 6])]
fn points_and_jacobian_channels(bencher: Bencher, points: usize) {
    points_and_jacobian(bencher, |motion| Some(Parametrisation::channels(motion.skeleton())), points);
}

#[divan::bench]
fn whole_skeleton(bencher: Bencher) {
    let Some(motion) = walk() else { return };
    let Some(parametrisation) = smooth(&motion) else { return };
    let mut x = vec![0.0; motion.skeleton().num_dofs()];
    parametrisation.coordinates_from_pose(motion.skeleton(), motion.pose(30), 0.0, &mut x);
    let kinematics = Kinematics::new(motion.skeleton(), parametrisation);
    let mut state = kinematics.state();
    bencher.bench_local(|| {
        kinematics.update(black_box(&x), &mut state);
        black_box(&mut state);
    });
}
