//! What was tracked, as bytes: what one job leaves for another.
//!
//! ```text
//! "MVTRK\x01"   dofs joints cameras frames (u32)   then for every frame:
//!     number (u64)  stage (u8)  misaligned limbs (u16, a bit each)  effective sample size (f64, NaN: none)
//!     pose [dofs]  joints [joints][3]  overlaps [cameras] (NaN: nobody seen)  errors of limbs [10]      (f64)
//! ```
//!
//! All numbers are little-endian.

use nalgebra::Vector3;

use crate::{Chunk, Error, LimbError, Misalignment, Result, Stage, Tracked};
use body::Limb;

const MAGIC: &[u8] = b"MVTRK\x01";
/// Bytes before the first frame.
const HEAD: usize = MAGIC.len() + 4 * 4;
/// Most DOFs, joints or cameras: far more than there are, and few enough to count with.
const MAX_COUNT: usize = 1 << 12;
const STAGES: [Stage; 4] = [Stage::Unseen, Stage::Local, Stage::Particles, Stage::Misaligned];
const LIMBS: usize = Limb::ALL.len();

/// How many numbers a frame has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Counts {
    dofs: usize,
    joints: usize,
    cameras: usize,
}

impl Counts {
    fn from_tracked(frame: &Tracked) -> Self {
        Self { dofs: frame.pose.len(), joints: frame.joints.len(), cameras: frame.ious.len() }
    }

    fn frame_bytes(self) -> usize {
        8 + 1 + 2 + 8 * (1 + self.dofs + 3 * self.joints + self.cameras + LIMBS)
    }
}

impl Chunk {
    /// As a file.
    ///
    /// # Errors
    /// [`Error::File`] if frames differ in their numbers of DOFs, joints or cameras.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let counts = self.frames.first().map_or(Counts::default(), Counts::from_tracked);
        let mut bytes = MAGIC.to_vec();
        bytes.reserve(HEAD + self.frames.len() * counts.frame_bytes());
        for count in [counts.dofs, counts.joints, counts.cameras, self.frames.len()] {
            let count = u32::try_from(count).map_err(|_| damaged(format!("{count} of something")))?;
            bytes.extend(count.to_le_bytes());
        }
        for frame in &self.frames {
            if Counts::from_tracked(frame) != counts {
                return Err(damaged(format!(
                    "frame {} has other cameras or joints than the first",
                    frame.frame
                )));
            }
            put(frame, &mut bytes);
        }
        Ok(bytes)
    }

    /// Reads what [`to_bytes`](Self::to_bytes) gave.
    ///
    /// # Errors
    /// [`Error::File`] if it is none, is cut off, or holds a pose that is not finite.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let rest = bytes.strip_prefix(MAGIC).ok_or_else(|| damaged("it begins otherwise".into()))?;
        let mut reader = Reader { rest };
        let counts: [usize; 4] = [reader.u32()?, reader.u32()?, reader.u32()?, reader.u32()?];
        let [dofs, joints, cameras, num_frames] = counts;
        if counts[..3].iter().any(|&count| count > MAX_COUNT) {
            return Err(damaged(format!("{dofs} DOFs, {joints} joints and {cameras} cameras")));
        }
        let counts = Counts { dofs, joints, cameras };
        let expected = num_frames.checked_mul(counts.frame_bytes());
        if expected != Some(reader.rest.len()) {
            return Err(damaged(format!("{} bytes of {num_frames} frames", reader.rest.len())));
        }
        let frames: Result<_> = (0..num_frames).map(|_| reader.frame(counts)).collect();
        Ok(Self { frames: frames? })
    }
}

fn damaged(what: String) -> Error {
    Error::File { found: what }
}

fn put(frame: &Tracked, bytes: &mut Vec<u8>) {
    bytes.extend((frame.frame as u64).to_le_bytes());
    bytes.push(STAGES.iter().position(|stage| *stage == frame.stage).unwrap_or_default() as u8);
    let limbs = &frame.misalignment.limbs;
    let bits = limbs.iter().enumerate().map(|(i, limb)| u16::from(limb.is_misaligned) << i);
    bytes.extend(bits.sum::<u16>().to_le_bytes());
    let coordinates = frame.joints.iter().flat_map(|joint| joint.iter().copied());
    let numbers = std::iter::once(frame.effective_sample_size.unwrap_or(f64::NAN))
        .chain(frame.pose.iter().copied())
        .chain(coordinates)
        .chain(frame.ious.iter().map(|iou| iou.unwrap_or(f64::NAN)))
        .chain(limbs.iter().map(|limb| limb.error_m));
    numbers.for_each(|number| bytes.extend(number.to_le_bytes()));
}

