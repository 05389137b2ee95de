use kinematics::{Parametrisation, References};
use model::{Skeleton, SkeletonRecord};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use crate::{ClipInfo, Error, MotionDatabase, Result};

/// Version of the index file. A change of layout or meaning raises it.
pub const FORMAT_VERSION: u32 = 1;

const MAGIC: &[u8; 8] = b"MAREYMDB";
/// magic, version, length of the header
const FIXED: usize = 16;
/// coordinates begin at a multiple of this, so that a mapped file can be read in place
const ALIGNMENT: usize = 64;
const CHECKSUM: usize = 32;

/// The JSON header of the file.
#[derive(Serialize, Deserialize)]
struct Header {
    skeleton: SkeletonRecord,
    reference_rotations: Vec<[[f64; 3]; 3]>,
    reference_angles: Vec<f64>,
    leg_length_m: f64,
    clips: Vec<ClipRecord>,
}

#[derive(Serialize, Deserialize)]
struct ClipRecord {
    name: String,
    subject: String,
    action: String,
    num_poses: usize,
    proportions_m: Vec<f64>,
    zero_pose_rad: Vec<f32>,
}

impl MotionDatabase {
    /// The index file, little-endian:
    ///
    /// ```text
    /// 8 bytes  "MAREYMDB"
    /// u32      format version
    /// u32      length of the header
    /// header   JSON: skeleton, reference rotations, leg length, clips; zeros up to a multiple of 64
    /// f32      coordinates, [poses, dofs]
    /// 32 bytes BLAKE3 of everything before
    /// ```
    ///
    /// Equal databases give equal bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let header = Header {
            skeleton: SkeletonRecord::from(self.skeleton.as_ref()),
            reference_rotations: self.references.rotations.iter().map(|m| (*m).into()).collect(),
            reference_angles: self.references.angles.clone(),
            leg_length_m: self.leg_length,
            clips: self
                .clips
                .iter()
                .map(|c| ClipRecord {
                    name: c.name.clone(),
                    subject: c.subject.clone(),
                    action: c.action.clone(),
                    num_poses: c.num_poses,
                    proportions_m: c.proportions.clone(),
                    zero_pose_rad: c.zero_pose.clone(),
                })
                .collect(),
        };
        // A header of strings and finite numbers always is JSON.
        let header = serde_json::to_vec(&header).unwrap_or_default();
        let start = (FIXED + header.len()).next_multiple_of(ALIGNMENT);
        let mut bytes = Vec::with_capacity(start + 4 * self.coordinates.len() + CHECKSUM);
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(&FORMAT_VERSION.to_le_bytes());
        bytes.extend_from_slice(&(header.len() as u32).to_le_bytes());
        bytes.extend_from_slice(&header);
        bytes.resize(start, 0);
        for value in self.coordinates.iter() {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
        let checksum = blake3::hash(&bytes);
        bytes.extend_from_slice(checksum.as_bytes());
        bytes
    }

    /// Reads an index file; the whole of it is checked before anything is used.
    ///
    /// # Errors
    /// If the bytes are no index file, are of another version, were damaged, or contradict themselves.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let wrong = |found: &str, offset: usize, expected: &str| Error::File {
            found: found.to_owned(),
            offset,
            expected: expected.to_owned(),
        };
        if bytes.len() < FIXED + CHECKSUM || &bytes[..8] != MAGIC {
            return Err(wrong("other bytes", 0, "the letters MAREYMDB"));
        }
        let word = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
        let version = word(8);
        if version != FORMAT_VERSION {
            return Err(Error::Version { found: version, expected: FORMAT_VERSION });
        }
        let (content, checksum) = bytes.split_at(bytes.len() - CHECKSUM);
        let found = blake3::hash(content);
        if found.as_bytes() != checksum {
            let hex = |b: &[u8]| b.iter().map(|b| format!("{b:02x}")).collect::<String>();
            return Err(Error::Checksum { found: found.to_hex().to_string(), expected: hex(checksum) });
        }
        let header_len = word(12) as usize;
        let start = (FIXED + header_len).next_multiple_of(ALIGNMENT);
        if start > content.len() {
            return Err(wrong(
                &format!("a header of {header_len} bytes"),
                12,
                "one that ends within the file",
            ));
        }
        let header: Header = serde_json::from_slice(&content[FIXED..FIXED + header_len])
            .map_err(|e| wrong(&format!("a header that does not parse ({e})"), FIXED, "JSON"))?;
        Self::from_parts(header, &content[start..])
            .map_err(|found| wrong(&found, start, "a database that agrees with itself"))
    }

    fn from_parts(header: Header, data: &[u8]) -> std::result::Result<Self, String> {
        let skeleton = Skeleton::try_from(header.skeleton).map_err(|e| e.to_string())?;
        let references = References {
            rotations: header.reference_rotations.into_iter().map(Matrix3::from).collect(),
            angles: header.reference_angles,
        };
        let (rotations, angles) = (references.rotations.len(), references.angles.len());
        if rotations != skeleton.num_joints() || angles != skeleton.num_dofs() {
            return Err(format!("{rotations} reference rotations and {angles} angles for another skeleton"));
        }
        if !(header.leg_length_m.is_finite() && header.leg_length_m > 0.0) {
            return Err(format!("a leg length of {} m", header.leg_length_m));
        }
        let parametrisation = Parametrisation::smooth(&skeleton, &references).map_err(|e| e.to_string())?;
        let mut clips = Vec::with_capacity(header.clips.len());
        let mut first_pose = 0usize;
        for clip in header.clips {
            if clip.proportions_m.len() != 6 * skeleton.num_joints() {
                return Err(format!("{} proportions of clip {}", clip.proportions_m.len(), clip.name));
            }
            let zero_pose = &clip.zero_pose_rad;
            if !(zero_pose.is_empty() || zero_pose.len() == skeleton.num_dofs()) || !zero_pose.iter().all(|o| o.is_finite()) {
                return Err(format!("{} numbers for the zero pose of clip {}", zero_pose.len(), clip.name));
            }
            let next = first_pose.checked_add(clip.num_poses).ok_or("a number of poses past all bounds")?;
            clips.push(ClipInfo {
                name: clip.name,
                subject: clip.subject,
                action: clip.action,
                first_pose,
                num_poses: clip.num_poses,
                proportions: clip.proportions_m,
                zero_pose: clip.zero_pose_rad,
            });
            first_pose = next;
        }
        let expected = first_pose.checked_mul(4 * skeleton.num_dofs());
        if first_pose == 0 || expected != Some(data.len()) {
            return Err(format!("{} bytes of coordinates for {first_pose} poses", data.len()));
        }
        let coordinates: Vec<f32> = data.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        if let Some(bad) = coordinates.iter().position(|v| !v.is_finite()) {
            return Err(format!("coordinate {bad} is not finite"));
        }
        let leg_length = header.leg_length_m;
        Ok(Self {
            skeleton: skeleton.into(),
            references,
            parametrisation,
            leg_length,
            clips,
            coordinates: coordinates.into(),
        })
    }
}
