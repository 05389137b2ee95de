//! The files that people get.

use crate::feet::Finished;
use kinematics::{Kinematics, Parametrisation};
use model::{ChannelKind, Motion};
use std::fmt::Write as _;

/// A result's name, its media type, and how it is written.
pub(crate) struct Export {
    /// Name of the file.
    pub name: &'static str,
    /// Its media type.
    pub media_type: &'static str,
    /// Makes the content.
    pub write: fn(&Finished) -> String,
}

const TEXT: &str = "text/plain; charset=utf-8";
const CSV: &str = "text/csv; charset=utf-8";

/// All of them, made one after the other so that only one is in memory at a time.
pub(crate) const EXPORTS: [Export; 7] = [
    Export { name: "motion.bvh", media_type: TEXT, write: |m| formats::bvh::write(&m.merged.motion) },
    Export { name: "motion.amc", media_type: TEXT, write: |m| formats::amc::write(&m.merged.motion) },
    Export {
        name: "skeleton.asf",
        media_type: TEXT,
        write: |m| formats::asf::write(m.merged.motion.skeleton()),
    },
    Export { name: "poses.csv", media_type: CSV, write: |m| formats::motion_csv::write(&m.merged.motion) },
    Export { name: "positions.csv", media_type: CSV, write: |m| positions(&m.merged.motion) },
    Export { name: "quality.csv", media_type: CSV, write: quality },
    Export { name: "sigma.csv", media_type: CSV, write: sigmas },
];

/// Positions of all joints: `frame,time,root_x,root_y,root_z,…`; seconds and metres, y up.
pub(crate) fn positions(motion: &Motion) -> String {
    let skeleton = motion.skeleton();
    let mut out = String::from("frame,time");
    for joint in skeleton.joints() {
        let name = quoted(&joint.name);
        let _ = write!(out, ",{}", name.replace('\u{0}', "_x"));
        let _ = write!(out, ",{}", name.replace('\u{0}', "_y"));
        let _ = write!(out, ",{}", name.replace('\u{0}', "_z"));
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

/// A joint's name as a cell with a place (NUL) for the suffix; quoted if it must be.
fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\u{0}\"", name.replace('"', "\"\""))
    } else {
        format!("{name}\u{0}")
    }
}

/// How well each frame is known, and what its feet do (empty where feet were not looked for).
fn quality(finished: &Finished) -> String {
    let frame_rate = finished.merged.motion.frame_rate();
    let mut out = String::from(
        "frame,time,measured_points,residual_m,sigma_rad,energy,neighbour_distance_deg,left_foot_contact,\
         right_foot_contact,foot_slide_cm_s\n",
    );
    for (frame, q) in finished.merged.quality.iter().enumerate() {
        // Where nothing was measured there is no residual, not one of 0.
        let residual = if q.measured_points > 0 { format!("{:.7}", q.residual_m) } else { String::new() };
        let feet = finished.feet.as_ref().map_or(",,".to_owned(), |feet| {
            let [left, right] = feet.stand[frame].map(u8::from);
            let slide = feet.slides_cm_s[frame].map_or(String::new(), |slide| format!("{slide:.3}"));
            format!("{left},{right},{slide}")
        });
        let _ = writeln!(
            out,
            "{frame},{:.6},{},{residual},{:.7},{:.6},{:.6},{feet}",
            frame as f64 / frame_rate,
            q.measured_points,
            q.sigma_rad,
            q.energy,
            q.neighbour_distance_deg
        );
    }
    out
}

/// How sure every coordinate is, one standard deviation: metres for the root's place, degrees for everything that turns. A
/// joint with three rotations has the components of its rotation vector, x, y, z.
fn sigmas(finished: &Finished) -> String {
    let motion = &finished.merged.motion;
    let dofs = motion.skeleton().num_dofs();
    let is_angle: Vec<bool> = motion
        .skeleton()
        .joints()
        .iter()
        .flat_map(|j| &j.channels)
        .map(|c| c.kind == ChannelKind::Rotation)
        .collect();
    let mut out = String::from("frame,time");
    for name in motion.skeleton().dof_names() {
        let _ = write!(out, ",{}", quoted(&name).replace('\u{0}', ""));
    }
    out.push('\n');
    for (frame, row) in finished.merged.sigmas.chunks_exact(dofs.max(1)).enumerate() {
        let _ = write!(out, "{frame},{:.6}", frame as f64 / motion.frame_rate());
        for (sigma, is_angle) in row.iter().zip(&is_angle) {
            let _ = write!(out, ",{:.4}", if *is_angle { sigma.to_degrees() } else { *sigma });
        }
        out.push('\n');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::{Axis, Channel, Joint, Skeleton};
    use sparse::{FrameQuality, Merged};

    fn motion(name: &str) -> Motion {
        let root = Joint::root(name, vec![Channel::translation(Axis::X), Channel::rotation(Axis::X)]);
        let skeleton = Skeleton::new("s", vec![root]).unwrap();
        Motion::new(skeleton.into(), 60.0, vec![0.5, 0.0, 1.0, 0.0]).unwrap()
    }

    #[test]
    fn positions_have_a_row_a_frame() {
        let text = positions(&motion("root"));
        assert_eq!(
            text,
            "frame,time,root_x,root_y,root_z\n\
             0,0.000000,0.5000000,0.0000000,0.0000000\n\
             1,0.016667,1.0000000,0.0000000,0.0000000\n"
        );
    }

    #[test]
    fn a_joint_with_a_comma_in_its_name_stays_one_column() {
        let text = positions(&motion("a,b"));
        assert!(text.starts_with("frame,time,\"a,b_x\",\"a,b_y\",\"a,b_z\"\n"), "{text}");
    }

    #[test]
    fn quality_has_a_row_a_frame() {
        let q = FrameQuality {
            residual_m: 0.001,
            sigma_rad: 0.05,
            energy: 1.5,
            neighbour_distance_deg: 2.0,
            measured_points: 6,
        };
        let merged =
            Merged { motion: motion("root"), quality: vec![q], sigmas: vec![0.01, 0.5f64.to_radians()] };
        let finished = Finished { merged, feet: None };
        assert_eq!(sigmas(&finished).lines().nth(1), Some("0,0.000000,0.0100,0.5000"));
        let text = quality(&finished);
        assert_eq!(text.lines().nth(1), Some("0,0.000000,6,0.0010000,0.0500000,1.500000,2.000000,,,"));
    }
}