/// Reads forward.
struct Reader<'a> {
    rest: &'a [u8],
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let (taken, rest) = self.rest.split_first_chunk().ok_or_else(|| damaged("it ends early".into()))?;
        self.rest = rest;
        Ok(*taken)
    }

    fn u32(&mut self) -> Result<usize> {
        Ok(u32::from_le_bytes(self.take()?) as usize)
    }

    fn number(&mut self) -> Result<f64> {
        Ok(f64::from_le_bytes(self.take()?))
    }

    fn finite(&mut self) -> Result<f64> {
        let number = self.number()?;
        if number.is_finite() { Ok(number) } else { Err(damaged(format!("a pose with {number}"))) }
    }

    fn frame(&mut self, counts: Counts) -> Result<Tracked> {
        let frame = u64::from_le_bytes(self.take()?);
        let frame = usize::try_from(frame).map_err(|_| damaged(format!("frame {frame}")))?;
        let [stage] = self.take()?;
        let stage = *STAGES.get(usize::from(stage)).ok_or_else(|| damaged(format!("stage {stage}")))?;
        let bits = u16::from_le_bytes(self.take()?);
        let effective_sample_size = Some(self.number()?).filter(|size| size.is_finite());
        let pose: Result<Vec<f64>> = (0..counts.dofs).map(|_| self.finite()).collect();
        let mut joints = Vec::with_capacity(counts.joints);
        for _ in 0..counts.joints {
            joints.push(Vector3::new(self.finite()?, self.finite()?, self.finite()?));
        }
        let mut ious = Vec::with_capacity(counts.cameras);
        for _ in 0..counts.cameras {
            ious.push(Some(self.number()?).filter(|iou| iou.is_finite()));
        }
        let mut limbs = Limb::ALL.map(|limb| LimbError { limb, error_m: 0.0, is_misaligned: false });
        for (i, limb) in limbs.iter_mut().enumerate() {
            limb.error_m = self.finite()?;
            limb.is_misaligned = bits >> i & 1 == 1;
        }
        let misalignment = Misalignment { limbs };
        Ok(Tracked { frame, pose: pose?, joints, ious, misalignment, stage, effective_sample_size })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunk() -> Chunk {
        let frame = |frame: usize| Tracked {
            frame,
            pose: vec![0.25 * frame as f64; 22],
            joints: vec![Vector3::new(1.0, frame as f64, 3.0); 5],
            ious: vec![Some(0.75), None, Some(0.5)],
            misalignment: Misalignment::from_errors([0.001 * frame as f64; 10], 0.0015),
            stage: STAGES[frame % 4],
            effective_sample_size: (frame % 2 == 1).then_some(7.5),
        };
        Chunk { frames: (0..6).map(frame).collect() }
    }

    #[test]
    fn what_was_tracked_comes_back_from_its_file() {
        let bytes = chunk().to_bytes().unwrap();
        assert_eq!(Chunk::from_bytes(&bytes).unwrap(), chunk());
        let empty = Chunk { frames: Vec::new() };
        assert_eq!(Chunk::from_bytes(&empty.to_bytes().unwrap()).unwrap(), empty);
    }

    #[test]
    fn damaged_files_are_an_error_and_no_panic() {
        let bytes = chunk().to_bytes().unwrap();
        for end in 0..bytes.len() {
            assert!(Chunk::from_bytes(&bytes[..end]).is_err(), "cut after {end} bytes");
        }
        for at in 0..HEAD + 40 {
            let mut changed = bytes.clone();
            changed[at] ^= 0xff;
            // it may be other frames, but reading must end
            drop(Chunk::from_bytes(&changed));
        }
        let mut other = chunk();
        other.frames[3].ious.pop();
        assert!(other.to_bytes().unwrap_err().to_string().contains("frame 3"));
    }
}
