//! The model's file, `.marey-body`: see `docs/body.md` for the layout.

use std::io::{Read as _, Write as _};

use flate2::{Compression, read::DeflateDecoder, write::DeflateEncoder};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::population::Population;
use crate::rig_json::RigFile;
use crate::shape::Component;
use crate::skin::INFLUENCES;
use crate::{BodyModel, Error, MAX_COMPONENTS, MAX_VERTICES, ModelParts, Result, Skin};

/// Largest model file that is read, bytes.
pub const MAX_BYTES: usize = 16 << 20;

const MAGIC: [u8; 8] = *b"MAREYBOD";
const VERSION: u32 = 1;
const CHECKSUM_BYTES: usize = 32;
const MAX_FACES: usize = 1 << 18;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    description: String,
    vertices: usize,
    faces: usize,
    /// metres a step of every component
    scales: Vec<f32>,
    variance_kept: Vec<f64>,
    rig: RigFile,
    population: Population,
}

impl Header {
    /// Bytes of the numbers that follow, uncompressed.
    fn payload_bytes(&self) -> usize {
        self.faces * 3 * 2 + self.vertices * (3 * 4 + INFLUENCES * 3 + self.scales.len() * 3 * 2)
    }
}

impl BodyModel {
    /// The model that comes with Marey: of 114 synthetic bodies (CC0 1.0; see `assets/README.md`).
    pub fn shipped() -> Self {
        let bytes = include_bytes!("../assets/shipped.marey-body");
        Self::from_bytes(bytes).expect("a test reads the file that is compiled in")
    }

    /// The model as a file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let header = Header {
            description: self.description.clone(),
            vertices: self.mean.len(),
            faces: self.faces.len(),
            scales: self.components.iter().map(|c| c.scale as f32).collect(),
            variance_kept: self.variance_kept.clone(),
            rig: RigFile::from_parts(&self.rig, &self.regressor),
            population: self.population.clone(),
        };
        let header_text =
            serde_json::to_vec(&header).expect("numbers, names and lists always have a JSON form");
        let mut payload = Vec::with_capacity(header.payload_bytes());
        payload.extend(self.faces.iter().flatten().flat_map(|&corner| (corner as u16).to_le_bytes()));
        payload.extend(self.mean.iter().flat_map(|v| [v.x, v.y, v.z]).flat_map(|x| (x as f32).to_le_bytes()));
        payload.extend(self.skin.joints().iter().flatten());
        payload.extend(self.skin.weights().iter().flatten().flat_map(|weight| weight.to_le_bytes()));
        for component in &self.components {
            payload.extend(component.steps.iter().flatten().flat_map(|step| step.to_le_bytes()));
        }
        let mut bytes = Vec::from(MAGIC);
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend((header_text.len() as u32).to_le_bytes());
        bytes.extend(header_text);
        let mut encoder = DeflateEncoder::new(bytes, Compression::best());
        encoder.write_all(&payload).expect("writing to memory cannot fail");
        let mut bytes = encoder.finish().expect("writing to memory cannot fail");
        bytes.extend(blake3::hash(&bytes).as_bytes());
        bytes
    }

    /// Reads a model from a file.
    ///
    /// # Errors
    /// [`Error::Version`] for another version; [`Error::BadFile`] if the bytes are damaged, cut off or too many; the errors
    /// of [`BodyModel::new`] if they hold what is not a body.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        if bytes.len() > MAX_BYTES {
            return Err(bad(format!("{} bytes, expected at most {MAX_BYTES}", bytes.len())));
        }
        let Some((magic, rest)) = bytes.split_first_chunk::<8>() else {
            return Err(bad("shorter than 8 bytes"));
        };
        if *magic != MAGIC {
            return Err(bad("the first 8 bytes are not MAREYBOD"));
        }
        let version = rest.first_chunk().map(|&b| u32::from_le_bytes(b)).ok_or_else(|| bad("cut off"))?;
        if version != VERSION {
            return Err(Error::Version { found: version, expected: VERSION });
        }
        let checked = bytes.split_last_chunk::<CHECKSUM_BYTES>();
        let (content, _) = checked
            .filter(|(content, checksum)| blake3::hash(content).as_bytes() == *checksum)
            .ok_or_else(|| bad("checksum does not fit the content: the file is damaged or cut off"))?;
        let (length, rest) = content
            .get(12..)
            .and_then(|rest| rest.split_first_chunk::<4>())
            .ok_or_else(|| bad("no header"))?;
        let length = u32::from_le_bytes(*length) as usize;
        let (text, packed) = rest.split_at_checked(length).ok_or_else(|| bad("header is cut off"))?;
        let header: Header = serde_json::from_slice(text).map_err(|e| bad(format!("header: {e}")))?;
        if header.vertices > MAX_VERTICES || header.faces > MAX_FACES || header.scales.len() > MAX_COMPONENTS
        {
            return Err(bad(format!(
                "{} vertices, {} faces and {} components, expected at most {MAX_VERTICES}, {MAX_FACES} and {MAX_COMPONENTS}",
                header.vertices,
                header.faces,
                header.scales.len()
            )));
        }
        let payload = unpack(packed, header.payload_bytes())?;
        read_payload(header, &payload)
    }
}

