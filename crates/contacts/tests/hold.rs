//! Feet that slide a little are held, and nothing else happens.

use contacts::{DetectSettings, Feet, HoldSettings, detect, hold_feet};
use kinematics::{ControlPoint, Kinematics, Parametrisation, PointSet, References, control_points};
use model::{Motion, PointTrajectories};
use nalgebra::{Matrix3, Vector3};
use sample_motion::{Action, DrawOptions, Model};

const FOUR: [&str; 4] = ["left_wrist", "right_wrist", "left_ankle", "right_ankle"];

fn walk(frames: usize) -> Motion {
    Model::bundled().draw(Action::Walk, 3, &DrawOptions { frames, subject: 2 }).unwrap()
}

/// The motion with its root pushed along x at `speed`, metres a second, and back, every second.
fn sliding(motion: &Motion, speed: f64) -> Motion {
    let dofs = motion.skeleton().num_dofs();
    let mut values = motion.values().to_vec();
    for (frame, pose) in values.chunks_exact_mut(dofs).enumerate() {
        pose[0] += speed * (std::f64::consts::TAU * frame as f64 / 60.0).sin() / std::f64::consts::TAU;
    }
    Motion::new(motion.skeleton().clone(), motion.frame_rate(), values).unwrap()
}

fn parametrisation(motion: &Motion) -> Parametrisation {
    let skeleton = motion.skeleton();
    let references = References {
        rotations: vec![Matrix3::identity(); skeleton.num_joints()],
        angles: vec![0.0; skeleton.num_dofs()],
    };
    Parametrisation::smooth(skeleton, &references).unwrap()
}

fn trajectories(motion: &Motion, points: &[ControlPoint]) -> PointTrajectories {
    let kinematics = Kinematics::new(motion.skeleton(), Parametrisation::channels(motion.skeleton()));
    let set = PointSet::new(&kinematics, points.to_vec());
    let mut state = kinematics.state();
    let mut positions = vec![Vector3::zeros(); points.len() * motion.num_frames()];
    for (pose, out) in motion.poses().zip(positions.chunks_exact_mut(points.len())) {
        set.positions(&kinematics, pose, &mut state, out);
    }
    PointTrajectories::new(points.iter().map(|p| p.name.clone()).collect(), 60.0, positions).unwrap()
}

