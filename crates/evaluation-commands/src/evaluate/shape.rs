//! `marey evaluate shape`.

mod leave_one_out;

use std::{
    fs,
    path::{Path, PathBuf},
    time::Instant,
};

use anyhow::{Context, bail};
use body::BodyModel;
use client::outputs;
use evaluation::{Body, ShapeErrors, shape_errors};
use formats::image_files::write_image;
use indicatif::{ProgressBar, ProgressStyle};
use model::{Camera, Silhouette};
use serde::Serialize;
use shape_fit::{Fit, Options, fit};
use vision::{Topology, scene::SilhouetteNoise};

use super::{
    capture::Folder,
    overlay::{drawn, overlay},
    written::write,
};

/// `marey evaluate shape`
#[derive(Debug, clap::Args)]
#[command(after_help = "\
DIR holds calibration.json (or .yml, .toml, …), silhouettes/CAMERA/0000.png, groundtruth/mesh_0000.ply and groundtruth/joints.json; \
images/CAMERA/0000.jpg, where there are any, are the background of the overlays.

With --scans, bodies whose registered scans are known are rendered as 8 cameras would see them, and found again by a model that was \
learned without them: in the base pose and in 5 others.

Examples:
  marey evaluate shape capture/ --cameras 0,2,4 --json errors.json
  marey evaluate shape capture/ --noise 7 --overlay overlays/
  marey evaluate shape --scans scans/ --leave-one-out 20 --json errors.json")]
pub struct Args {
    /// Folder of a capture: calibration, silhouettes, true mesh and joints
    #[arg(value_name = "DIR", required_unless_present = "scans", conflicts_with = "scans")]
    folder: Option<PathBuf>,
    /// Only these cameras: their names, or their numbers from 0 [default: all]
    #[arg(long, value_delimiter = ',', value_name = "CAMERA")]
    cameras: Vec<String>,
    /// Flip 1.2 % of the pixels and add blobs and holes, with this seed
    #[arg(long, value_name = "SEED", num_args = 0..=1, default_missing_value = "1")]
    noise: Option<u64>,
    /// A body model to use instead of the one that comes with Marey
    #[arg(long, value_name = "FILE", conflicts_with = "scans")]
    model: Option<PathBuf>,
    /// Which frame of the capture
    #[arg(long, value_name = "N", default_value_t = 0)]
    frame: u32,
    /// Write the errors to this file; overwritten if it exists
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write a picture for each camera, with the outline of the body found, to this folder; existing
    /// pictures of the same names are overwritten
    #[arg(long, value_name = "DIR", conflicts_with = "scans")]
    overlay: Option<PathBuf>,
    /// Folder of registered scans: vertices.npy, faces.npy, joints.npy and scans.csv, with rig.json, skin_joints.npy and
    /// skin_weights.npy there or in ../rig
    #[arg(long, value_name = "DIR")]
    scans: Option<PathBuf>,
    /// How many bodies are left out, one after the other
    #[arg(long, value_name = "N", default_value_t = 20, requires = "scans")]
    leave_one_out: usize,
}

#[derive(Serialize)]
struct Json<'a> {
    #[serde(flatten)]
    errors: ShapeErrors,
    seconds: f64,
    confidence: f64,
    frame: u32,
    noise_seed: Option<u64>,
    cameras: Vec<CameraJson<'a>>,
    pose: &'a [f64],
    alpha: &'a [f64],
}

#[derive(Serialize)]
struct CameraJson<'a> {
    camera: &'a str,
    iou: f64,
}

