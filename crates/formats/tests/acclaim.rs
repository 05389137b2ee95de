//! ASF and AMC, on all recorded trials and on the dialects they don't show.

use std::{collections::HashMap, path::Path};

use formats::{Error, Place, amc, asf};
use model::{Axis, ChannelKind, Motion};

const FIVE_ACTIONS: &str = "data/motion/five-actions";

fn skeleton(folder: &Path, subject: &str) -> asf::File {
    let read = asf::read(&testkit::shared::read(folder, &format!("{subject}.asf"))).unwrap();
    assert_eq!(read.warnings, [], "subject {subject}");
    read.value
}

/// Every trial of five-actions with its skeleton.
fn all_trials(test: &str, mut check: impl FnMut(&str, usize, &asf::File, &[u8], &Motion)) {
    let Some(folder) = testkit::shared::find(FIVE_ACTIONS, test) else { return };
    let mut skeletons = HashMap::new();
    let rows = testkit::shared::index(&folder);
    assert_eq!(rows.len(), 145);
    for row in rows {
        let file = skeletons
            .entry(row.get("subject").to_owned())
            .or_insert_with(|| skeleton(&folder, row.get("subject")));
        let bytes = testkit::shared::read(&folder, row.get("file"));
        let read = amc::read(&bytes, file, row.get("fps").parse().unwrap()).unwrap();
        assert_eq!(read.warnings, [], "{}", row.get("trial"));
        check(row.get("trial"), row.get("frames").parse().unwrap(), file, &bytes, &read.value);
    }
}

#[test]
fn all_five_actions_are_read_with_the_frames_of_the_index() {
    let mut trials = 0;
    all_trials("all_five_actions_are_read_with_the_frames_of_the_index", |trial, frames, file, _, motion| {
        assert_eq!(motion.num_frames(), frames, "{trial}");
        assert_eq!(file.skeleton.num_joints(), 31, "{trial}");
        assert_eq!(file.skeleton.num_dofs(), 62, "{trial}");
        assert_eq!(motion.frame_rate(), 120.0);
        // the hips of a person are about a metre above ground, even in a jump
        let heights: Vec<f64> = motion.poses().map(|p| p[1]).collect();
        assert!(heights.iter().all(|h| (0.3..2.0).contains(h)), "{trial}");
        trials += 1;
    });
    println!("{trials} trials");
}

#[test]
fn values_are_those_of_the_text() {
    let test = "values_are_those_of_the_text";
    let Some(folder) = testkit::shared::find(FIVE_ACTIONS, test) else { return };
    let file = skeleton(&folder, "16");
    let motion = amc::read(&testkit::shared::read(&folder, "16_15.amc"), &file, 120.0).unwrap().value;
    let dof = |name: &str| {
        let dof = file.skeleton.dof_names().iter().position(|n| n == name).unwrap();
        motion.pose(0)[dof]
    };
    assert!((dof("root.ty") - 17.2598 * 0.0254 / 0.45).abs() < 1e-12);
    assert!((dof("root.rz").to_degrees() - -3.87663).abs() < 1e-9);
    assert!((dof("rwrist.ry").to_degrees() - 4.09133).abs() < 1e-9);
    assert!((dof("lfoot.rz").to_degrees() - 5.92602).abs() < 1e-9);
    let foot = &file.skeleton.joints()[file.skeleton.joint_index("lfoot").unwrap()];
    assert_eq!(foot.rotation_order, [Axis::Z, Axis::X]);
    let limits = foot.channels[0].limits.unwrap();
    assert!((limits.0.to_degrees() + 45.0).abs() < 1e-12 && (limits.1.to_degrees() - 90.0).abs() < 1e-12);
    let shin = file.skeleton.joint_index("ltibia").unwrap();
    assert_eq!(foot.parent, Some(shin));
    assert!((foot.offset.norm() - 7.78223 * 0.0254 / 0.45).abs() < 1e-6);
}

#[test]
fn all_five_actions_survive_writing_and_reading() {
    all_trials("all_five_actions_survive_writing_and_reading", |trial, _, file, _, motion| {
        let again = asf::read(asf::write(&file.skeleton).as_bytes()).unwrap();
        assert_eq!(again.warnings, [], "{trial}");
        let again = again.value;
        assert!(again.skeleton.same_structure(&file.skeleton), "{trial}");
        for (a, b) in file.skeleton.joints().iter().zip(again.skeleton.joints()) {
            assert!((a.offset - b.offset).norm() < 1e-12, "{trial} {}", a.name);
            assert!((a.tip - b.tip).norm() < 1e-12, "{trial} {}", a.name);
            assert!((a.axes.matrix() - b.axes.matrix()).norm() < 1e-12, "{trial} {}", a.name);
            for (c, d) in a.channels.iter().zip(&b.channels) {
                let (c, d) = (c.limits.unwrap_or_default(), d.limits.unwrap_or_default());
                assert!((c.0 - d.0).abs() < 1e-9 && (c.1 - d.1).abs() < 1e-9, "{trial} {}", a.name);
            }
        }
        let motion_again = amc::read(amc::write(motion).as_bytes(), &again, 120.0).unwrap();
        assert_eq!(motion_again.warnings, []);
        let kinds: Vec<_> = file.skeleton.channels().map(|(_, c)| c.kind).collect();
        for (index, (a, b)) in motion.values().iter().zip(motion_again.value.values()).enumerate() {
            let bound = match kinds[index % kinds.len()] {
                ChannelKind::Rotation => 1e-6_f64.to_radians(),
                ChannelKind::Translation => 1e-8,
            };
            assert!((a - b).abs() < bound, "{trial}: value {index}: {a} {b}");
        }
    });
}

