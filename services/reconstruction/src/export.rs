//! The files that people get of a run from control points.

use crate::feet::Finished;
use formats::media_type::CSV;
use model::{ChannelKind, Motion};
use queue::JobError;
use results::{Kind, ResultFile, cell, formats};
use std::{fmt::Write as _, sync::Arc};

impl results::Finished for Finished {
    const KIND: Kind = Kind::SPARSE;
    const QUALITY: Option<fn(&Self) -> String> = Some(quality);

    fn motion(&self) -> &Motion {
        &self.merged.motion
    }
}

/// The motion in every format, and how well it is known.
pub(crate) fn files(finished: &Arc<Finished>) -> Vec<ResultFile> {
    let mut files = formats(finished);
    let finished = finished.clone();
    files.push(ResultFile::new("sigma.csv", CSV, move || Ok::<_, JobError>(sigmas(&finished).into_bytes())));
    files
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
        let _ = write!(out, ",{}", cell(&name, ""));
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
