//! Lengths of drawn performers, found from the paths of their points; and sessions that say little or nothing.

use kinematics::{Kinematics, Parametrisation, PointSet, control_points};
use model::{Motion, PointTrajectories};
use motion_db::{Clip, MotionDatabase};
use nalgebra::Vector3;
use sample_motion::{Action, DrawOptions, Model};
use skeleton_fit::{Error, FitSettings, FittedSkeleton, Limbs, Sizes, fit_skeleton};

const SIX: [&str; 6] = ["left_wrist", "right_wrist", "left_ankle", "right_ankle", "root", "head"];

fn walk(subject: u64, seed: u64, frames: usize) -> Motion {
    Model::bundled().draw(Action::Walk, seed, &DrawOptions { frames, subject }).unwrap()
}

/// Walks of six people.
fn database() -> MotionDatabase {
    let clip = |subject: u64| Clip {
        name: format!("walk {subject}"),
        subject: subject.to_string(),
        action: "walk".to_owned(),
        motion: walk(subject, subject, 240),
    };
    MotionDatabase::build(&(0..6).map(clip).collect::<Vec<_>>()).unwrap()
}

/// What is measured of a motion that is `size` times as large: everything, the floor to the head.
fn measured(motion: &Motion, names: &[&str], size: f64) -> PointTrajectories {
    let skeleton = motion.skeleton();
    let kinematics = Kinematics::new(skeleton, Parametrisation::channels(skeleton));
    let points = PointSet::new(&kinematics, control_points(skeleton, names).unwrap());
    let mut state = kinematics.state();
    let mut positions = vec![Vector3::zeros(); names.len() * motion.num_frames()];
    for (pose, out) in motion.poses().zip(positions.chunks_exact_mut(names.len())) {
        points.positions(&kinematics, pose, &mut state, out);
    }
    positions.iter_mut().for_each(|p| *p *= size);
    PointTrajectories::new(names.iter().map(|n| (*n).to_owned()).collect(), 60.0, positions).unwrap()
}

fn fit(database: &MotionDatabase, trajectories: &PointTrajectories) -> FittedSkeleton {
    let points = control_points(database.skeleton(), trajectories.names()).unwrap();
    fit_skeleton(database, &points, trajectories, &FitSettings::default()).unwrap()
}

#[test]
fn a_performer_a_tenth_larger_or_smaller_is_found_to_be_so() {
    let database = database();
    let motion = walk(9, 9, 240);
    let truth = Sizes::from_skeleton(motion.skeleton());
    for size in [0.9, 1.1] {
        let fitted = fit(&database, &measured(&motion, &SIX, size));
        let found = Sizes::from_skeleton(&fitted.skeleton);
        println!("{size}: {found:?} of {truth:?} {:?}", fitted.scales);
        for (found, truth) in [(found.height_m, truth.height_m), (found.leg_m, truth.leg_m)] {
            let error = found / (truth * size) - 1.0;
            assert!(error.abs() < 0.04, "{size}: {error}");
        }
        let arm = found.arm_m / (truth.arm_m * size) - 1.0;
        assert!(arm.abs() < 0.06, "{size}: {arm}");
    }
}

#[test]
fn a_limb_that_no_point_sits_on_follows_the_others_and_is_less_certain() {
    let database = database();
    let motion = walk(9, 9, 240);
    let fitted = fit(&database, &measured(&motion, &["left_ankle", "right_ankle", "root"], 1.15));
    let [arms, legs, _] = fitted.scales;
    println!("{:?}", fitted.scales);
    assert!(arms.scale > 1.0 && legs.scale > 1.0, "{:?}", fitted.scales);
    assert!(arms.sigma > legs.sigma, "{:?}", fitted.scales);
}

#[test]
fn the_same_session_gives_the_same_bits_and_points_stay_on_their_limbs() {
    let database = database();
    let trajectories = measured(&walk(9, 9, 120), &SIX, 1.05);
    let (a, b) = (fit(&database, &trajectories), fit(&database, &trajectories));
    assert_eq!(a, b);
    let head = a.skeleton.joint_index("head").unwrap();
    assert!((a.points[5].offset - a.skeleton.joints()[head].tip).norm() < 1e-9);
    // Only lengths differ from the database's skeletons.
    assert_eq!(database.structure_difference(&a.skeleton), None);
    assert!(Limbs::from_skeleton(&a.skeleton).lengths(&a.skeleton).iter().all(|l| *l > 0.0));
}

#[test]
fn gaps_are_no_harm_and_nothing_measured_is_refused() {
    let database = database();
    let whole = measured(&walk(9, 9, 120), &SIX, 1.0);
    let holes = |keeps: &dyn Fn(usize) -> bool| {
        let all = (0..120).flat_map(|f| whole.frame(f).iter().copied()).enumerate();
        let positions = all.map(|(i, p)| if keeps(i) { p } else { Vector3::repeat(f64::NAN) });
        PointTrajectories::new(whole.names().to_vec(), 60.0, positions.collect()).unwrap()
    };
    let with_gaps = fit(&database, &holes(&|i| i % 7 != 0));
    assert!(with_gaps.scales.iter().all(|s| s.scale.is_finite() && s.sigma.is_finite() && s.sigma > 0.0));
    let points = control_points(database.skeleton(), &SIX).unwrap();
    let nothing = fit_skeleton(&database, &points, &holes(&|_| false), &FitSettings::default());
    assert_eq!(nothing, Err(Error::NothingToCompare { frames: 13 }));
}

#[test]
fn points_that_are_far_from_any_body_say_nothing() {
    let database = database();
    let far = measured(&walk(9, 9, 120), &SIX, 50.0);
    let fitted = fit(&database, &far);
    // What is left is the mean of the population.
    assert!(fitted.scales.iter().all(|s| (s.scale - 1.0).abs() < 0.02), "{:?}", fitted.scales);
}

#[test]
fn trajectories_of_other_points_are_refused() {
    let database = database();
    let points = control_points(database.skeleton(), &SIX).unwrap();
    let four = measured(&walk(9, 9, 60), &SIX[..4], 1.0);
    let error = fit_skeleton(&database, &points, &four, &FitSettings::default()).unwrap_err();
    assert_eq!(error.to_string(), "found trajectories of 4 points, expected 6");
}
