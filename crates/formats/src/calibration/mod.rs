//! Calibrations of cameras: plain JSON, OpenCV FileStorage (YAML and JSON), TOML of Pose2Sim, Anipose and Caliscope,
//! Qualisys `.qca.txt`. The dialects are described in `docs/cameras.md`.

mod build;
mod check;
mod fit;
mod qca;
mod tree;
mod up;
mod write;
mod yaml;

use model::Camera;

use crate::{Error, Place, Read, Result, error::at_byte, read::Warnings, text::quote};

pub use fit::fit_to_image;
pub use up::UpAxis;
pub use write::write;

/// A calibration is a few kilobytes; what is larger is something else. Bytes.
const LARGEST: usize = 16 << 20;

/// More cameras than anybody has.
const MOST_CAMERAS: usize = 1000;

/// What a calibration file may not say.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Options {
    /// the axis of the file's world that points up; by default what the file or its format says, else what the pictures'
    /// upper edges say, with a warning
    pub up: Option<UpAxis>,
    /// metres in the file's unit of length; by default what the file or its format says, else 1
    pub metres_per_unit: Option<f64>,
    /// width and height of the pictures, pixels, of cameras for which the file doesn't say it
    pub image_size: Option<[u32; 2]>,
}

/// Cameras as a file has them: in the world of the file and its unit.
#[derive(Debug)]
struct FileCameras {
    cameras: Vec<FileCamera>,
    up: up::Stated,
    /// metres in the unit of length, if the file or its format says so
    metres: Option<f64>,
}

/// A camera as a file has it: `x_camera = rotation x_file + translation`, x right, y down, z forward.
#[derive(Debug)]
struct FileCamera {
    name: String,
    place: Place,
    size: Option<[u32; 2]>,
    /// focal lengths and principal point, pixels, shape `[3, 3]`
    matrix: nalgebra::Matrix3<f64>,
    /// in the order of OpenCV: k1, k2, p1, p2, k3, …
    distortion: Vec<f64>,
    rotation: nalgebra::Matrix3<f64>,
    translation: nalgebra::Vector3<f64>,
}

/// Reads the cameras of a calibration file into Marey's world: metres, y up. The kind of file is told by its content and,
/// where that leaves a doubt, by its name; a file with one camera without a name gives it the file's.
///
/// # Errors
/// If the file can't be read, has no camera, or has invalid cameras: mirrored, not orthonormal, fisheye, two of a
/// name, upside down, not looking at a common point, or in another unit than metres.
pub fn read(name: &str, bytes: &[u8], options: &Options) -> Result<Read<Vec<Camera>>> {
    if bytes.len() > LARGEST {
        let found = format!("{} bytes", bytes.len());
        return Err(Error::whole_file(found, format!("a calibration of at most {LARGEST} bytes")));
    }
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let at = error.valid_up_to();
        at_byte(at as u64, quote(&bytes[at..bytes.len().min(at + 8)]), "text in UTF-8")
    })?;
    let mut warnings = Warnings::default();
    let found = match Kind::detect(name, text) {
        Kind::Qualisys => qca::read(text, &mut warnings)?,
        Kind::Json => tree::read(name, &json(text)?, UpAxis::Y, &mut warnings)?,
        Kind::Toml => tree::read(name, &toml(text)?, UpAxis::Z, &mut warnings)?,
        Kind::Yaml => tree::read(name, &yaml::read(text)?, UpAxis::Y, &mut warnings)?,
    };
    let cameras = build::cameras(found, options, &mut warnings)?;
    Ok(warnings.beside(cameras))
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Qualisys,
    Json,
    Toml,
    Yaml,
}

impl Kind {
    fn detect(name: &str, text: &str) -> Self {
        let start = text.trim_start();
        let is_named = |ending: &str| name.to_ascii_lowercase().ends_with(ending);
        if start.starts_with('<') {
            Self::Qualisys
        } else if start.starts_with('{') || is_named(".json") {
            Self::Json
        } else if start.starts_with("%YAML") || is_named(".yml") || is_named(".yaml") {
            Self::Yaml
        } else if is_named(".toml") || start.starts_with('[') {
            Self::Toml
        } else {
            Self::Yaml
        }
    }
}

fn json(text: &str) -> Result<serde_json::Value> {
    serde_json::from_str(text).map_err(|error| {
        Error::at_line(error.line(), format!("text that is not JSON ({error})"), "the JSON of a calibration")
    })
}

fn toml(text: &str) -> Result<serde_json::Value> {
    toml::from_str(text).map_err(|error| {
        let start = error.span().map_or(0, |span| span.start.min(text.len()));
        let line = text.as_bytes()[..start].iter().filter(|byte| **byte == b'\n').count() + 1;
        let message = error.message().chars().take(200).collect::<String>();
        Error::at_line(line, format!("text that is not TOML ({message})"), "the TOML of a calibration")
    })
}
