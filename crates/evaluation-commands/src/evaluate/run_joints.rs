//! Joints of a run on cameras, or by inverse kinematics, beside true ones.

use std::{fs, path::Path};

use anyhow::{Context, bail};
use formats::session::{self, Options};
use model::{PointTrajectories, counted};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// `joints.json`, as `marey sample-capture` writes it.
#[derive(Deserialize)]
struct JointsFile {
    fps: f64,
    joint_names: Vec<String>,
    frames: Vec<JointsFrame>,
}

#[derive(Deserialize)]
struct JointsFrame {
    /// metres, y up
    joints: Vec<[f64; 3]>,
}

/// How far joints are off.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointReport {
    /// frames compared
    pub frames: usize,
    /// over all joints and frames, millimetres
    pub mean_mm: f64,
    /// the largest, millimetres
    pub max_mm: f64,
    /// each joint
    pub joints: Vec<JointRow>,
}

/// How far one joint is off.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointRow {
    /// its name
    pub joint: String,
    /// frames in which both have it
    pub frames: usize,
    /// mean distance, millimetres
    pub mean_mm: f64,
    /// the largest, millimetres
    pub max_mm: f64,
}

/// True joints from a .json, .csv, .trc or .c3d file.
pub fn read_truth(path: &Path) -> anyhow::Result<PointTrajectories> {
    let bytes = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    if name.ends_with(".json") {
        return from_json(&bytes).with_context(|| path.display().to_string());
    }
    let read = session::read_points(&name, &bytes, &Options::default());
    let read = read.with_context(|| {
        format!("{}: true joints, .json of `marey sample-capture` or a file of points", path.display())
    });
    Ok(read?.value)
}

fn from_json(bytes: &[u8]) -> anyhow::Result<PointTrajectories> {
    let JointsFile { fps, joint_names, frames } = serde_json::from_slice(bytes)?;
    if let Some(index) = frames.iter().position(|frame| frame.joints.len() != joint_names.len()) {
        let found = counted(frames[index].joints.len(), "joint");
        bail!("frame {index} has {found}, expected {}", joint_names.len());
    }
    let positions = frames.iter().flat_map(|frame| frame.joints.iter().copied().map(Vector3::from)).collect();
    Ok(PointTrajectories::new(joint_names, fps, positions)?)
}

/// Compares joints by name, frames by time. `first`: the frame of the truth at which `found` begins.
///
/// # Errors
/// If they have no joint of one name, or no frame in which a joint is known to both.
pub fn compare(
    found: &PointTrajectories,
    truth: &PointTrajectories,
    first: usize,
) -> anyhow::Result<JointReport> {
    let true_frame =
        |frame: usize| first + (frame as f64 / found.frame_rate() * truth.frame_rate()).round() as usize;
    let frames: Vec<(usize, usize)> = (0..found.num_frames())
        .map(|frame| (frame, true_frame(frame)))
        .take_while(|(_, other)| *other < truth.num_frames())
        .collect();
    let mut joints = Vec::new();
    for (own, name) in found.names().iter().enumerate() {
        let Some(other) = truth.point_index(name) else { continue };
        let off = |(frame, at): &(usize, usize)| {
            let place = found.position(*frame, own)?;
            Some(1000.0 * (place - truth.position(*at, other)?).norm())
        };
        let off: Vec<f64> = frames.iter().filter_map(off).collect();
        if !off.is_empty() {
            let (mean_mm, max_mm) = (off.iter().sum::<f64>() / off.len() as f64, largest(&off));
            joints.push(JointRow { joint: name.clone(), frames: off.len(), mean_mm, max_mm });
        }
    }
    if joints.is_empty() {
        bail!(
            "the result and the truth have no joint names in common: the result has {}, the truth {}",
            found.names().join(", "),
            truth.names().join(", ")
        );
    }
    let count: usize = joints.iter().map(|joint| joint.frames).sum();
    let sum: f64 = joints.iter().map(|joint| joint.mean_mm * joint.frames as f64).sum();
    let max_mm = largest(&joints.iter().map(|joint| joint.max_mm).collect::<Vec<_>>());
    Ok(JointReport { frames: frames.len(), mean_mm: sum / count as f64, max_mm, joints })
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

impl JointReport {
    /// As a table, the joints in the order of the result.
    pub fn text(&self) -> String {
        let row = |name: &str, frames: usize, mean: f64, max: f64| {
            format!("{name:<16}{frames:>8}{mean:>12.1}{max:>12.1}\n")
        };
        let mut out = format!("{:<16}{:>8}{:>12}{:>12}\n", "joint", "frames", "mean, mm", "largest, mm");
        for joint in &self.joints {
            out.push_str(&row(&joint.joint, joint.frames, joint.mean_mm, joint.max_mm));
        }
        out.push_str(&row("all", self.frames, self.mean_mm, self.max_mm));
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(names: &[&str], rate: f64, x: &[f64]) -> PointTrajectories {
        let positions = x.iter().map(|x| Vector3::new(*x, 0.0, 0.0)).collect();
        PointTrajectories::new(names.iter().map(|n| (*n).to_owned()).collect(), rate, positions).unwrap()
    }

    #[test]
    fn joints_are_compared_by_name_and_frames_by_time() {
        // the truth at twice the rate, begun two of its frames earlier
        let truth = points(&["head", "nose"], 60.0, &[0.0, 9.0, 0.0, 9.0, 1.0, 9.0, 2.0, 9.0, 3.0, 9.0]);
        let found = points(&["pelvis", "head"], 30.0, &[5.0, 1.01, 5.0, 3.03, 5.0, 7.0]);
        let report = compare(&found, &truth, 2).unwrap();
        assert_eq!((report.frames, report.joints.len()), (2, 1));
        assert!((report.mean_mm - 20.0).abs() < 1e-9 && (report.max_mm - 30.0).abs() < 1e-9, "{report:?}");
        assert!(report.text().lines().last().unwrap().starts_with("all"));
        let message = compare(&found, &points(&["nose"], 30.0, &[0.0]), 0).unwrap_err().to_string();
        assert!(message.contains("pelvis, head") && message.contains("nose"), "{message}");
    }

    #[test]
    fn what_a_capture_comes_with_is_read() {
        let text =
            r#"{"fps": 30.0, "joint_names": ["head"], "frames": [{"joints": [[1, 2, 3]]}, {"joints": []}]}"#;
        let message = from_json(text.as_bytes()).unwrap_err().to_string();
        assert_eq!(message, "frame 1 has 0 joints, expected 1");
        let whole = text.replace(r#", {"joints": []}"#, "");
        assert_eq!(from_json(whole.as_bytes()).unwrap().position(0, 0), Some(Vector3::new(1.0, 2.0, 3.0)));
        let message = format!("{:#}", read_truth(Path::new("/dev/null")).unwrap_err());
        assert!(
            message.contains("/dev/null") && message.contains("expected .csv, .trc or .c3d"),
            "{message}"
        );
    }
}
