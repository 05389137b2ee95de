//! BVH in its dialects, and the way between BVH and Acclaim.

mod forward;

use std::collections::HashMap;

use formats::{BvhOptions, amc, asf, bvh};
use model::{Axis, Channel, ChannelKind, Joint, Motion, Skeleton};
use nalgebra::Vector3;

const PLAIN: &str = "HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Chest
  {
    OFFSET 0 10 1
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 20 0
    }
  }
  JOINT LeftUpLeg
  {
    OFFSET 8 -5 0
    CHANNELS 3 Yrotation Xrotation Zrotation
    JOINT LeftLeg
    {
      OFFSET 0 -40 0
      CHANNELS 1 Xrotation
      End Site
      {
        OFFSET 0 -40 0
      }
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.0083333
1 90 3 10 20 30 1 2 3 40 50 60 7
1.5 91 3.5 11 21 31 2 3 4 41 51 61 8
";

fn read(text: &str) -> Motion {
    let read = bvh::read(text.as_bytes(), &BvhOptions::default()).unwrap();
    assert_eq!(read.warnings, []);
    read.value
}

fn error_of(text: &str) -> String {
    bvh::read(text.as_bytes(), &BvhOptions::default()).unwrap_err().to_string()
}

/// Positions of the joints of `names` in every frame agree to a micrometre.
fn assert_same_positions(a: &Motion, b: &Motion, name_in_b: impl Fn(&str) -> String, what: &str) {
    assert_eq!(a.num_frames(), b.num_frames(), "{what}");
    let places: Vec<_> = a
        .skeleton()
        .joints()
        .iter()
        .map(|j| {
            b.skeleton().joint_index(&name_in_b(&j.name)).unwrap_or_else(|| panic!("{what}: no {}", j.name))
        })
        .collect();
    let is_leaf = |i| a.skeleton().joints().iter().all(|j| j.parent != Some(i));
    for frame in 0..a.num_frames() {
        let in_a = forward::positions(a.skeleton(), a.pose(frame));
        let in_b = forward::positions(b.skeleton(), b.pose(frame));
        for (index, place) in places.iter().enumerate() {
            let name = &a.skeleton().joints()[index].name;
            for end in 0..if is_leaf(index) { 2 } else { 1 } {
                let distance = (in_a[index][end] - in_b[*place][end]).norm();
                assert!(distance < 1e-6, "{what}: frame {frame}, {name}, end {end}: {distance} m apart");
            }
        }
    }
}

#[test]
fn hierarchy_channels_units_and_rate_are_read() {
    let motion = read(PLAIN);
    let skeleton = motion.skeleton();
    assert_eq!(motion.frame_rate(), 120.0);
    assert_eq!(motion.num_frames(), 2);
    assert_eq!(skeleton.num_dofs(), 13);
    assert_eq!(skeleton.joints()[2].rotation_order, [Axis::Y, Axis::X, Axis::Z]);
    assert_eq!(skeleton.joints()[3].parent, Some(2));
    assert!((skeleton.joints()[3].tip.y + 0.4).abs() < 1e-12);
    assert!((motion.pose(1)[1] - 0.91).abs() < 1e-12);
    assert!((motion.pose(1)[12].to_degrees() - 8.0).abs() < 1e-12);
}

#[test]
fn untidy_files_are_read_as_the_plain_one() {
    let plain = read(PLAIN);
    let untidy = [
        PLAIN.replace('\n', "\r\n"),
        PLAIN.replace("  ", "\t"),
        PLAIN.replace("\n{", " {"),
        PLAIN.replace("Frames: 2", "frames:2").replace("Frame Time: ", "FRAME TIME :\t"),
        PLAIN.replace("ROOT", "Root").replace("MOTION\n", "MOTION\n\n").replace("Xrotation", "XROTATION"),
        PLAIN.replace("40 50 60 7\n", "40 50 60 7 \n\n"),
    ];
    for text in untidy {
        assert_eq!(read(&text), plain, "{text}");
    }
}

#[test]
fn a_wrong_number_of_frames_is_a_warning() {
    for declared in ["1000000000", "1", "many"] {
        let text = PLAIN.replace("Frames: 2", &format!("Frames: {declared}"));
        let read = bvh::read(text.as_bytes(), &BvhOptions::default()).unwrap();
        assert_eq!(read.value.num_frames(), 2);
        assert_eq!(read.warnings.len(), 1, "{declared}");
    }
}

#[test]
fn two_joints_of_one_name_are_told_apart() {
    let text = PLAIN.replace("LeftLeg", "Chest");
    let read = bvh::read(text.as_bytes(), &BvhOptions::default()).unwrap();
    assert_eq!(read.value.skeleton().joints()[3].name, "Chest_2");
    assert_eq!(
        read.warnings[0].to_string(),
        "line 19: two joints are named Chest; the second was renamed Chest_2"
    );
}

#[test]
fn damage_is_refused_with_its_line() {
    let cases = [
        (PLAIN.replace("HIERARCHY", "HIER"), "line 1: found \"HIER\", expected HIERARCHY"),
        (
            PLAIN.replace("OFFSET 8 -5 0", "OFFSET 8 nan 0"),
            "line 17: found \"nan\", expected a finite number",
        ),
        (PLAIN.replace("1 Xrotation", "1 Wrotation"), "line 22: found \"Wrotation\", expected a channel"),
        (
            PLAIN.replace("1 Xrotation", "1000000000 Xrotation"),
            "line 22: found \"1000000000\", expected a number",
        ),
        (PLAIN.replace("60 7\n", "60 inf\n"), "line 33: found \"inf\", expected a finite number"),
        (PLAIN.replace("60 7\n", "60\n"), "line 33: found 12 values, expected 13"),
        (PLAIN.replace("60 7\n", "60 7 8\n"), "line 33: found 14 values, expected 13"),
        (PLAIN.replace("0.0083333", "0"), "line 32: found \"0\", expected seconds per frame"),
        (PLAIN.replace("MOTION", "ROOT b"), "line 30: found \"ROOT\", expected MOTION"),
        (PLAIN[..300].to_owned(), "line 18: found \"Yrota\", expected a channel"),
    ];
    for (text, expected) in cases {
        assert!(error_of(&text).starts_with(expected), "{} instead of {expected}", error_of(&text));
    }
}

#[test]
fn a_chain_of_a_hundred_thousand_joints_does_not_overflow_the_stack() {
    let depth = 100_000;
    let mut text = String::from("HIERARCHY\n");
    for joint in 0..depth {
        let (keyword, channels) =
            if joint == 0 { ("ROOT", "CHANNELS 1 Xrotation") } else { ("JOINT", "CHANNELS 0") };
        text.push_str(&format!("{keyword} j{joint} {{ OFFSET 0 1 0 {channels}\n"));
    }
    text.push_str(&"}".repeat(depth));
    text.push_str("\nMOTION\nFrames: 1\nFrame Time: 0.1\n5\n");
    let motion = read(&text);
    assert_eq!(motion.skeleton().num_joints(), depth);
    let written = bvh::write(&motion);
    assert_eq!(read(&written).skeleton().num_joints(), depth);
    assert!(asf::read(asf::write(motion.skeleton()).as_bytes()).is_ok());
}

#[test]
fn six_channels_of_a_joint_may_be_positions_or_differences() {
    let with = |values: &str| {
        let text = PLAIN
            .replace("CHANNELS 1 Xrotation", "CHANNELS 4 Xposition Yposition Zposition Xrotation")
            .replace("60 7\n", &format!("60 {values} 7\n"))
            .replace("61 8\n", &format!("61 {values} 8\n"));
        read(&text)
    };
    let positions = with("0 -39 0.5");
    let differences = with("0 1 0.5");
    let y = positions.skeleton().dof_names().iter().position(|n| n == "LeftLeg.ty").unwrap();
    assert!((positions.pose(0)[y] - 0.01).abs() < 1e-12);
    assert!((differences.pose(0)[y] - 0.01).abs() < 1e-12);
    assert_same_positions(&positions, &differences, str::to_owned, "positions and differences");
    assert_same_positions(&positions, &read(&bvh::write(&positions)), str::to_owned, "written");
}

#[test]
fn a_motion_from_bvh_survives_writing_as_bvh_and_as_acclaim() {
    let motion = read(PLAIN);
    assert_same_positions(&motion, &read(&bvh::write(&motion)), str::to_owned, "bvh");
    let file = asf::read(asf::write(motion.skeleton()).as_bytes()).unwrap();
    assert_eq!(file.warnings, []);
    let again = amc::read(amc::write(&motion).as_bytes(), &file.value, motion.frame_rate()).unwrap().value;
    let in_acclaim = |name: &str| if name == "Hips" { "root".to_owned() } else { name.to_owned() };
    assert_same_positions(&motion, &again, in_acclaim, "acclaim");
    assert!(again.skeleton().joint_index("LeftUpLeg_connector").is_some());
}

#[test]
fn a_joint_that_translates_in_axes_of_its_own_becomes_two_acclaim_bones() {
    let mut arm = Joint::child(
        "the arm",
        0,
        Vector3::new(0.1, 0.2, 0.0),
        vec![Channel::translation(Axis::X), Channel::rotation(Axis::Y), Channel::rotation(Axis::Z)],
    );
    arm.axes = nalgebra::Rotation3::from_euler_angles(0.3, 0.4, 0.5);
    arm.tip = Vector3::new(0.0, 0.3, 0.0);
    let root = Joint::root("root", vec![Channel::translation(Axis::Z), Channel::rotation(Axis::X)]);
    let skeleton = Skeleton::new("two", vec![root, arm]).unwrap();
    let motion = Motion::new(skeleton.into(), 50.0, vec![0.1, 0.2, 0.3, 0.4, 0.5]).unwrap();
    let file = asf::read(asf::write(motion.skeleton()).as_bytes()).unwrap().value;
    let again = amc::read(amc::write(&motion).as_bytes(), &file, 50.0).unwrap().value;
    assert_same_positions(&motion, &again, |name| name.replace(' ', "_"), "acclaim");
    assert_same_positions(&motion, &read(&bvh::write(&motion)), |name| name.replace(' ', "_"), "bvh");
}

#[test]
fn all_five_actions_written_as_bvh_move_alike_and_without_jumps() {
    let test = "all_five_actions_written_as_bvh_move_alike_and_without_jumps";
    let Some(folder) = testkit::shared::find("data/motion/five-actions", test) else { return };
    let mut skeletons = HashMap::new();
    for row in testkit::shared::index(&folder) {
        let subject = row.get("subject").to_owned();
        let file = skeletons.entry(subject.clone()).or_insert_with(|| {
            asf::read(&testkit::shared::read(&folder, &format!("{subject}.asf"))).unwrap().value
        });
        let trial = row.get("trial");
        let motion = amc::read(&testkit::shared::read(&folder, row.get("file")), file, 120.0).unwrap().value;
        let again = read(&bvh::write(&motion));
        assert_eq!(again.frame_rate(), 120.0);
        assert_same_positions(&motion, &again, str::to_owned, trial);
        let kinds: Vec<_> = again.skeleton().channels().map(|(_, c)| c.kind).collect();
        for frame in 1..again.num_frames() {
            let (a, b) = (again.pose(frame - 1), again.pose(frame));
            for dof in (0..kinds.len()).filter(|d| kinds[*d] == ChannelKind::Rotation) {
                // the data itself flips some joints by half a turn, never by a whole one
                let jump = (a[dof] - b[dof]).abs().to_degrees();
                assert!(
                    jump < 300.0,
                    "{trial}, frame {frame}, {}: {jump}",
                    again.skeleton().dof_names()[dof]
                );
            }
        }
    }
}
