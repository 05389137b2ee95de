//! Real CMU motion on the body.

use body::{BodyModel, Posed};
use evaluation::{
    Error,
    training_poses::{covering, database_poses, recorded_poses, training_poses},
};
use kinematics::{Kinematics, Parametrisation, control_points};
use model::Motion;
use motion_db::{Clip, MotionDatabase};
use nalgebra::Vector3;

const TRIALS: [&str; 6] = ["13_17", "07_01", "16_35", "64_01", "49_02", "91_02"];

/// Bones of the recording and of the body: upper and lower arms and legs.
const BONES: [([&str; 2], [&str; 2]); 8] = [
    (["lhumerus", "lradius"], ["l_shoulder", "l_elbow"]),
    (["lradius", "lhand"], ["l_elbow", "l_wrist"]),
    (["rhumerus", "rradius"], ["r_shoulder", "r_elbow"]),
    (["rradius", "rhand"], ["r_elbow", "r_wrist"]),
    (["lfemur", "ltibia"], ["l_hip", "l_knee"]),
    (["ltibia", "lfoot"], ["l_knee", "l_ankle"]),
    (["rfemur", "rtibia"], ["r_hip", "r_knee"]),
    (["rtibia", "rfoot"], ["r_knee", "r_ankle"]),
];

/// Distance of a pose's angles from those of the nearest of others, radians.
fn nearest(pose: &[f64], others: &[Vec<f64>]) -> f64 {
    let squared =
        |other: &Vec<f64>| -> f64 { pose[6..].iter().zip(&other[6..]).map(|(a, b)| (a - b).powi(2)).sum() };
    others.iter().map(squared).fold(f64::INFINITY, f64::min).sqrt()
}

/// Directions of the bones in each 24th frame of a recording at 120 a second.
fn directions(motion: &Motion) -> Vec<Vec<Vector3<f64>>> {
    let skeleton = motion.skeleton();
    let names: Vec<&str> = BONES.iter().flat_map(|(names, _)| *names).collect();
    let points = control_points(skeleton, &names).unwrap();
    let kinematics = Kinematics::new(skeleton, Parametrisation::channels(skeleton));
    let mut state = kinematics.state();
    let frames = motion.poses().step_by(24).map(|pose| {
        kinematics.update(pose, &mut state);
        let at: Vec<_> = points.iter().map(|point| state.point(point.joint, &point.offset)).collect();
        at.chunks(2).map(|ends| (ends[1] - ends[0]).normalize()).collect()
    });
    frames.collect()
}

fn on_body(model: &BodyModel, pose: &[f64]) -> Vec<Vector3<f64>> {
    let mut posed = Posed::default();
    model.shape(&[]).pose_joints(model, pose, &mut posed);
    let at = |name: &str| posed.joints[model.rig().joint_index(name).unwrap()];
    BONES.iter().map(|(_, [from, to])| (at(to) - at(from)).normalize()).collect()
}

#[test]
fn the_bodys_bones_point_as_the_recorded_ones_do() {
    let Some(folder) =
        testkit::shared::find("data/motion/five-actions", "the_bodys_bones_point_as_the_recorded_ones_do")
    else {
        return;
    };
    let model = BodyModel::shipped();
    let mut degrees = Vec::new();
    for trial in TRIALS {
        let motion = testkit::shared::trial(&folder, trial);
        let poses = recorded_poses(&model, &[(trial, &motion)]).unwrap();
        let expected = directions(&motion);
        assert_eq!(poses.len(), expected.len());
        for (pose, expected) in poses.iter().zip(&expected) {
            let found = on_body(&model, pose);
            degrees.extend(found.iter().zip(expected).map(|(a, b)| a.angle(b).to_degrees()));
            assert!(pose.iter().zip(model.rig().dofs()).all(|(x, dof)| {
                dof.limits.is_none_or(|[low, high]| (low - 1e-6..=high + 1e-6).contains(x))
            }));
        }
    }
    degrees.sort_by(f64::total_cmp);
    let at = |share: f64| degrees[(share * (degrees.len() - 1) as f64) as usize];
    println!(
        "{} bones: median {:.1}, 90 % {:.1}, 99 % {:.1} degrees",
        degrees.len(),
        at(0.5),
        at(0.9),
        at(0.99)
    );
    assert!(at(0.5) < 1.0 && at(0.9) < 5.0, "{} {}", at(0.5), at(0.9));
}

#[test]
fn a_hundred_training_poses_are_near_to_all_that_people_did() {
    let Some(folder) = testkit::shared::find(
        "data/motion/five-actions",
        "a_hundred_training_poses_are_near_to_all_that_people_did",
    ) else {
        return;
    };
    let model = BodyModel::shipped();
    let clips: Vec<Clip> = TRIALS
        .iter()
        .map(|trial| Clip {
            name: (*trial).into(),
            subject: trial.split_once('_').unwrap().0.into(),
            action: String::new(),
            motion: testkit::shared::trial(&folder, trial),
        })
        .collect();
    let database = MotionDatabase::build(&clips).unwrap();
    let poses = database_poses(&model, &database, |subject| subject != "64").unwrap();
    let training = training_poses(&poses, 100).unwrap();
    assert_eq!(training.len(), 100);
    assert!(training.iter().all(|pose| pose[..6] == [0.0; 6]));
    let mut distances: Vec<f64> = poses.iter().map(|pose| nearest(pose, &training)).collect();
    distances.sort_by(f64::total_cmp);
    let [median, most] = [5, 9].map(|tenth| distances[distances.len() * tenth / 10]);
    println!("{} poses: nearest training pose at {median:.2} rad, 90 % {most:.2} rad", poses.len());
    assert!(median < 0.5 && most < 1.0, "{median} {most}");
    // odd poses are left out, which makes the density narrower
    let covering: Vec<_> = covering(&poses, 100).into_iter().map(|index| poses[index].clone()).collect();
    let width = |poses: &[Vec<f64>]| {
        let others = |i: usize| [&poses[..i], &poses[i + 1..]].concat();
        (0..poses.len()).map(|i| nearest(&poses[i], &others(i))).fold(0.0, f64::max)
    };
    let [narrow, wide] = [width(&training), width(&covering)];
    println!("width {narrow:.2} rad, with odd poses {wide:.2} rad");
    assert!(narrow < 0.8 * wide, "{narrow} {wide}");
    assert_eq!(training, training_poses(&poses, 100).unwrap());
    assert!(matches!(training_poses(&poses[..50], 100), Err(Error::TooFewPoses { found: 50, .. })));
}

#[test]
fn another_skeleton_is_refused_by_name() {
    let model = BodyModel::shipped();
    let motion = model.motion(&model.shape(&[]), &[vec![0.0; model.rig().num_dofs()]], 30.0).unwrap();
    let refused = recorded_poses(&model, &[("dance", &motion)]).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "dance: the skeleton has no joint lhumerus, expected one of the CMU skeleton"
    );
}
