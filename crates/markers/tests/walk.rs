//! A recorded walk through a preset onto a skeleton like CMU's: the whole body follows the markers.

use formats::{PointsOptions, trc};
use model::Motion;
use motion_db::{Clip, MotionDatabase, WindowIndex};
use nalgebra::Vector3;
use sample_motion::{Action, DrawOptions, Model};
use sparse::{Parameters, Reconstructor, Session, control_points};

/// Walks of two drawn performers.
fn walks() -> Vec<Clip> {
    let clip = |seed: u64| {
        let options = DrawOptions { frames: 300, subject: seed % 2 };
        let motion = Model::bundled().draw(Action::Walk, seed, &options).unwrap();
        Clip { name: seed.to_string(), subject: (seed % 2).to_string(), action: "walk".to_owned(), motion }
    };
    (0..8).map(clip).collect()
}

/// The session that the file makes under the preset, on a skeleton; its offsets only if they are wanted.
fn session(file: &model::PointTrajectories, like: &Motion, has_offsets: bool) -> Session {
    let mapped = markers::preset("gait2392").unwrap().apply(file, &[]).unwrap();
    let mut points = control_points(like.skeleton(), mapped.trajectories.names()).unwrap();
    for (point, made) in points.iter_mut().zip(&mapped.points) {
        assert_eq!(point.name, made.name);
        if has_offsets {
            point.offset += Vector3::from(made.offset_m);
        }
    }
    Session::new(like.skeleton().clone(), points, &mapped.trajectories).unwrap()
}

#[test]
fn a_recorded_walk_is_followed_and_offsets_help() {
    let Some(folder) = testkit::shared::find("data/markers", "a_recorded_walk_is_followed_and_offsets_help")
    else {
        return;
    };
    let bytes = testkit::shared::read(&folder, "opensim_walk_free_01.trc");
    let file = trc::read(&bytes, &PointsOptions::default()).unwrap().value;
    let clips = walks();
    let database = MotionDatabase::build(&clips).unwrap();
    let parameters = Parameters { skeleton_weight: 0.0, start_skeleton_weight: 0.0, ..Parameters::default() };
    let index = WindowIndex::new(&database, parameters.window).unwrap();
    let residual = |has_offsets: bool| {
        let session = session(&file, &clips[0].motion, has_offsets);
        let reconstructor = Reconstructor::new(&database, &index, &session, &parameters).unwrap();
        let frames = 0..session.num_frames();
        let found = reconstructor.reconstruct(frames, &mut |_| std::ops::ControlFlow::Continue(())).unwrap();
        assert!(found.coordinates.iter().all(|v| v.is_finite()));
        assert!(found.quality.iter().all(|q| q.measured_points == 6));
        found.quality.iter().map(|q| q.residual_m).sum::<f64>() / found.quality.len() as f64
    };
    let (with, without) = (residual(true), residual(false));
    println!("points are {with:.3} m off with the preset's offsets, {without:.3} m without");
    assert!(with < 0.06, "{with} m");
    assert!(with < without, "{with} m with offsets, {without} m without");
}

/// CMU's skeletons rest with their legs apart: offsets are tilted so that they are level in a walk.
#[test]
fn a_marker_beside_the_ankle_is_level_with_it_in_a_walk() {
    let walk = &walks()[0].motion;
    let skeleton = walk.skeleton();
    let kinematics = kinematics::Kinematics::new(skeleton, kinematics::Parametrisation::channels(skeleton));
    let mut state = kinematics.state();
    for (foot, point) in [("lfoot", "left_ankle"), ("rfoot", "right_ankle")] {
        let joint = skeleton.joint_index(foot).unwrap();
        let choices = &markers::preset("plug-in-gait").unwrap().point(point).unwrap().choices;
        let offset = Vector3::from(choices[1].offset_m);
        let mut sum = 0.0;
        for pose in walk.poses() {
            kinematics.update(pose, &mut state);
            sum += (state.rotations[joint] * offset).y;
        }
        let mean = sum / walk.num_frames() as f64;
        println!("{foot}: the marker is {:.1} mm above the ankle", 1e3 * mean);
        assert!(mean.abs() < 0.01, "{foot}: {mean} m");
    }
}
