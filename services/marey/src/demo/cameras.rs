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

use super::{remove, step};
use crate::{results, sample_capture::SampleCapture, session_files, upload, watch};

/// Folder of the results.
pub const FOLDER: &str = "walk-6-cameras";
const CAPTURE: SampleCapture = SampleCapture { cameras: 6, frames: 24, action: Action::Walk, seed: 3 };

/// Draws a capture, has it tracked, and says how far the joints are from the true ones.
pub fn show(client: &Client, folder: &Path, output: &Path) -> anyhow::Result<()> {
    step("Drawing a walk before six cameras: silhouettes, nothing else");
    let capture = folder.join("sample-capture");
    remove(&capture)?;
    CAPTURE.write(&capture, || ())?;
    let name = "walk seen by 6 cameras";
    step(&format!("Session {name:?}: finding the body, then its motion"));
    let session = client.create_session(name)?;
    for found in session_files::gather(&[capture.join("calibration.json"), capture.join("silhouettes")])? {
        upload::put(client, &session, &found.name, found.role, found.file)?;
    }
    let run: Run = client.post(&format!("/v1/sessions/{}/runs", session.id), &json!({}))?;
    watch::until_end(client, &run.id)?;
    let to = output.join(FOLDER);
    results::download(client, &run.id, &to)?;

    let found = points_csv::read(&read(&to.join("joints.csv"))?)?.value;
    let errors = Errors::new(&found, &truth(&capture.join("groundtruth/joints.json"))?)?;
    let shape: Value = serde_json::from_slice(&read(&to.join("shape.json"))?)?;
    println!(
        "\n{} frames, joints off by {:.1} cm on average, {:.1} cm at most; if the first pose were kept and only carried along: \
         {:.1} cm.",
        found.num_frames(),
        100.0 * errors.mean_m,
        100.0 * errors.largest_m,
        100.0 * errors.carried_m
    );
    println!(
        "The body: {:.2} m tall, true {:.2} m. The man is synthetic, and one that the body model knows; real people are harder.",
        shape["measurements"]["stature_m"].as_f64().unwrap_or(f64::NAN),
        CAPTURE.stature_m(),
    );
    println!("Look at overlay_cam0.mp4, and in Blender at body.glb, in {}.", to.display());
    Ok(())
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

/// Distances of found joints from true ones, metres.
struct Errors {
    mean_m: f64,
    largest_m: f64,
    /// mean for the pose of the first frame, carried along with the pelvis
    carried_m: f64,
}

impl Errors {
    fn new(found: &PointTrajectories, truth: &Truth) -> anyhow::Result<Self> {
        let (mut sum, mut largest_m, mut carried, mut count) = (0.0, 0.0_f64, 0.0, 0.0);
        for (frame, of_frame) in truth.frames.iter().enumerate().take(found.num_frames()) {
            let way = found.position(frame, 0).zip(found.position(0, 0)).map(|(now, first)| now - first);
            for (name, place) in truth.joint_names.iter().zip(&of_frame.joints) {
                let index =
                    found.point_index(name).with_context(|| format!("no joint {name} in joints.csv"))?;
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
        Ok(Self { mean_m: sum / count, largest_m, carried_m: carried / count })
    }
}
