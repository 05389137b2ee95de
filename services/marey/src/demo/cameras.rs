//! The part of the demo in which a person is followed through the silhouettes of six cameras.

use std::{fs, path::Path};

use anyhow::Context;
use client::{Client, Run};
use formats::points_csv;
use model::PointTrajectories;
use nalgebra::Vector3;
use sample_motion::Action;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::folders::remove;
use crate::{results, sample_capture::SampleCapture, session_files, upload, watch};

/// Folder of the results.
pub const FOLDER: &str = "walk-6-cameras";
/// What is drawn.
pub const CAPTURE: SampleCapture = SampleCapture { cameras: 6, frames: 24, action: Action::Walk, seed: 3 };

/// How far the person that was followed is from the true one.
#[derive(Debug, Clone, Copy)]
pub struct Followed {
    /// frames compared
    pub num_frames: usize,
    /// mean distance of the joints from the true ones, metres
    pub mean_m: f64,
    /// the largest, metres
    pub largest_m: f64,
    /// the mean for a baseline: the pose of the first frame, moved along with the pelvis, metres
    pub carried_m: f64,
    /// stature of the body that was found, metres
    pub stature_m: f64,
}

/// Draws a capture, has it tracked, and compares the joints with the true ones.
pub fn show(client: &Client, folder: &Path, output: &Path) -> anyhow::Result<Followed> {
    println!("Rendering a walk in front of {} cameras: silhouettes, nothing else", CAPTURE.cameras);
    let capture = folder.join("sample-capture");
    remove(&capture)?;
    CAPTURE.write(&capture, || ())?;
    println!("Finding the person's body in them, then its motion: one session, one run");
    let session = client.create_session(&format!("walk seen by {} cameras", CAPTURE.cameras))?;
    for found in session_files::gather(&[capture.join("calibration.json"), capture.join("silhouettes")])? {
        upload::send(client, &session, &found.name, found.role, found.file)?;
    }
    // 30 pictures a second are drawn; silhouettes do not say so
    let request = json!({ "parameters": { "frame_rate": 30 } });
    let run: Run = client.post(&format!("/v1/sessions/{}/runs", session.id), &request)?;
    watch::until_end(client, &run.id)?;
    let to = output.join(FOLDER);
    results::download(client, &run.id, &to)?;

    let found = points_csv::read(&read(&to.join("joints.csv"))?)?.value;
    let shape: Value = serde_json::from_slice(&read(&to.join("shape.json"))?)?;
    let stature_m = shape["measurements"]["stature_m"].as_f64().context("shape.json has no stature")?;
    compare(&found, &truth(&capture.join("groundtruth/joints.json"))?, stature_m)
}

#[derive(Deserialize)]
struct Truth {
    joint_names: Vec<String>,
    frames: Vec<TrueFrame>,
}

#[derive(Deserialize)]
struct TrueFrame {
    /// metres, y up
    joints: Vec<[f64; 3]>,
}

fn truth(path: &Path) -> anyhow::Result<Truth> {
    serde_json::from_slice(&read(path)?).with_context(|| path.display().to_string())
}

fn read(path: &Path) -> anyhow::Result<Vec<u8>> {
    fs::read(path).with_context(|| path.display().to_string())
}

fn compare(found: &PointTrajectories, truth: &Truth, stature_m: f64) -> anyhow::Result<Followed> {
    let (mut sum, mut largest_m, mut carried, mut count) = (0.0, 0.0_f64, 0.0, 0.0);
    let num_frames = found.num_frames().min(truth.frames.len());
    for (frame, true_frame) in truth.frames.iter().enumerate().take(num_frames) {
        let way = found.position(frame, 0).zip(found.position(0, 0)).map(|(now, first)| now - first);
        for (name, place) in truth.joint_names.iter().zip(&true_frame.joints) {
            let index = found.point_index(name).with_context(|| format!("no joint {name} in joints.csv"))?;
            let place = Vector3::from(*place);
            let at = found.position(frame, index).with_context(|| format!("{name} is missing"))?;
            let off = (at - place).norm();
            sum += off;
            largest_m = largest_m.max(off);
            if let Some((first, way)) = found.position(0, index).zip(way) {
                carried += (first + way - place).norm();
            }
            count += 1.0;
        }
    }
    Ok(Followed { num_frames, mean_m: sum / count, largest_m, carried_m: carried / count, stature_m })
}
