//! A folder with a calibrated capture and its truth.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use evaluation::Body;
use formats::{calibration, image_files};
use model::{Camera, Image, Mesh, Silhouette};
use nalgebra::Vector3;
use serde::Deserialize;

/// One frame of a capture.
pub struct Capture {
    /// the cameras chosen, and what they saw
    pub views: Vec<(Camera, Silhouette)>,
    /// file of each camera's picture, where there is one
    pub pictures: Vec<Option<PathBuf>>,
    /// the body that was seen
    pub truth: Body,
}

#[derive(Deserialize)]
struct Joints {
    joint_names: Vec<String>,
    frames: Vec<JointFrame>,
}

#[derive(Deserialize)]
struct JointFrame {
    frame: u32,
    /// metres, y up
    joints: Vec<[f64; 3]>,
}

/// Reads a frame of the cameras named or numbered.
pub fn read(folder: &Path, frame: u32, cameras: &[String]) -> anyhow::Result<Capture> {
    let truth = truth(&folder.join("groundtruth"), frame)?;
    let all = calibration(folder)?;
    let mut capture = Capture { views: Vec::new(), pictures: Vec::new(), truth };
    for camera in chosen(all, cameras)? {
        let silhouettes = folder.join("silhouettes").join(&camera.name);
        let Some(file) = file_of_frame(&silhouettes, frame, &["png"])? else {
            bail!("found no PNG of frame {frame} in {}", silhouettes.display());
        };
        let read = image_files::read_silhouette(&bytes(&file)?, &image_files::Limits::default())
            .with_context(|| format!("cannot read {}", file.display()))?;
        read.warnings.iter().for_each(|warning| eprintln!("warning: {}: {warning}", file.display()));
        let pictures = folder.join("images").join(&camera.name);
        let picture =
            if pictures.is_dir() { file_of_frame(&pictures, frame, &["png", "jpg", "jpeg"])? } else { None };
        capture.views.push((camera, read.value));
        capture.pictures.push(picture);
    }
    Ok(capture)
}

/// A picture in colour.
pub fn picture(path: &Path) -> anyhow::Result<Image> {
    image_files::read_image(&bytes(path)?, &image_files::Limits::default())
        .with_context(|| format!("cannot read {}", path.display()))
}

fn calibration(folder: &Path) -> anyhow::Result<Vec<Camera>> {
    let mut files: Vec<PathBuf> = list(folder)?;
    files.retain(|file| file.file_stem().is_some_and(|stem| stem.to_string_lossy().starts_with("calib")));
    let Some(file) = files.first() else {
        bail!(
            "found no calibration in {}, expected calibration.json, .yml, .toml or .qca.txt",
            folder.display()
        );
    };
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let read = calibration::read(&name, &bytes(file)?, &calibration::Options::default())
        .with_context(|| format!("cannot read {}", file.display()))?;
    read.warnings.iter().for_each(|warning| eprintln!("warning: {}: {warning}", file.display()));
    Ok(read.value)
}

fn chosen(all: Vec<Camera>, wanted: &[String]) -> anyhow::Result<Vec<Camera>> {
    if wanted.is_empty() {
        return Ok(all);
    }
    let find = |name: &String| {
        let by_number = || name.parse::<usize>().ok().and_then(|number| all.get(number));
        let found = all.iter().find(|camera| camera.name == *name).or_else(by_number);
        found.cloned().with_context(|| {
            let names: Vec<_> = all.iter().map(|camera| camera.name.as_str()).collect();
            format!("found no camera {name}, expected one of {} or its number from 0", names.join(", "))
        })
    };
    wanted.iter().map(find).collect()
}

fn truth(folder: &Path, frame: u32) -> anyhow::Result<Body> {
    let mut meshes = list(folder)?;
    meshes.retain(|file| number(file) == Some(frame) && has_ending(file, &["ply", "obj"]));
    let Some(file) = meshes.first() else {
        bail!("found no mesh of frame {frame} in {}, expected mesh_{frame:04}.ply", folder.display());
    };
    let content = bytes(file)?;
    let mesh =
        if has_ending(file, &["ply"]) { formats::ply::read(&content) } else { formats::obj::read(&content) };
    let mesh: Mesh = mesh.with_context(|| format!("cannot read {}", file.display()))?.value;
    let file = folder.join("joints.json");
    let joints: Joints =
        serde_json::from_slice(&bytes(&file)?).with_context(|| format!("cannot read {}", file.display()))?;
    let Some(of_frame) = joints.frames.iter().find(|joints| joints.frame == frame) else {
        bail!("{} has no frame {frame}", file.display());
    };
    if of_frame.joints.len() != joints.joint_names.len() {
        bail!(
            "{}: frame {frame} has {} joints, expected {}, the number of names",
            file.display(),
            of_frame.joints.len(),
            joints.joint_names.len()
        );
    }
    let positions = of_frame.joints.iter().map(|&position| Vector3::from(position));
    Ok(Body { mesh, joints: joints.joint_names.into_iter().zip(positions).collect() })
}

fn file_of_frame(folder: &Path, frame: u32, endings: &[&str]) -> anyhow::Result<Option<PathBuf>> {
    let files = list(folder)?;
    Ok(files.into_iter().find(|file| number(file) == Some(frame) && has_ending(file, endings)))
}

/// The number that a file's name ends with.
fn number(file: &Path) -> Option<u32> {
    let stem = file.file_stem()?.to_str()?;
    let digits = stem.trim_start_matches(|c: char| !c.is_ascii_digit());
    digits.parse().ok()
}

fn has_ending(file: &Path, endings: &[&str]) -> bool {
    file.extension().is_some_and(|found| endings.iter().any(|ending| found.eq_ignore_ascii_case(ending)))
}

/// Files of a folder in the order of their names.
pub fn list(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let entries = fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))?;
    let mut files = entries.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<_>>>()?;
    files.sort();
    Ok(files)
}

/// The bytes of a file.
pub fn bytes(file: &Path) -> anyhow::Result<Vec<u8>> {
    fs::read(file).with_context(|| format!("cannot read {}", file.display()))
}
