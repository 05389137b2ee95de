//! `marey evaluate multiview`.

mod film;
mod joints;
mod report;
mod texture;

use std::{
    path::{Path, PathBuf},
    sync::atomic::AtomicBool,
    time::Instant,
};

use anyhow::{Context, bail};
use body::BodyModel;
use client::{numbers::positive, outputs};
use evaluation::training_poses::training_poses;
use model::{Camera, Silhouette};
use motion_db::Clip;
use nalgebra::Vector3;
use shape_fit::{Fit, fit};
use tracking::{ObservedFrame, Options, Part, ParticleOptions, Tracked, Tracker, built_in_poses};
use vision::scene::SilhouetteNoise;

use super::{capture::Folder, recovery, shape, written::write};
use crate::{motions, progress::Progress};
use film::Film;
use joints::{JointErrors, Joints};
use report::{FrameReport, Report, Settings, Times};
use texture::Texture;

/// `marey evaluate multiview`
#[derive(Debug, clap::Args)]
#[command(after_help = "\
DIR holds calibration.json (or .yml, .toml, …), silhouettes/CAMERA/0000.png and groundtruth/joints.json; images/CAMERA/0000.jpg, if \
there are any, show points of the person that are found again, and are the background of the overlays. The body's shape and its first pose \
are found in the first frame, without a starting pose; then it is followed from frame to frame.

Joints are compared by name. Two simpler methods are shown for comparison: local optimisation without particles, and the first pose, moved along \
rigidly for all frames.

Examples:
  marey evaluate multiview capture/ --json errors.json
  marey evaluate multiview capture/ --cameras 0,2,4 --noise --overlay films/
  marey evaluate multiview capture/ --prior-from recordings/")]
pub struct Args {
    /// Folder of a capture: calibration, silhouettes and true joints
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Only these cameras: their names, or their numbers from 0 [default: all]
    #[arg(long, value_delimiter = ',', value_name = "CAMERA")]
    cameras: Vec<String>,
    /// Flip 1.2 % of the pixels and add blobs and holes, with this seed
    #[arg(long, value_name = "SEED", num_args = 0..=1, default_missing_value = "1")]
    noise: Option<u64>,
    /// Use silhouettes alone, even where there are pictures
    #[arg(long)]
    no_texture: bool,
    /// Learn the prior of the particle search from these recordings: ASF+AMC of the CMU skeleton, also .zst or .gz [default:
    /// built-in poses]
    #[arg(long, num_args = 1.., value_name = "DIR")]
    prior_from: Vec<PathBuf>,
    /// A body model to use instead of the one that comes with Marey
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Only the first frames
    #[arg(long, value_name = "N")]
    frames: Option<usize>,
    /// A different seed gives different particles; the same seed gives the same
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Measure how long a particle search takes in every N-th frame, without using what it finds; 0 for none
    #[arg(long, value_name = "N", default_value_t = 8)]
    time_search_every: usize,
    /// Write the errors to this file; overwritten if it exists
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write a film for each camera, with the outline of the body found, to this folder; existing
    /// films of the same names are overwritten
    #[arg(long, value_name = "DIR")]
    overlay: Option<PathBuf>,
    /// Frames a second of these films
    #[arg(long, value_name = "RATE", default_value_t = 15.0, value_parser = positive)]
    rate: f64,
}

/// Runs `marey evaluate multiview`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    outputs::check(&[("--model", args.model.as_ref())], &[("--json", args.json.as_ref())])?;
    let model = shape::model(args.model.as_ref())?;
    let folder = Folder::open(&args.folder, &args.cameras)?;
    let mut frames = folder.frames();
    frames.truncate(args.frames.unwrap_or(usize::MAX));
    let Some(&first) = frames.first() else {
        bail!("found no frame with a silhouette of every camera in {}", args.folder.display());
    };
    let training = prior(&model, &args.prior_from)?;
    let joints = Joints::new(&model, &folder.joints(first)?)?;
    let bar = Progress::new(frames.len(), "frames")?;
    bar.note("looking for the body".to_owned());
    let started = Instant::now();
    let found = fit(&model, &seen(&folder, first, args.noise)?, &shape_fit::Options::default());
    let found: Fit = found.with_context(|| format!("frame {first} of {}", args.folder.display()))?;
    let mut run = Run::new(&model, &found, &training, args)?;
    run.times.fit_shape_s = started.elapsed().as_secs_f64();
    let mut texture = (!args.no_texture).then(|| Texture::new(folder.cameras.len()));
    let mut film =
        args.overlay.as_deref().map(|to| Film::create(to, &model, &found, &folder, args.rate)).transpose()?;
    let mut reports = Vec::new();
    for (index, &number) in frames.iter().enumerate() {
        let views = seen(&folder, number, args.noise)?;
        let started = Instant::now();
        let mut observed = ObservedFrame::new(index, &views)?;
        let prepare_ms = ms(started);
        if let Some(texture) = &mut texture {
            observed = texture.add(observed, &folder, number, &views)?;
        }
        let truth = folder.joints(number)?;
        let (tracked, mut report) = run.frame(&observed, &joints, &truth)?;
        (report.frame, report.prepare_ms) = (number, prepare_ms);
        report.kept = joints.compare(&found.joints, &truth);
        bar.note(format!("{:.0} mm", report.errors.mean_mm));
        if let Some(film) = &mut film {
            film.add(&folder, number, &views, &tracked)?;
        }
        reports.push(report);
        bar.inc();
    }
    bar.finish();
    if let Some(film) = film {
        film.finish()?;
    }
    if let Some(texture) = texture {
        run.times.features_ms = texture.ms;
        run.times.matches = texture.matches;
    }
    let settings = Settings {
        cameras: folder.cameras.iter().map(|camera| camera.name.clone()).collect(),
        noise_seed: args.noise,
        prior_poses: training.len(),
        prior_is_recorded: !args.prior_from.is_empty(),
        alpha: found.alpha.clone(),
    };
    let report = Report::new(joints, reports, &run.times, settings);
    if args.model.is_none() {
        println!("{}", shape::SHIPPED);
    }
    report.print();
    if let Some(path) = &args.json {
        write(path, serde_json::to_vec_pretty(&report)?)?;
    }
    Ok(())
}