const HEAD: &str = ":units\n length 0.45\n angle deg\n:root\n order TX TY TZ RX RY RZ\n axis XYZ\n";

fn bone(name: &str, rest: &str) -> String {
    format!("begin\nname {name}\ndirection 0 1 0\nlength 2\naxis 0 0 0 XYZ\n{rest}end\n")
}

fn asf_of(bones: &[String], hierarchy: &str) -> String {
    format!("{HEAD}:bonedata\n{}:hierarchy\nbegin\n{hierarchy}\nend\n", bones.concat())
}

fn error_of(text: &str) -> String {
    asf::read(text.as_bytes()).unwrap_err().to_string()
}

#[test]
fn a_cycle_of_the_hierarchy_is_refused_by_name() {
    let text = asf_of(&[bone("a", ""), bone("b", "")], "a b\nb a");
    assert_eq!(
        error_of(&text),
        "line 8: found bone \"a\" on or below a cycle of the hierarchy, expected every bone to hang from the root"
    );
}

#[test]
fn a_bone_without_parent_is_refused_by_name() {
    let text = asf_of(&[bone("a", ""), bone("b", "")], "root a");
    assert!(error_of(&text).starts_with("line 14: found bone \"b\" without a parent"), "{}", error_of(&text));
}

#[test]
fn a_child_that_is_no_bone_is_refused_with_its_line() {
    let text = asf_of(&[bone("a", "")], "root a b");
    assert!(error_of(&text).starts_with("line 16: found bone \"b\", expected a bone"), "{}", error_of(&text));
}

#[test]
fn a_second_parent_is_refused() {
    let text = asf_of(&[bone("a", ""), bone("b", "")], "root a b\na b");
    assert!(error_of(&text).contains("a second parent of bone \"b\""));
}

#[test]
fn a_bone_that_changes_its_length_is_refused() {
    let text = asf_of(&[bone("a", "dof rx l\n")], "root a");
    assert!(error_of(&text).starts_with("line 13: found \"l\""), "{}", error_of(&text));
}

#[test]
fn unlimited_limits_radians_and_windows_line_ends_are_read() {
    let text = asf_of(&[bone("a", "dof rz rx\nlimits (-inf inf)\n(-1 0.5)\n")], "root a")
        .replace("angle deg", "angle rad")
        .replace('\n', "\r\n");
    let read = asf::read(text.as_bytes()).unwrap();
    let joint = &read.value.skeleton.joints()[1];
    assert_eq!(joint.rotation_order, [Axis::X, Axis::Z]);
    assert_eq!(joint.channels[0].limits, Some((f64::NEG_INFINITY, f64::INFINITY)));
    assert_eq!(joint.channels[1].limits, Some((-1.0, 0.5)));
    assert!(read.warnings[0].message.contains("different orders"));
    let amc = b"# comment\r\n:FULLY-SPECIFIED\r\n:RADIANS\r\n1\r\na 0.25 -1\r\nroot 1 2 3 4 5 6\r\n";
    let motion = amc::read(amc, &read.value, 60.0).unwrap().value;
    assert_eq!(motion.pose(0)[3..], [4.0, 5.0, 6.0, 0.25, -1.0]);
}

#[test]
fn a_frame_without_a_bone_is_refused_by_name() {
    let file = asf::read(asf_of(&[bone("a", "dof rx\n")], "root a").as_bytes()).unwrap().value;
    let amc = b":DEGREES\n1\nroot 0 0 0 0 0 0\na 1\n2\nroot 0 0 0 0 0 0\n";
    let error = amc::read(amc, &file, 60.0).unwrap_err();
    assert_eq!(
        error.to_string(),
        "line 6: found the end of frame 2 without bone a, expected every bone that has DOFs in every frame"
    );
}

#[test]
fn damaged_lines_of_a_motion_are_refused_with_their_line() {
    let file = asf::read(asf_of(&[bone("a", "dof rx\n")], "root a").as_bytes()).unwrap().value;
    let cases = [
        ("1\nroot 0 0 0 0 0 0\na nan\n", 4, "\"nan\""),
        ("1\nroot 0 0 0 0 0 0\na inf\n", 4, "\"inf\""),
        ("1\nroot 0 0 0 0 0 0\na 1 2\n", 4, "2 values of bone \"a\""),
        ("1\nroot 0 0 0 0 0\na 1\n", 3, "5 values of bone \"root\""),
        ("1\nroot 0 0 0 0 0 0\na 1\na 1\n", 5, "bone \"a\" a second time in frame 1"),
        ("1\nroot 0 0 0 0 0 0\nb 1\n", 4, "bone \"b\""),
        ("x\n", 2, "\"x\""),
        ("", 1, "the end of the file"),
    ];
    for (text, line, expected) in cases {
        let error = amc::read(format!(":DEGREES\n{text}").as_bytes(), &file, 60.0).unwrap_err();
        let Error::Unexpected { place, found, .. } = &error else { panic!("{error}") };
        assert_eq!((place, found.as_str()), (&Place::Line(line), expected), "{error}");
    }
}

#[test]
fn frame_numbers_that_jump_are_a_warning() {
    let file = asf::read(asf_of(&[], "").as_bytes()).unwrap().value;
    let amc = b":DEGREES\n7\nroot 0 0 0 0 0 0\n9\nroot 0 0 0 0 0 0\n";
    let read = amc::read(amc, &file, 60.0).unwrap();
    assert_eq!(read.value.num_frames(), 2);
    assert_eq!(read.warnings[0].to_string(), "line 4: frame 9 follows frame 7");
}