/// Exactly `expected` bytes, uncompressed.
fn unpack(packed: &[u8], expected: usize) -> Result<Vec<u8>> {
    let mut payload = Vec::with_capacity(expected);
    DeflateDecoder::new(packed)
        .take(expected as u64 + 1)
        .read_to_end(&mut payload)
        .map_err(|e| bad(format!("compressed numbers: {e}")))?;
    if payload.len() != expected {
        return Err(bad(format!("numbers are not the {expected} bytes that the header says")));
    }
    Ok(payload)
}

fn read_payload(header: Header, payload: &[u8]) -> Result<BodyModel> {
    let (vertices, components) = (header.vertices, header.scales.len());
    let (faces, rest) = payload.split_at(header.faces * 6);
    let (mean, rest) = rest.split_at(vertices * 12);
    let (joints, rest) = rest.split_at(vertices * INFLUENCES);
    let (weights, steps) = rest.split_at(vertices * INFLUENCES * 2);
    let corners: Vec<u32> = faces.as_chunks().0.iter().map(|&b| u32::from(u16::from_le_bytes(b))).collect();
    let mean: Vec<f64> = mean.as_chunks().0.iter().map(|&b| f64::from(f32::from_le_bytes(b))).collect();
    let weights: Vec<u16> = weights.as_chunks().0.iter().map(|&b| u16::from_le_bytes(b)).collect();
    let steps: Vec<i16> = steps.as_chunks().0.iter().map(|&b| i16::from_le_bytes(b)).collect();
    let mut steps = steps.as_chunks::<3>().0.chunks_exact(vertices.max(1));
    let mut read = Vec::with_capacity(components);
    for (scale, steps) in header.scales.iter().zip(&mut steps) {
        if !(0.0..=1.0).contains(scale) {
            return Err(bad(format!("a component has steps of {scale} m, expected 0 to 1")));
        }
        read.push(Component { scale: f64::from(*scale), steps: steps.to_vec() });
    }
    let rig = header.rig.rig()?;
    let regressor = header.rig.regressor(vertices)?.ok_or_else(|| bad("no joint regressor"))?;
    let skin = Skin::from_parts(joints.as_chunks().0, weights.as_chunks().0, rig.num_joints())?;
    let population = header.population;
    if !population.fits(components) || read.len() != components {
        return Err(bad("measurements are not those of as many components"));
    }
    let parts = ModelParts {
        description: header.description,
        faces: corners.as_chunks::<3>().0.to_vec(),
        mean: mean.as_chunks::<3>().0.iter().map(|&v| Vector3::from(v)).collect(),
        components: Vec::new(),
        variance_kept: header.variance_kept,
        rig,
        regressor,
        skin,
    };
    let mut model = BodyModel::assemble(parts, read)?;
    model.population = population;
    Ok(model)
}

fn bad(what: impl Into<String>) -> Error {
    Error::BadFile { what: what.into() }
}
