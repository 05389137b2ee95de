//! Forward kinematics against literal readings of the two file formats.

mod fixtures;

use std::collections::HashMap;

use fixtures::{Numbers, bvh_rig, walk};
use kinematics::{Kinematics, Parametrisation};
use model::{ChannelKind, Motion};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;

/// One inch is 2.54 cm, one unit 1/0.45 inch.
const METRES_PER_UNIT: f64 = 0.0254 / 0.45;

struct Bone {
    direction: Vector3<f64>,
    length: f64,
    axis: Matrix3<f64>,
    dof: Vec<String>,
}

/// What an ASF text says, read word by word.
struct Acclaim {
    bones: HashMap<String, Bone>,
    /// parent and child, parents first
    hierarchy: Vec<(String, String)>,
}

/// `R = Rz Ry Rx`, degrees.
fn zyx(x: f64, y: f64, z: f64) -> Matrix3<f64> {
    let about = |axis, degrees: f64| Rotation3::from_axis_angle(&axis, degrees.to_radians()).into_inner();
    about(Vector3::z_axis(), z) * about(Vector3::y_axis(), y) * about(Vector3::x_axis(), x)
}

fn read_asf(text: &str) -> Acclaim {
    let (mut bones, mut hierarchy) = (HashMap::new(), Vec::new());
    let mut section = "";
    let (mut name, mut bone) = (String::new(), None::<Bone>);
    for line in text.lines().map(str::trim) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let number = |i: usize| words[i].parse::<f64>().unwrap();
        let vector = || Vector3::new(number(1), number(2), number(3));
        match (section, words.as_slice()) {
            (_, [word, ..]) if word.starts_with(':') => {
                section = if *word == ":bonedata" { "bones" } else { "other" }
            }
            _ => {}
        }
        if words.first() == Some(&":hierarchy") {
            section = "hierarchy";
        }
        match (section, words.as_slice()) {
            ("bones", ["begin"]) => {
                let (direction, axis) = (Vector3::zeros(), Matrix3::identity());
                bone = Some(Bone { direction, length: 0.0, axis, dof: Vec::new() });
            }
            ("bones", ["name", found]) => name = (*found).to_owned(),
            ("bones", ["direction", ..]) => bone.as_mut().unwrap().direction = vector(),
            ("bones", ["length", ..]) => bone.as_mut().unwrap().length = number(1),
            ("bones", ["axis", ..]) => bone.as_mut().unwrap().axis = zyx(number(1), number(2), number(3)),
            ("bones", ["dof", dof @ ..]) => {
                bone.as_mut().unwrap().dof = dof.iter().map(|d| d.to_lowercase()).collect();
            }
            ("bones", ["end"]) => {
                bones.insert(name.clone(), bone.take().unwrap());
            }
            ("hierarchy", [":hierarchy" | "begin" | "end"]) => {}
            ("hierarchy", [parent, children @ ..]) => {
                hierarchy.extend(children.iter().map(|c| ((*parent).to_owned(), (*c).to_owned())));
            }
            _ => {}
        }
    }
    Acclaim { bones, hierarchy }
}

/// The lines of each frame of an AMC text.
fn read_amc(text: &str) -> Vec<HashMap<String, Vec<f64>>> {
    let mut frames = Vec::new();
    for line in text.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with([':', '#'])) {
        let mut words = line.split_whitespace();
        let name = words.next().unwrap();
        if name.parse::<usize>().is_ok() {
            frames.push(HashMap::new());
        } else if let Some(frame) = frames.last_mut() {
            frame.insert(name.to_owned(), words.map(|w| w.parse().unwrap()).collect());
        }
    }
    frames
}

/// Global rotation and end (file units) of every bone: local rotation `C M C⁻¹`, child end = parent end +
/// R_global (direction · length).
fn bone_ends(
    acclaim: &Acclaim,
    frame: &HashMap<String, Vec<f64>>,
) -> HashMap<String, (Matrix3<f64>, Vector3<f64>)> {
    let root = &frame["root"];
    let mut ends = HashMap::new();
    let start = (zyx(root[3], root[4], root[5]), Vector3::new(root[0], root[1], root[2]));
    ends.insert("root".to_owned(), start);
    for (parent, child) in &acclaim.hierarchy {
        let bone = &acclaim.bones[child];
        let value = |dof: &str| match bone.dof.iter().position(|d| d == dof) {
            Some(column) => frame[child][column],
            None => 0.0,
        };
        let motion = zyx(value("rx"), value("ry"), value("rz"));
        let local = bone.axis * motion * bone.axis.try_inverse().unwrap();
        let (parent_rotation, parent_end) = ends[parent];
        let rotation = parent_rotation * local;
        ends.insert(child.clone(), (rotation, parent_end + rotation * (bone.direction * bone.length)));
    }
    ends
}

