//! Bodies whose scans are known, rendered and found again by a model that was learned without them.

use std::{path::Path, time::Instant};

use anyhow::{Context, bail};
use body::{Aligned, LearnOptions, ScanOptions, ScanSet};
use evaluation::{Body, Distribution, ShapeErrors, shape_errors};
use formats::archive::Entry;
use model::{Mesh, counted};
use nalgebra::Vector3;
use serde::Serialize;
use shape_fit::{Options, fit};
use vision::scene::{Ring, SilhouetteNoise, silhouettes};

use super::{Args, body_of};
use crate::{
    evaluate::{
        capture::{bytes, list},
        written::write,
    },
    progress::Progress,
};

/// What the name of the base pose contains.
const BASE: &str = "base";
/// Poses of a person: the base pose, and the first others.
const POSES: usize = 6;
/// A body whose joints are farther off on average was not found, metres.
const FOUND_M: f64 = 0.05;

/// A row of scans.csv.
struct Row {
    index: usize,
    subject: String,
    pose: String,
}

fn is_base(row: &Row) -> bool {
    row.pose.contains(BASE)
}

/// Every mesh, in the base pose or not.
struct Meshes {
    rows: Vec<Row>,
    /// metres, shape `[meshes, vertices]`
    vertices: Vec<Vector3<f64>>,
    /// metres, shape `[meshes, joints]`
    joints: Vec<Vector3<f64>>,
    count: usize,
}

#[derive(Serialize)]
struct Case {
    subject: String,
    pose: String,
    errors: Option<ShapeErrors>,
    confidence: Option<f64>,
    failure: Option<String>,
    seconds: f64,
}

#[derive(Serialize)]
struct Summary {
    surface_mean_abs_mm: Option<Distribution>,
    surface_std_mm: Option<Distribution>,
    joint_mean_mm: Option<Distribution>,
    stature_error_mm: Option<Distribution>,
    seconds: Option<Distribution>,
    /// share of the bodies whose joints are within 5 cm on average
    found: f64,
}

#[derive(Serialize)]
struct Json<'a> {
    people: usize,
    bodies: usize,
    views: usize,
    noise_seed: Option<u64>,
    all: Summary,
    base_pose: Summary,
    cases: &'a [Case],
}

/// Runs the protocol.
pub fn run(folder: &Path, args: &Args) -> anyhow::Result<()> {
    let set = ScanSet::read(entries(folder)?, &ScanOptions::default())?;
    set.warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
    let meshes = Meshes::read(folder)?;
    let scans = set.scans();
    eprintln!("bringing {} to one pose", counted(scans.len(), "scan"));
    let options = LearnOptions::default();
    let aligned = Aligned::new(&scans, &set.template, &options)?;
    let people = people(&meshes.rows, args.leave_one_out)?;
    let cameras = Ring::default().cameras();
    let bar = Progress::new(people.len() * POSES, "bodies")?;
    let mut cases = Vec::new();
    for person in &people {
        let own = meshes.rows.iter().filter(|row| row.subject == person.subject);
        // sets hold the scans in the base pose, in the order of their rows
        let without = meshes.rows.iter().filter(|row| is_base(row)).position(|row| row.index == person.index);
        let without = without.filter(|&at| at < scans.len());
        let without = without.with_context(|| format!("scan {} was not read", person.index))?;
        let model = aligned.learn(&set.template, &[without], &options)?.model;
        for row in own.take(POSES) {
            let truth = meshes.body(row.index, &set.template.faces, &model)?;
            let mut seen = silhouettes(&truth.mesh, &cameras);
            if let Some(seed) = args.noise {
                for (view, silhouette) in seen.iter_mut().enumerate() {
                    SilhouetteNoise::default().add_to(silhouette, seed + row.index as u64, view as u64);
                }
            }
            let views: Vec<_> = cameras.iter().cloned().zip(seen).collect();
            let start = Instant::now();
            let found = fit(&model, &views, &Options::default());
            let seconds = start.elapsed().as_secs_f64();
            let fitted = found.as_ref().ok();
            cases.push(Case {
                subject: row.subject.clone(),
                pose: row.pose.clone(),
                errors: fitted.and_then(|fit| shape_errors(&body_of(&model, fit), &truth)),
                confidence: fitted.map(|fit| fit.confidence),
                failure: found.as_ref().err().map(ToString::to_string),
                seconds,
            });
            bar.inc();
        }
    }
    bar.finish();
    report(&cases, people.len(), cameras.len(), args)
}

