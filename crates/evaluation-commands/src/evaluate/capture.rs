//! A folder with a calibrated capture and its truth.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use evaluation::Body;
use formats::{FileRole, calibration, image_files, mesh_files};
use model::{Camera, Image, Silhouette, counted};
use nalgebra::Vector3;
use serde::Deserialize;

/// Calibration, silhouettes and pictures of the cameras chosen, and true joints.
pub struct Folder {
    path: PathBuf,
    /// the cameras chosen
    pub cameras: Vec<Camera>,
    /// files of silhouettes by frame, shape `[cameras]`
    silhouettes: Vec<BTreeMap<u32, PathBuf>>,
    /// files of pictures by frame, where there are any, shape `[cameras]`
    pictures: Vec<BTreeMap<u32, PathBuf>>,
    joint_names: Vec<String>,
    /// metres, by frame
    joints: BTreeMap<u32, Vec<Vector3<f64>>>,
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

impl Folder {
    /// Looks through a folder, for the cameras named or numbered, or all.
    pub fn open(path: &Path, wanted: &[String]) -> anyhow::Result<Self> {
        let cameras = chosen(calibration(path)?, wanted)?;
        let (mut silhouettes, mut pictures) = (Vec::new(), Vec::new());
        for camera in &cameras {
            silhouettes.push(frames(&path.join("silhouettes").join(&camera.name), &["png"])?);
            let folder = path.join("images").join(&camera.name);
            let endings = ["png", "jpg", "jpeg"];
            pictures.push(if folder.is_dir() { frames(&folder, &endings)? } else { BTreeMap::new() });
        }
        let file = path.join("groundtruth").join("joints.json");
        let read: Joints = serde_json::from_slice(&bytes(&file)?)
            .with_context(|| format!("cannot read {}", file.display()))?;
        let mut joints = BTreeMap::new();
        for frame in read.frames {
            if frame.joints.len() != read.joint_names.len() {
                bail!(
                    "{}: frame {} has {}, expected {}, the number of names",
                    file.display(),
                    frame.frame,
                    counted(frame.joints.len(), "joint"),
                    read.joint_names.len()
                );
            }
            joints.insert(frame.frame, frame.joints.into_iter().map(Vector3::from).collect());
        }
        let path = path.to_owned();
        Ok(Self { path, cameras, silhouettes, pictures, joint_names: read.joint_names, joints })
    }

    /// Numbers of the frames of which every camera has a silhouette.
    pub fn frames(&self) -> Vec<u32> {
        let Some((first, others)) = self.silhouettes.split_first() else { return Vec::new() };
        first.keys().copied().filter(|frame| others.iter().all(|files| files.contains_key(frame))).collect()
    }

    /// What all cameras saw in a frame.
    pub fn views(&self, frame: u32) -> anyhow::Result<Vec<(Camera, Silhouette)>> {
        let read = |(camera, files): (&Camera, &BTreeMap<u32, PathBuf>)| {
            let Some(file) = files.get(&frame) else {
                bail!(
                    "found no PNG of frame {frame} in {}",
                    self.path.join("silhouettes").join(&camera.name).display()
                );
            };
            let read = image_files::read_silhouette(&bytes(file)?, &image_files::Limits::default())
                .with_context(|| format!("cannot read {}", file.display()))?;
            read.warnings.iter().for_each(|warning| eprintln!("warning: {}: {warning}", file.display()));
            Ok((camera.clone(), read.value))
        };
        self.cameras.iter().zip(&self.silhouettes).map(read).collect()
    }

    /// A camera's picture of a frame, in colour, where there is one.
    pub fn picture(&self, camera: usize, frame: u32) -> anyhow::Result<Option<Image>> {
        let Some(file) = self.pictures.get(camera).and_then(|files| files.get(&frame)) else {
            return Ok(None);
        };
        let read = image_files::read_image(&bytes(file)?, &image_files::Limits::default());
        Ok(Some(read.with_context(|| format!("cannot read {}", file.display()))?))
    }

    /// Names and true positions of joints in a frame, metres.
    pub fn joints(&self, frame: u32) -> anyhow::Result<Vec<(String, Vector3<f64>)>> {
        let Some(joints) = self.joints.get(&frame) else {
            bail!("{} has no frame {frame}", self.path.join("groundtruth").join("joints.json").display());
        };
        Ok(self.joint_names.iter().cloned().zip(joints.iter().copied()).collect())
    }

    /// The true body of a frame.
    pub fn body(&self, frame: u32) -> anyhow::Result<Body> {
        let folder = self.path.join("groundtruth");
        let meshes = frames(&folder, &["ply", "obj"])?;
        let Some(file) = meshes.get(&frame) else {
            bail!("found no mesh of frame {frame} in {}, expected mesh_{frame:04}.ply", folder.display());
        };
        let read = mesh_files::read(&file.to_string_lossy(), &bytes(file)?)
            .with_context(|| format!("cannot read {}", file.display()))?;
        Ok(Body { mesh: read.value, joints: self.joints(frame)? })
    }
}

fn calibration(folder: &Path) -> anyhow::Result<Vec<Camera>> {
    let mut files: Vec<PathBuf> = list(folder)?;
    files.retain(|file| file.file_stem().is_some_and(|stem| stem.to_string_lossy().starts_with("calib")));
    let Some(file) = files.first() else {
        bail!(
            "found no calibration in {}, expected a file called calibration that ends in {}",
            folder.display(),
            FileRole::Calibration.endings()
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

/// Files with these endings by the number that their names end with; the first of a number.
fn frames(folder: &Path, endings: &[&str]) -> anyhow::Result<BTreeMap<u32, PathBuf>> {
    let mut found = BTreeMap::new();
    for file in list(folder)?.into_iter().filter(|file| has_ending(file, endings)) {
        if let Some(number) = number(&file) {
            found.entry(number).or_insert(file);
        }
    }
    Ok(found)
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
