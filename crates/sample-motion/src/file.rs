//! The model's file: see `docs/sample-motion.md` for the layout.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::body::Body;
use crate::features::{CHANNELS, Landmarks};
use crate::movement::{Model, Movement, MovementShape, Quantised};
use crate::{Error, Result};

/// What must be said wherever drawn motion is shown.
pub const NOTICE: &str = "synthetic motion, drawn from a statistical model; no recording of a person";
/// The credit line of the data that the bundled model was learned from.
pub const CREDIT: &str = "The data used in this project was obtained from mocap.cs.cmu.edu. \
                          The database was created with funding from NSF EIA-0196217.";
/// Largest model file that is read, bytes; the bundled one is at most 500 KB.
pub const MAX_BYTES: usize = 4 << 20;

const MAGIC: [u8; 8] = *b"MAREYSMO";
const VERSION: u32 = 1;
const CHECKSUM_BYTES: usize = 32;
const MOST_FUNCTIONS: usize = 256;
const MOST_COMPONENTS: usize = 256;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    notice: String,
    credit: String,
    motions: usize,
    ball_m: f64,
    references: Vec<[f64; 3]>,
    body: Body,
    movements: Vec<MovementHeader>,
}

#[derive(Serialize, Deserialize)]
struct MovementHeader {
    shape: MovementShape,
    style: usize,
    variation: usize,
}

impl Model {
    /// The model as a file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let movement = |m: &Movement| MovementHeader {
            shape: m.shape.clone(),
            style: m.style.len(),
            variation: m.variation.len(),
        };
        let header = Header {
            notice: NOTICE.to_owned(),
            credit: CREDIT.to_owned(),
            motions: self.motions,
            ball_m: self.ball_m,
            references: self.references.iter().map(|&r| r.into()).collect(),
            body: self.body.clone(),
            movements: self.movements.iter().map(movement).collect(),
        };
        let header = serde_json::to_vec(&header).expect("numbers, names and lists always have a JSON form");
        let mut bytes = Vec::from(MAGIC);
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend((header.len() as u32).to_le_bytes());
        bytes.extend(header);
        for movement in &self.movements {
            for numbers in std::iter::once(&movement.mean).chain(&movement.style).chain(&movement.variation) {
                bytes.extend(numbers.scale.to_le_bytes());
                bytes.extend(numbers.steps.iter().flat_map(|s| s.to_le_bytes()));
            }
        }
        bytes.extend(blake3::hash(&bytes).as_bytes());
        bytes
    }

    /// Reads a model from a file.
    ///
    /// # Errors
    /// [`Error::Version`] for another version; [`Error::BadFile`] if the bytes are damaged, cut off, too many, or
    /// hold numbers with which no motion can be drawn.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        if bytes.len() > MAX_BYTES {
            return Err(bad(format!("{} bytes, expected at most {MAX_BYTES}", bytes.len())));
        }
        let mut reader = Reader { bytes, at: 0 };
        if reader.take(8)? != MAGIC {
            return Err(bad("the first 8 bytes are not MAREYSMO"));
        }
        let version = reader.u32()?;
        if version != VERSION {
            return Err(Error::Version { found: version, expected: VERSION });
        }
        let Some((content, checksum)) = bytes.split_last_chunk::<CHECKSUM_BYTES>() else {
            return Err(bad("no checksum"));
        };
        if blake3::hash(content).as_bytes() != checksum {
            return Err(bad("checksum does not fit the content: the file is damaged or cut off"));
        }
        reader.bytes = content;
        let header_bytes = reader.u32()? as usize;
        let header: Header =
            serde_json::from_slice(reader.take(header_bytes)?).map_err(|e| bad(format!("header: {e}")))?;
        let mut movements = Vec::new();
        for header in header.movements {
            check_shape(&header)?;
            let numbers = header.shape.num_numbers();
            let mean = reader.numbers(numbers)?;
            let style = (0..header.style).map(|_| reader.numbers(numbers)).collect::<Result<_>>()?;
            let variation = (0..header.variation).map(|_| reader.numbers(numbers)).collect::<Result<_>>()?;
            movements.push(Movement { shape: header.shape, mean, style, variation });
        }
        if reader.at != content.len() {
            return Err(bad(format!("{} bytes after the last number", content.len() - reader.at)));
        }
        let model = Self {
            body: header.body,
            references: header.references.into_iter().map(Vector3::from).collect(),
            ball_m: header.ball_m,
            motions: header.motions,
            movements,
        };
        model.check()?;
        Ok(model)
    }

    fn check(&self) -> Result<()> {
        self.body.check().map_err(bad)?;
        let skeleton = self.body.mean().map_err(|e| bad(e.to_string()))?;
        Landmarks::find(&skeleton).map_err(bad)?;
        if self.references.len() != skeleton.num_joints() {
            return Err(bad(format!(
                "{} reference rotations for {} joints",
                self.references.len(),
                skeleton.num_joints()
            )));
        }
        crate::features::parametrisation(&skeleton, &self.references).map_err(|e| bad(e.to_string()))?;
        if self.ball_m.abs() > 1.0 || self.references.iter().any(|r| r.norm() > 10.0) {
            return Err(bad("height of the feet or a reference rotation is out of range"));
        }
        for action in crate::Action::ALL {
            let parts: Vec<_> = self.movements.iter().filter(|m| m.shape.action == action).collect();
            if parts.windows(2).any(|w| w[0].style.len() != w[1].style.len()) {
                return Err(bad(format!("movements of {action} differ in their number of styles")));
            }
        }
        Ok(())
    }
}