fn report(cases: &[Case], people: usize, views: usize, args: &Args) -> anyhow::Result<()> {
    let all = Summary::from_cases(cases.iter());
    let base_pose = Summary::from_cases(cases.iter().filter(|case| case.pose.contains(BASE)));
    println!("{:<28}{:>8}{:>8}{:>8}{:>8}", "", "median", "mean", "90 %", "max");
    for (name, summary) in [("all poses", &all), ("base pose", &base_pose)] {
        let row = |figure: &str, found: Option<Distribution>| {
            if let Some(Distribution { median, mean, percentile_90, max }) = found {
                println!("{name:<11}{figure:<17}{median:>8.2}{mean:>8.2}{percentile_90:>8.2}{max:>8.2}");
            }
        };
        row("surface, mm", summary.surface_mean_abs_mm);
        row("surface std, mm", summary.surface_std_mm);
        row("joints, mm", summary.joint_mean_mm);
        row("height, mm", summary.stature_error_mm);
        row("seconds", summary.seconds);
        println!("{name:<11}{:<17}{:>7.1} %", "found", 100.0 * summary.found);
    }
    for case in cases {
        if let Some(failure) = &case.failure {
            println!("{} {}: {failure}", case.subject, case.pose);
        }
    }
    println!(
        "{people} people, {} bodies, {views} views, each by a model learned without the person",
        cases.len()
    );
    if let Some(path) = &args.json {
        let bodies = cases.len();
        let json = Json { people, bodies, views, noise_seed: args.noise, all, base_pose, cases };
        write(path, serde_json::to_vec_pretty(&json)?)?;
    }
    Ok(())
}

impl Summary {
    fn from_cases<'a>(cases: impl Iterator<Item = &'a Case> + Clone) -> Self {
        let figure = |pick: fn(&ShapeErrors) -> f64| {
            Distribution::from_figures(cases.clone().filter_map(|case| case.errors.as_ref().map(pick)))
        };
        let is_found = |case: &&Case| case.errors.as_ref().is_some_and(|e| e.joint_mean_mm < 1e3 * FOUND_M);
        let count = cases.clone().count();
        Self {
            surface_mean_abs_mm: figure(|e| e.surface_mean_abs_mm),
            surface_std_mm: figure(|e| e.surface_std_mm),
            joint_mean_mm: figure(|e| e.joint_mean_mm),
            stature_error_mm: figure(|e| e.stature_error_mm.abs()),
            seconds: Distribution::from_figures(cases.clone().map(|case| case.seconds)),
            found: cases.filter(is_found).count() as f64 / count.max(1) as f64,
        }
    }
}

impl Meshes {
    fn read(folder: &Path) -> anyhow::Result<Self> {
        let table = String::from_utf8_lossy(&bytes(&folder.join("scans.csv"))?).into_owned();
        let mut rows = Vec::new();
        for (line, text) in table.lines().enumerate().skip(1).filter(|(_, text)| !text.trim().is_empty()) {
            let cells: Vec<&str> = text.split(',').map(str::trim).collect();
            let found = match cells[..] {
                [index, subject, pose] => index.parse().ok().map(|index| (index, subject, pose)),
                _ => None,
            };
            let Some((index, subject, pose)) = found else {
                bail!("scans.csv, line {}: {text:?}, expected index,subject,pose", line + 1);
            };
            rows.push(Row { index, subject: subject.to_owned(), pose: pose.to_owned() });
        }
        let array = |name: &str| {
            let read = formats::npy::read(&bytes(&folder.join(name))?);
            read.with_context(|| format!("cannot read {name}"))
        };
        let vertices = array("vertices.npy")?;
        let unit = if vertices.values.iter().any(|x| x.abs() > 100.0) { 1e-4 } else { 1.0 };
        let count = vertices.shape.first().copied().unwrap_or_default();
        let vertices = vertices.points()?.into_iter().map(|vertex| vertex * unit).collect();
        let joints = array("joints.npy")?.points()?;
        Ok(Self { rows, vertices, joints, count })
    }

    /// The true body of a mesh; its joints are called as those of the model.
    fn body(&self, index: usize, faces: &[[u32; 3]], model: &body::BodyModel) -> anyhow::Result<Body> {
        let piece = |all: &[Vector3<f64>], what: &str| {
            let length = all.len() / self.count.max(1);
            let found = all.get(index * length..(index + 1) * length);
            found.map(<[_]>::to_vec).with_context(|| format!("{what} has no row {index}"))
        };
        let names = model.rig().joints().iter().map(|joint| joint.name.clone());
        Ok(Body {
            mesh: Mesh::new(piece(&self.vertices, "vertices.npy")?, faces.to_vec())?,
            joints: names.zip(piece(&self.joints, "joints.npy")?).collect(),
        })
    }
}

/// Rows of the base pose of people evenly spread over those who were scanned in enough poses.
fn people(rows: &[Row], wanted: usize) -> anyhow::Result<Vec<&Row>> {
    let meshes = |subject: &str| rows.iter().filter(|row| row.subject == subject).count();
    let fit: Vec<&Row> = rows.iter().filter(|row| is_base(row) && meshes(&row.subject) >= POSES).collect();
    if fit.is_empty() || wanted == 0 {
        bail!(
            "{} people were scanned in {POSES} poses and {wanted} are to be left out, expected one at least",
            fit.len()
        );
    }
    let wanted = wanted.min(fit.len());
    Ok((0..wanted).map(|k| fit[k * fit.len() / wanted]).collect())
}

/// The files of the scans' folder and of the rig's beside it.
fn entries(folder: &Path) -> anyhow::Result<Vec<Entry>> {
    let mut files = list(folder)?;
    let rig = folder.join("../rig");
    if rig.is_dir() {
        files.extend(list(&rig)?);
    }
    let mut entries = Vec::new();
    for file in files {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if file.is_file() && body::is_part_of_scan_set(&name) {
            entries.push(Entry { name, bytes: bytes(&file)? });
        }
    }
    Ok(entries)
}