/// Runs `marey evaluate shape`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    outputs::check(&[("--model", args.model.as_ref())], &[("--json", args.json.as_ref())])?;
    let Some(folder) = &args.folder else {
        let Some(scans) = &args.scans else { bail!("give either DIR or --scans") };
        if !args.cameras.is_empty() || args.frame != 0 {
            bail!("--cameras and --frame are for a capture: give DIR, not --scans");
        }
        return leave_one_out::run(scans, args);
    };
    let model = model(args.model.as_ref())?;
    let capture = Folder::open(folder, &args.cameras)?;
    let (mut views, truth) = (capture.views(args.frame)?, capture.body(args.frame)?);
    for (index, (_, silhouette)) in views.iter_mut().enumerate() {
        if let Some(seed) = args.noise {
            SilhouetteNoise::default().add_to(silhouette, seed, index as u64);
        }
    }
    let spinner = ProgressBar::new_spinner()
        .with_style(ProgressStyle::with_template("{spinner} looking for the body in {msg} views  {elapsed}")?)
        .with_message(views.len().to_string());
    spinner.enable_steady_tick(std::time::Duration::from_millis(200));
    let start = Instant::now();
    let found = fit(&model, &views, &Options::default());
    let seconds = start.elapsed().as_secs_f64();
    spinner.finish_and_clear();
    let found = found.with_context(|| format!("frame {} of {}", args.frame, folder.display()))?;
    let errors = shape_errors(&body_of(&model, &found), &truth)
        .context("the true mesh has no surface, or none of its joints has the name of one of the model's")?;
    if args.model.is_none() {
        println!("{SHIPPED}");
    }
    print(&errors, &found, seconds);
    if let Some(folder) = &args.overlay {
        overlays(folder, &capture, args.frame, &views, &found)?;
    }
    if let Some(path) = &args.json {
        let views = found.views.iter();
        let json = Json {
            errors,
            seconds,
            confidence: found.confidence,
            frame: args.frame,
            noise_seed: args.noise,
            cameras: views.map(|view| CameraJson { camera: &view.camera, iou: view.iou }).collect(),
            pose: &found.pose,
            alpha: &found.alpha,
        };
        write(path, serde_json::to_vec_pretty(&json)?)?;
    }
    Ok(())
}

/// What figures begin with where the body model is the one that comes with Marey.
pub(super) const SHIPPED: &str = "the shipped model's bodies are of a generator (MakeHuman), not of people";

pub(super) fn model(file: Option<&PathBuf>) -> anyhow::Result<BodyModel> {
    let Some(file) = file else { return Ok(BodyModel::shipped()) };
    let bytes = fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
    BodyModel::from_bytes(&bytes).with_context(|| format!("cannot use {}", file.display()))
}

fn body_of(model: &BodyModel, fit: &Fit) -> Body {
    let names = model.rig().joints().iter().map(|joint| joint.name.clone());
    Body { mesh: fit.mesh.clone(), joints: names.zip(fit.joints.iter().copied()).collect() }
}

fn print(errors: &ShapeErrors, found: &Fit, seconds: f64) {
    println!("                     this run   paper");
    let row = |name: &str, value: f64, paper: &str| println!("{name:<20} {value:>6.2} mm   {paper}");
    row("surface, mean abs", errors.surface_mean_abs_mm, "");
    row("surface, mean", errors.surface_mean_signed_mm, "0.075 mm");
    row("surface, std", errors.surface_std_mm, "16.16 mm");
    row("joints, mean", errors.joint_mean_mm, "");
    row("joints, largest", errors.joint_max_mm, "");
    row("height", errors.stature_error_mm, "");
    let views = found.views.iter().map(|view| format!("{} {:.3}", view.camera, view.iou));
    println!("overlap              {}", views.collect::<Vec<_>>().join(", "));
    println!("confidence           {:.2}, {seconds:.1} s", found.confidence);
    println!("(paper: one subject compared with a laser scan, 8 views)");
}

/// One picture a camera.
fn overlays(
    folder: &Path,
    capture: &Folder,
    frame: u32,
    views: &[(Camera, Silhouette)],
    found: &Fit,
) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let topology = Topology::new(&found.mesh.faces, found.mesh.vertices.len());
    for (index, (camera, silhouette)) in views.iter().enumerate() {
        let body = drawn(camera, &topology, &found.mesh.vertices);
        let picture = overlay(capture.picture(index, frame)?, silhouette, &body);
        write(&folder.join(format!("{}.png", camera.name)), write_image(&picture))?;
    }
    Ok(())
}