fn farthest(a: &PointTrajectories, b: &PointTrajectories) -> f64 {
    let frames = 0..a.num_frames();
    frames.flat_map(|f| a.frame(f).iter().zip(b.frame(f))).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// Largest change from frame to frame of the step of any foot point, metres.
fn largest_jump(motion: &Motion) -> f64 {
    let tracks = Feet::find(motion.skeleton()).unwrap().tracks(motion);
    let jump = |w: &[[Vector3<f64>; 4]]| {
        (0..4).map(|p| (w[0][p] - w[1][p] * 2.0 + w[2][p]).norm()).fold(0.0, f64::max)
    };
    tracks.positions.windows(3).map(jump).fold(0.0, f64::max)
}

#[test]
fn a_sliding_walk_stands_still_where_it_stands_and_keeps_its_wrists() {
    let motion = sliding(&walk(240), 0.1);
    let points = control_points(motion.skeleton(), &FOUR[..2]).unwrap();
    let measured = trajectories(&motion, &points);
    let held =
        hold_feet(&motion, &parametrisation(&motion), &points, &measured, &HoldSettings::default()).unwrap();
    let (before, after) = (held.slide_before_cm_s.unwrap(), held.slide_after_cm_s.unwrap());
    assert!(before > 5.0 && after < 0.2 * before, "{before} {after}");
    assert!(farthest(&measured, &trajectories(&held.motion, &points)) < 0.003);
    let (smooth, jumps) = (largest_jump(&motion), largest_jump(&held.motion));
    assert!(jumps < 1.3 * smooth + 0.002, "{smooth} {jumps}");
}

#[test]
fn frames_outside_contacts_and_their_ramps_are_the_same_bits() {
    let motion = sliding(&walk(240), 0.1);
    let points = control_points(motion.skeleton(), &FOUR[..2]).unwrap();
    let measured = trajectories(&motion, &points);
    let settings = HoldSettings::default();
    let held = hold_feet(&motion, &parametrisation(&motion), &points, &measured, &settings).unwrap();
    let reaches = |frame: usize| {
        held.contacts.all().iter().any(|c| {
            frame + settings.ramp_frames >= c.frames.start && frame < c.frames.end + settings.ramp_frames
        })
    };
    let untouched: Vec<usize> = (0..240).filter(|f| !reaches(*f)).collect();
    for frame in untouched {
        assert_eq!(held.motion.pose(frame), motion.pose(frame), "{frame}");
    }
    assert!(held.frames_changed > 0);
}

#[test]
fn measured_ankles_stay_where_they_were_measured() {
    let motion = sliding(&walk(240), 0.1);
    let points = control_points(motion.skeleton(), &FOUR).unwrap();
    let measured = trajectories(&motion, &points);
    let held =
        hold_feet(&motion, &parametrisation(&motion), &points, &measured, &HoldSettings::default()).unwrap();
    let moved = farthest(&measured, &trajectories(&held.motion, &points));
    assert!(moved < 0.003, "{moved}");
}

#[test]
fn a_motion_that_stands_all_the_time_becomes_one_place_a_foot() {
    let one = walk(1);
    let dofs = one.skeleton().num_dofs();
    let values = (0..120).flat_map(|_| one.values().to_vec()).collect();
    let still = Motion::new(one.skeleton().clone(), 60.0, values).unwrap();
    let motion = sliding(&still, 0.05);
    let points = control_points(motion.skeleton(), &FOUR[..2]).unwrap();
    let measured = trajectories(&motion, &points);
    let held =
        hold_feet(&motion, &parametrisation(&motion), &points, &measured, &HoldSettings::default()).unwrap();
    assert!(held.contacts.all().iter().all(|c| c.frames == (0..120)), "{:?}", held.contacts);
    assert!(held.contacts.all().len() >= 2);
    assert!(held.slide_after_cm_s.unwrap() < 0.2 * held.slide_before_cm_s.unwrap());
    assert_eq!(held.motion.values().len(), 120 * dofs);
}

#[test]
fn points_that_were_not_measured_and_motions_in_the_air_do_no_harm() {
    let motion = walk(60);
    let dofs = motion.skeleton().num_dofs();
    let mut values = motion.values().to_vec();
    values.chunks_exact_mut(dofs).for_each(|pose| pose[1] += 3.0);
    let flying = Motion::new(motion.skeleton().clone(), 60.0, values).unwrap();
    let points = control_points(motion.skeleton(), &FOUR).unwrap();
    let nothing = vec![Vector3::repeat(f64::NAN); 60 * 4];
    let names = FOUR.map(str::to_owned).to_vec();
    let nothing = PointTrajectories::new(names, 60.0, nothing).unwrap();
    let settings = HoldSettings::default();
    let held = hold_feet(&flying, &parametrisation(&motion), &points, &nothing, &settings).unwrap();
    assert_eq!(held.motion, flying);
    assert_eq!((held.frames_changed, held.slide_after_cm_s), (0, None));
    let held = hold_feet(&motion, &parametrisation(&motion), &points, &nothing, &settings).unwrap();
    assert!(held.motion.values().iter().all(|v| v.is_finite()));
}

#[test]
fn the_motion_without_frames_has_no_contacts() {
    let motion = walk(60);
    let empty = Motion::new(motion.skeleton().clone(), 60.0, vec![]).unwrap();
    let points = control_points(motion.skeleton(), &FOUR).unwrap();
    let none = PointTrajectories::new(FOUR.map(str::to_owned).to_vec(), 60.0, vec![]).unwrap();
    let held =
        hold_feet(&empty, &parametrisation(&motion), &points, &none, &HoldSettings::default()).unwrap();
    assert_eq!(held.motion.num_frames(), 0);
    let tracks = Feet::find(motion.skeleton()).unwrap().tracks(&empty);
    assert!(detect(&tracks, &DetectSettings::default()).all().is_empty());
}

#[test]
fn other_frames_and_unknown_skeletons_are_refused() {
    let motion = walk(60);
    let points = control_points(motion.skeleton(), &FOUR).unwrap();
    let short = trajectories(&walk(30), &points);
    let settings = HoldSettings::default();
    let error = hold_feet(&motion, &parametrisation(&motion), &points, &short, &settings).unwrap_err();
    assert_eq!(error.to_string(), "found 30 frames of control points, the motion has 60");
    let worm = model::Skeleton::new("worm", vec![model::Joint::root("root", vec![])]).unwrap();
    assert!(Feet::find(&worm).unwrap_err().to_string().starts_with("skeleton worm has no left ankle"));
}