/// Training poses of the prior.
fn prior(model: &BodyModel, folders: &[PathBuf]) -> anyhow::Result<Vec<Vec<f64>>> {
    if folders.is_empty() {
        return Ok(built_in_poses(model));
    }
    let clips = motions::read(folders)?;
    let all: Vec<&Clip> = clips.iter().collect();
    Ok(training_poses(&recovery::poses(model, &all)?, recovery::TRAINING_POSES)?)
}

/// What all cameras saw in a frame, with noise if it is wanted.
fn seen(folder: &Folder, frame: u32, noise: Option<u64>) -> anyhow::Result<Vec<(Camera, Silhouette)>> {
    let mut views = folder.views(frame)?;
    if let Some(seed) = noise {
        for (view, (_, silhouette)) in views.iter_mut().enumerate() {
            SilhouetteNoise::default().add_to(silhouette, seed.wrapping_add(frame.into()), view as u64);
        }
    }
    Ok(views)
}

/// Marey and local optimisation alone, side by side, and how long they take.
struct Run<'a> {
    tracker: Tracker<'a>,
    without_particles: Tracker<'a>,
    /// for searches whose result isn't used
    idle: Tracker<'a>,
    time_search_every: usize,
    times: Times,
}

impl<'a> Run<'a> {
    fn new(model: &'a BodyModel, start: &Fit, training: &[Vec<f64>], args: &Args) -> anyhow::Result<Self> {
        let particles = ParticleOptions { seed: args.seed, ..ParticleOptions::default() };
        let tracker = |particles: Option<ParticleOptions>| {
            let options = Options { particles, ..Options::default() };
            Tracker::with_training_poses(model, &start.alpha, &start.pose, options, training.to_vec())
        };
        Ok(Self {
            tracker: tracker(Some(particles))?,
            without_particles: tracker(None)?,
            idle: tracker(Some(ParticleOptions { part: Part::Whole, ..particles }))?,
            time_search_every: args.time_search_every,
            times: Times::default(),
        })
    }

    fn frame(
        &mut self,
        frame: &ObservedFrame,
        joints: &Joints,
        truth: &[(String, Vector3<f64>)],
    ) -> anyhow::Result<(Tracked, FrameReport)> {
        let stop = AtomicBool::new(false);
        let started = Instant::now();
        let tracked = self.tracker.track(frame, &stop)?;
        let track_ms = ms(started);
        let alone = self.without_particles.track(frame, &stop)?;
        if self.time_search_every > 0 && frame.index.is_multiple_of(self.time_search_every) {
            let misalignment = self.idle.misalignment(frame, &tracked.pose);
            let started = Instant::now();
            self.idle.search(frame, &tracked.pose, &tracked.pose, &misalignment, &|| true);
            self.times.search_ms.push(ms(started));
        }
        let report = FrameReport {
            frame: 0,
            stage: tracked.stage,
            errors: joints.compare(&tracked.joints, truth),
            iou: tracked.mean_iou(),
            misaligned: tracked.misalignment.misaligned().map(|limb| format!("{limb:?}")).collect(),
            limb_error_mm: 1000.0 * tracked.misalignment.worst_m(),
            effective_sample_size: tracked.effective_sample_size,
            prepare_ms: 0.0,
            track_ms,
            local_only: joints.compare(&alone.joints, truth),
            local_only_iou: alone.mean_iou(),
            kept: JointErrors::default(),
        };
        Ok((tracked, report))
    }
}

fn ms(since: Instant) -> f64 {
    1000.0 * since.elapsed().as_secs_f64()
}

/// What was written, for the user.
fn say_written(path: &Path) {
    println!("wrote {}", path.display());
}
