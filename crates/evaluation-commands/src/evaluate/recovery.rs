//! `marey evaluate recovery`.

mod poses;
mod report;

use std::path::PathBuf;

use body::BodyModel;
use clap::ValueEnum;
use client::{numbers::finite, outputs};
use evaluation::recovery::{Limbs, Method, Setting, recover};
use model::{counted, shown};
use tracking::built_in_poses;
use vision::scene::Ring;

use super::{shape, written::write};
use crate::progress::Progress;
use poses::{Part, Poses};
pub(super) use poses::{TRAINING_POSES, poses};
use report::{Cell, Json};

/// Pixels of the cameras: particles are rendered smaller anyway.
const SIZE: u32 = 502;
const FOCAL: f64 = 663.0;

/// `marey evaluate recovery`
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Bodies are rendered in poses of recorded people, as a ring of cameras would see them. Then limbs are turned by some degrees in each \
angle, and every way to find the pose again starts from there: local optimisation alone, one particle search over the turned limbs \
with and without the prior, and all that Marey does in a frame. Found means that all joints are within 50 mm of the truth.

Poses are chosen to be as different as possible. Bodies have the poses of a third of the performers, the prior is made of the poses \
of another third (about a hundred); the last third is for trying settings on (--part tune). Without --motion, bodies have poses of \
synthetic motion and the prior is the built-in one.

Examples:
  marey evaluate recovery --limbs leg --turned 40 --starts 5
  marey evaluate recovery --motion recordings/ --limbs arm --turned 60 --starts 5")]
pub struct Args {
    /// Folders of recordings: ASF+AMC of the CMU skeleton, also .zst or .gz [default: synthetic motion]
    #[arg(long, num_args = 1.., value_name = "DIR")]
    motion: Vec<PathBuf>,
    /// Whose poses the bodies have
    #[arg(long, value_enum, default_value_t = Part::Report)]
    part: Part,
    /// How far limbs are turned in each angle, degrees
    #[arg(long, value_delimiter = ',', value_name = "DEGREES", value_parser = finite)]
    #[arg(default_value = "10,20,40")]
    turned: Vec<f64>,
    /// Which limbs are turned
    #[arg(long, value_enum, value_delimiter = ',', default_value = "arm,arms,leg")]
    limbs: Vec<Turned>,
    /// Bodies in each cell of the table
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(2..=10_000))]
    starts: u32,
    /// Cameras in a ring
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(2..=16))]
    cameras: u32,
    /// Flip 1.2 % of the pixels and add blobs and holes
    #[arg(long)]
    noise: bool,
    /// A different seed gives different bodies and particles; the same seed gives the same
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write the distances of every start to this file; overwritten if it exists
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Limbs that are turned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Turned {
    /// the left arm
    Arm,
    /// both arms
    Arms,
    /// the left leg
    Leg,
    /// arms and legs
    All,
}

impl Turned {
    fn limbs(self) -> (&'static str, Limbs) {
        match self {
            Self::Arm => ("arm", Limbs::Arm),
            Self::Arms => ("arms", Limbs::Arms),
            Self::Leg => ("leg", Limbs::Leg),
            Self::All => ("all", Limbs::All),
        }
    }
}

/// Runs `marey evaluate recovery`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    outputs::check(&[], &[("--json", args.json.as_ref())])?;
    if let Some(&bad) = args.turned.iter().find(|degrees| !(0.0..=180.0).contains(*degrees)) {
        let bad = shown(bad);
        anyhow::bail!("--turned has {bad}, expected degrees from 0 to 180");
    }
    let model = BodyModel::shipped();
    let built_in = built_in_poses(&model);
    let Poses { drawn, prior, note } =
        poses::read(&model, &args.motion, args.part, args.starts as usize, args.seed)?;
    let methods = match &prior {
        Some(prior) => Method::all(prior, Some(&built_in)),
        None => Method::all(&built_in, None),
    };
    let ring = Ring { cameras: args.cameras as usize, size: SIZE, focal: FOCAL, ..Ring::default() };
    let cameras = ring.cameras();
    let noise = if args.noise { "noisy" } else { "exact" };
    eprintln!("{note}; {}, {noise} silhouettes", counted(cameras.len(), "camera"));
    let cells = args.limbs.len() * args.turned.len();
    let bar = Progress::new(cells * drawn.len(), "starts")?;
    let mut found = Vec::new();
    for limbs in &args.limbs {
        for &degrees in &args.turned {
            let (name, limbs) = limbs.limbs();
            let setting = Setting {
                model: &model,
                cameras: &cameras,
                is_noisy: args.noise,
                poses: &drawn,
                limbs,
                turned_rad: degrees.to_radians(),
                seed: args.seed,
            };
            let recovered = recover(&setting, &methods, &|| bar.inc())?;
            found.push(Cell::new(name, degrees, &methods, recovered));
        }
    }
    bar.finish();
    let table =
        report::table(&found, format!("{note}; {}, {noise} silhouettes", counted(cameras.len(), "camera")));
    println!("{}\n{}\n{}\n\n{}", shape::SHIPPED, table.title, table.note, table.text().trim_end());
    report::print_claim(&found);
    if let Some(path) = &args.json {
        let json = Json {
            command: super::written::command(),
            note,
            starts: drawn.len(),
            cameras: cameras.len(),
            noise: args.noise,
            seed: args.seed,
            cells: found,
        };
        write(path, serde_json::to_vec_pretty(&json)?)?;
    }
    Ok(())
}