fn check_against_text(motion: &Motion, asf: &str, amc: &str, tolerance_m: f64) {
    let (acclaim, frames) = (read_asf(asf), read_amc(amc));
    let skeleton = motion.skeleton();
    assert_eq!((frames.len(), acclaim.bones.len()), (motion.num_frames(), skeleton.num_joints() - 1));
    let kinematics = Kinematics::new(skeleton, Parametrisation::channels(skeleton));
    let mut state = kinematics.state();
    for (f, (frame, pose)) in frames.iter().zip(motion.poses()).enumerate().step_by(7) {
        kinematics.update(pose, &mut state);
        let ends = bone_ends(&acclaim, frame);
        for (j, joint) in skeleton.joints().iter().enumerate() {
            let (rotation, end) = ends[&joint.name];
            let found = state.point(j, &joint.tip);
            let distance = (found - end * METRES_PER_UNIT).norm();
            assert!(distance < tolerance_m, "frame {f}, end of {}: {distance} m away", joint.name);
            let turned = (state.rotations[j] - rotation).norm();
            assert!(turned < 10.0 * tolerance_m, "frame {f}, {} is turned by {turned}", joint.name);
        }
    }
}

#[test]
fn drawn_motion_stands_where_the_acclaim_formula_puts_it() {
    let motion = walk();
    let (asf, amc) = (formats::asf::write(motion.skeleton()), formats::amc::write(&motion));
    // The text is rounded.
    check_against_text(&motion, &asf, &amc, 1e-6);
}

#[test]
fn recorded_motion_stands_where_the_acclaim_formula_puts_it() {
    let test = "recorded_motion_stands_where_the_acclaim_formula_puts_it";
    let Some(folder) = testkit::shared::find("data/motion/five-actions", test) else { return };
    for (subject, trial) in
        [("05", "05_01"), ("16", "16_15"), ("13", "13_17"), ("09", "09_01"), ("91", "91_29")]
    {
        if !folder.join(format!("{trial}.amc.zst")).exists() {
            continue;
        }
        let text = |name: String| String::from_utf8(testkit::shared::read(&folder, &name)).unwrap();
        let (asf, amc) = (text(format!("{subject}.asf")), text(format!("{trial}.amc")));
        check_against_text(&testkit::shared::trial(&folder, trial), &asf, &amc, 1e-9);
    }
}

/// BVH: `world_from_joint = world_from_parent · T(offset + translations) · R₁ · R₂ · R₃`, in the order of the channels.
#[test]
fn a_bvh_rig_stands_where_its_channels_put_it() {
    let rig = bvh_rig();
    let kinematics = Kinematics::new(&rig, Parametrisation::channels(&rig));
    let mut state = kinematics.state();
    let mut numbers = Numbers::new(7);
    for _ in 0..50 {
        let pose: Vec<f64> = (0..rig.num_dofs()).map(|_| 3.0 * numbers.next()).collect();
        kinematics.update(&pose, &mut state);
        let mut world = Vec::<Isometry3<f64>>::new();
        for (j, joint) in rig.joints().iter().enumerate() {
            let mut shift = joint.offset;
            let mut rotation = UnitQuaternion::identity();
            for (channel, value) in joint.channels.iter().zip(&pose[rig.dofs(j)]) {
                match channel.kind {
                    ChannelKind::Translation => shift += channel.axis.unit().into_inner() * *value,
                    ChannelKind::Rotation => {
                        rotation *= UnitQuaternion::from_axis_angle(&channel.axis.unit(), *value);
                    }
                }
            }
            let parent = joint.parent.map_or(Isometry3::identity(), |p| world[p]);
            world.push(parent * Isometry3::from_parts(Translation3::from(shift), rotation));
            let (position, turned) = (world[j].translation.vector, world[j].rotation.to_rotation_matrix());
            assert!((state.positions[j] - position).norm() < 1e-12, "{}", joint.name);
            assert!((state.rotations[j] - turned.into_inner()).norm() < 1e-12, "{}", joint.name);
        }
    }
}

#[test]
fn an_offset_root_comes_to_lie_at_its_offset() {
    let rig = bvh_rig();
    let kinematics = Kinematics::new(&rig, Parametrisation::channels(&rig));
    let mut state = kinematics.state();
    kinematics.update(&vec![0.0; rig.num_dofs()], &mut state);
    assert_eq!(state.positions[0], Vector3::new(0.1, 0.9, -0.2));
}

proptest! {
    #[test]
    fn bone_lengths_do_not_depend_on_the_pose(seed: u64) {
        let motion = walk();
        let skeleton = motion.skeleton();
        for (_, parametrisation) in fixtures::parametrisations(&motion) {
            let x = Numbers::new(seed).coordinates(&parametrisation, skeleton.num_dofs());
            let kinematics = Kinematics::new(skeleton, parametrisation);
            let mut state = kinematics.state();
            kinematics.update(&x, &mut state);
            for (j, joint) in skeleton.joints().iter().enumerate() {
                let tip = (state.point(j, &joint.tip) - state.positions[j]).norm();
                prop_assert!((tip - joint.tip.norm()).abs() < 1e-12, "{}", joint.name);
                if let Some(parent) = joint.parent {
                    let bone = (state.positions[j] - state.positions[parent]).norm();
                    prop_assert!((bone - joint.offset.norm()).abs() < 1e-12, "{}", joint.name);
                }
                let rotation = state.rotations[j];
                prop_assert!((rotation * rotation.transpose() - Matrix3::identity()).norm() < 1e-12);
                prop_assert!(rotation.determinant() > 0.0);
            }
        }
    }
}
