//! Positions of all joints as a table.

use std::fmt::Write as _;

use kinematics::{Kinematics, Parametrisation};
use model::Motion;

/// Positions of all joints: `frame,time,root_x,root_y,root_z,…`; seconds and metres, y up.
pub(crate) fn positions_csv(motion: &Motion) -> String {
    let skeleton = motion.skeleton();
    let mut out = String::from("frame,time");
    for joint in skeleton.joints() {
        for axis in ["_x", "_y", "_z"] {
            let _ = write!(out, ",{}", cell(&joint.name, axis));
        }
    }
    out.push('\n');
    let kinematics = Kinematics::new(skeleton, Parametrisation::channels(skeleton));
    let mut state = kinematics.state();
    for (frame, pose) in motion.poses().enumerate() {
        kinematics.update(pose, &mut state);
        let _ = write!(out, "{frame},{:.6}", frame as f64 / motion.frame_rate());
        for p in &state.positions {
            let _ = write!(out, ",{:.7},{:.7},{:.7}", p.x, p.y, p.z);
        }
        out.push('\n');
    }
    out
}

/// A name with something behind it as one cell of a table, quoted if it must be.
pub fn cell(name: &str, suffix: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}{suffix}\"", name.replace('"', "\"\""))
    } else {
        format!("{name}{suffix}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::{Axis, Channel, Joint, Skeleton};

    fn motion(name: &str) -> Motion {
        let root = Joint::root(name, vec![Channel::translation(Axis::X), Channel::rotation(Axis::X)]);
        let skeleton = Skeleton::new("s", vec![root]).unwrap();
        Motion::new(skeleton.into(), 60.0, vec![0.5, 0.0, 1.0, 0.0]).unwrap()
    }

    #[test]
    fn positions_have_a_row_a_frame() {
        let text = positions_csv(&motion("root"));
        assert_eq!(
            text,
            "frame,time,root_x,root_y,root_z\n\
             0,0.000000,0.5000000,0.0000000,0.0000000\n\
             1,0.016667,1.0000000,0.0000000,0.0000000\n"
        );
    }

    #[test]
    fn a_joint_with_a_comma_in_its_name_stays_one_column() {
        let text = positions_csv(&motion("a,b"));
        assert!(text.starts_with("frame,time,\"a,b_x\",\"a,b_y\",\"a,b_z\"\n"), "{text}");
    }
}
