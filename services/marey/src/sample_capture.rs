//! `marey sample-capture`: a synthetic person in front of synthetic cameras.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;
use body::{BodyModel, Posed, Wanted};
use evaluation::Recording;
use formats::{calibration, image_files, ply};
use indicatif::ProgressBar;
use model::{Camera, Mesh, counted};
use sample_motion::{Action, DrawOptions, FRAME_RATE, Model};
use serde_json::{Value, json};
use vision::scene::{Ring, silhouettes};

use crate::folders::empty_folder;

/// Frames of drawn motion from one picture to the next: 30 pictures a second.
const STEP: usize = 2;
/// Frames of the truth from one mesh to the next.
const MESH_STEP: usize = 10;
/// Sides of the pictures, pixels, and focal length in sides.
const SIZE: u32 = 720;
const FOCAL: f64 = 1.3;
/// Distance of the cameras from the middle of the person's path, metres: two seconds of walking fit in.
const DISTANCE_M: f64 = 5.0;
/// Statures of the people, metres.
const STATURES_M: [f64; 5] = [1.58, 1.66, 1.73, 1.79, 1.86];

/// Write a synthetic multi-camera capture to try things with
///
/// A body of the shipped model (made of bodies of the generator MakeHuman, not of people) moves as in a synthetic trial, inside a
/// ring of cameras. The calibration, a silhouette for each frame and camera, and the true joints and meshes are written. All of
/// it is synthetic: the body is one that the model knows, and its silhouettes are exact.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  marey sample-capture --out capture/ --frames 24
  marey upload \"synthetic walk\" capture/calibration.json capture/silhouettes/
  marey run \"synthetic walk\" --set frame_rate=30 --watch   # silhouettes have no rate")]
pub struct Args {
    /// New folder to write to, or an empty one
    #[arg(long, short, visible_alias = "output", value_name = "DIR")]
    out: PathBuf,
    /// Number of cameras, in a circle around the person
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u32).range(2..=32))]
    cameras: u32,
    /// Number of frames, at 30 a second
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: u32,
    /// walk, run, jump or boxing
    #[arg(long, default_value = "walk")]
    action: Action,
    /// A different seed makes a different person and motion; the same seed makes the same ones
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Runs `marey sample-capture`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let capture = SampleCapture {
        cameras: args.cameras as usize,
        frames: args.frames as usize,
        action: args.action,
        seed: args.seed,
    };
    empty_folder(&args.out)?;
    let bar = ProgressBar::new(args.frames.into());
    capture.write(&args.out, || bar.inc(1))?;
    bar.finish_and_clear();
    println!(
        "wrote {} of {} to {}: synthetic, with the truth in groundtruth/",
        counted(args.frames, "frame"),
        counted(args.cameras, "camera"),
        args.out.display()
    );
    Ok(())
}

/// A capture to be drawn.
#[derive(Debug, Clone, Copy)]
pub struct SampleCapture {
    /// how many stand around the person
    pub cameras: usize,
    /// how many, at 30 a second
    pub frames: usize,
    /// what the person does
    pub action: Action,
    /// other person and motion
    pub seed: u64,
}

impl SampleCapture {
    /// Stature of the person, metres.
    pub fn stature_m(&self) -> f64 {
        STATURES_M[(self.seed % STATURES_M.len() as u64) as usize]
    }

    /// Writes it into a folder: `calibration.json`, `silhouettes/CAMERA/FRAME.png`, `groundtruth/joints.json` and
    /// `groundtruth/mesh_FRAME.ply`, and tells every frame when it is done.
    pub fn write(&self, folder: &Path, mut frame_done: impl FnMut()) -> anyhow::Result<()> {
        let model = BodyModel::shipped();
        let alpha = model.alpha_for(&Wanted { stature_m: Some(self.stature_m()), ..Wanted::default() })?;
        let shape = model.shape(&alpha);
        let options = DrawOptions { frames: (self.frames * STEP).max(8), subject: self.seed };
        let motion = Model::bundled().draw(self.action, self.seed, &options)?;
        let recording = Recording::new(&model, &shape, &motion, STEP)?;
        let focal = FOCAL * f64::from(SIZE);
        let ring =
            Ring { cameras: self.cameras, size: SIZE, focal, distance_m: DISTANCE_M, ..Ring::default() };
        let cameras = ring.cameras();

        put(&folder.join("calibration.json"), calibration::write(&cameras).as_bytes())?;
        let mut posed = Posed::default();
        let mut joints = Vec::new();
        for (frame, pose) in recording.poses.iter().take(self.frames).enumerate() {
            shape.pose(&model, pose, &mut posed);
            let places: Vec<[f64; 3]> =
                posed.joints.iter().map(|joint| [joint.x, joint.y, joint.z]).collect();
            joints.push(json!({ "frame": frame, "joints": places }));
            let mesh = Mesh::new(posed.vertices.clone(), model.faces().to_vec())?;
            draw(folder, frame, &mesh, &cameras)?;
            if frame % MESH_STEP == 0 {
                put(&folder.join(format!("groundtruth/mesh_{frame:04}.ply")), &ply::write(&mesh))?;
            }
            frame_done();
        }
        let names: Vec<&str> = model.rig().joints().iter().map(|joint| joint.name.as_str()).collect();
        let truth: Value = json!({
            "fps": FRAME_RATE / STEP as f64, "units": "m", "axes": "y up", "joint_names": names, "frames": joints,
        });
        put(&folder.join("groundtruth/joints.json"), &serde_json::to_vec(&truth)?)
    }
}

fn draw(folder: &Path, frame: usize, mesh: &Mesh, cameras: &[Camera]) -> anyhow::Result<()> {
    for (camera, silhouette) in cameras.iter().zip(silhouettes(mesh, cameras)) {
        let path = folder.join("silhouettes").join(&camera.name).join(format!("{frame:04}.png"));
        put(&path, &image_files::write_silhouette(&silhouette))?;
    }
    Ok(())
}

fn put(path: &Path, content: &[u8]) -> anyhow::Result<()> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    fs::write(path, content).with_context(|| path.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn captures_are_not_mixed() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("capture");
        let draw =
            |cameras| run(&Args { out: out.clone(), cameras, frames: 1, action: Action::Walk, seed: 1 });
        draw(3).unwrap();
        let refused = draw(2).unwrap_err().to_string();
        assert!(refused.ends_with("capture is not empty; choose a new folder"), "{refused}");
        assert_eq!(fs::read_dir(out.join("silhouettes")).unwrap().count(), 3);
    }
}