fn check_shape(header: &MovementHeader) -> Result<()> {
    let shape = &header.shape;
    let fail = |what: &str| Err(bad(format!("movement {:?}: {what}", shape.name)));
    let functions_fit = match shape.basis {
        crate::basis::Basis::Cycle { harmonics } => harmonics <= MOST_FUNCTIONS / 2,
        crate::basis::Basis::Once { cosines } => (1..=MOST_FUNCTIONS).contains(&cosines),
    };
    if !functions_fit || header.style.max(header.variation) > MOST_COMPONENTS {
        return fail("too many functions or components");
    }
    let rising = shape.phases.windows(2).all(|w| w[1] > w[0]);
    if !(2..=16).contains(&shape.phases.len())
        || !rising
        || shape.phases[0] != 0.0
        || shape.phases.last() != Some(&1.0)
    {
        return fail("phases of the marks do not rise from 0 to 1");
    }
    let (shortest, longest) = shape.pause_secs;
    if !(0.0..=1.0).contains(&shape.share) || !(0.0..=longest).contains(&shortest) || longest > 60.0 {
        return fail("share or pauses out of range");
    }
    if shape.persistence.len() != header.variation
        || !shape.persistence.iter().all(|p| (0.0..1.0).contains(p))
    {
        return fail("persistence is not one number in [0, 1) for each component of variation");
    }
    if shape.ranges.len() != CHANNELS
        || !shape.ranges.iter().all(|(l, h)| l <= h && l.abs().max(h.abs()) < 1e3)
    {
        return fail("ranges of the channels are missing or out of order");
    }
    Ok(())
}

fn bad(reason: impl Into<String>) -> Error {
    Error::BadFile { reason: reason.into() }
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    fn take(&mut self, length: usize) -> Result<&'a [u8]> {
        let rest = &self.bytes[self.at.min(self.bytes.len())..];
        match rest.get(..length) {
            Some(found) => {
                self.at += length;
                Ok(found)
            }
            None => Err(bad(format!("{} bytes left at byte {}, expected {length}", rest.len(), self.at))),
        }
    }

    fn u32(&mut self) -> Result<u32> {
        let b = self.take(4)?;
        Ok(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    }

    fn numbers(&mut self, count: usize) -> Result<Quantised> {
        let at = self.at;
        let scale = f32::from_bits(self.u32()?);
        if !(scale > 0.0 && scale < 1.0) {
            return Err(bad(format!("scale {scale} at byte {at}, expected a number between 0 and 1")));
        }
        let steps = self.take(2 * count)?.chunks_exact(2).map(|b| i16::from_le_bytes([b[0], b[1]]));
        Ok(Quantised { scale, steps: steps.collect() })
    }
}
