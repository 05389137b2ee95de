use serde::{Deserialize, Serialize};

use crate::Result;
use crate::bytes::{Reader, Writer};

const MAGIC: &[u8; 8] = b"MAREYRE2";
/// Numbers a frame's quality is written as.
const QUALITY_NUMBERS: usize = 5;

/// How well a frame is known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FrameQuality {
    /// root mean square distance between the control points and their measured positions, metres
    pub residual_m: f64,
    /// mean posterior standard deviation of the joint angles, radians
    pub sigma_rad: f64,
    /// energy per measured coordinate: about 1 when measurement and prediction agree
    pub energy: f64,
    /// distance of the nearest database window, degrees (root mean square over its numbers)
    pub neighbour_distance_deg: f64,
    /// number of measured control points
    pub measured_points: usize,
}

/// The poses of a range of frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Reconstruction {
    /// first frame of the session that was reconstructed
    pub first_frame: usize,
    /// smooth coordinates (see [`kinematics::Parametrisation::smooth`]), metres and radians, shape `[frames, dofs]`
    pub coordinates: Vec<f64>,
    /// standard deviations of `coordinates`, shape `[frames, dofs]`
    pub sigmas: Vec<f64>,
    /// shape `[frames]`
    pub quality: Vec<FrameQuality>,
}

#[derive(Serialize, Deserialize)]
struct Header {
    first_frame: usize,
    frames: usize,
    dofs: usize,
}

impl Reconstruction {
    /// The reconstruction as an artefact; read by [`Self::from_bytes`].
    pub fn to_bytes(&self) -> Vec<u8> {
        let frames = self.quality.len();
        let dofs = self.coordinates.len().checked_div(frames).unwrap_or(0);
        let mut writer = Writer::new(MAGIC, &Header { first_frame: self.first_frame, frames, dofs });
        writer.numbers(&self.coordinates);
        writer.numbers(&self.sigmas);
        for q in &self.quality {
            writer.numbers(&[
                q.residual_m,
                q.sigma_rad,
                q.energy,
                q.neighbour_distance_deg,
                q.measured_points as f64,
            ]);
        }
        writer.finish()
    }

    /// Reads what [`Self::to_bytes`] wrote.
    ///
    /// # Errors
    /// If the bytes are something else, or contradict themselves.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let (header, mut reader): (Header, _) = Reader::new(bytes, MAGIC, "reconstruction artefact")?;
        let coordinates = reader.numbers(header.frames.checked_mul(header.dofs))?;
        let sigmas = reader.numbers(header.frames.checked_mul(header.dofs))?;
        let numbers = reader.numbers(header.frames.checked_mul(QUALITY_NUMBERS))?;
        reader.end()?;
        let quality = numbers.as_chunks::<QUALITY_NUMBERS>().0.iter().map(|n| FrameQuality {
            residual_m: n[0],
            sigma_rad: n[1],
            energy: n[2],
            neighbour_distance_deg: n[3],
            measured_points: n[4] as usize,
        });
        Ok(Self { first_frame: header.first_frame, coordinates, sigmas, quality: quality.collect() })
    }
}
