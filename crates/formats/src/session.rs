//! Files of a capture session: which reader they need, by what they are for and by their name.

use model::{Motion, PointTrajectories};

use crate::{
    BvhOptions, Error, PointsOptions, Read, Result, amc, archive, asf, bvh, c3d,
    extension::{endings, extension},
    points_csv, trc,
};

/// Frame rate of an AMC that does not state it when nothing else fits: CMU's, Hz.
const AMC_FRAME_RATE: f64 = 120.0;

/// What the files do not say of themselves.
#[derive(Debug, Clone, Copy, Default)]
pub struct Options {
    /// Of files of points.
    pub points: PointsOptions,
    /// Of BVH files.
    pub bvh: BvhOptions,
}

/// A format of measured points.
#[derive(Debug, Clone, Copy)]
pub struct PointsFormat {
    extension: &'static str,
    read: fn(&[u8], &PointsOptions) -> Result<Read<PointTrajectories>>,
}

/// All formats of measured points.
const POINTS: [PointsFormat; 3] = [
    PointsFormat { extension: "csv", read: points_csv::read_with },
    PointsFormat { extension: "trc", read: trc::read },
    PointsFormat { extension: "c3d", read: c3d::read },
];

impl PointsFormat {
    /// That of a file of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        let extension = extension(name);
        POINTS.into_iter().find(|format| format.extension == extension)
    }

    /// The extensions of all formats.
    pub(crate) fn extensions() -> [&'static str; POINTS.len()] {
        POINTS.map(|format| format.extension)
    }

    /// Reads the file, unpacked.
    ///
    /// # Errors
    /// Says where, what was found and what was expected.
    pub fn read(self, bytes: &[u8], options: &Options) -> Result<Read<PointTrajectories>> {
        (self.read)(bytes, &options.points)
    }
}

/// Largest file of points that [`read_points`] unpacks, bytes: two hours of 120 frames a second of 50 markers.
const MAX_POINTS_BYTES: u64 = 1 << 30;

/// The measured points of a file as it lies on a disk: the format is told by its name, and it is unpacked if that ends with
/// `.zst` or `.gz`.
///
/// # Errors
/// If it is of no such format by its name; as the readers else.
pub fn read_points(name: &str, bytes: &[u8], options: &Options) -> Result<Read<PointTrajectories>> {
    let format = PointsFormat::from_name(name).ok_or_else(|| {
        Error::whole_file(
            "a file of another kind",
            format!("{} by its name", endings(&PointsFormat::extensions())),
        )
    })?;
    match archive::unpacked(name, bytes, MAX_POINTS_BYTES)? {
        Some(unpacked) => format.read(&unpacked, options),
        None => format.read(bytes, options),
    }
}

/// A format of skeletons.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SkeletonFormat {
    /// Acclaim
    Asf,
    /// its hierarchy alone
    Bvh,
}

impl SkeletonFormat {
    /// All of them, with the extensions of their files.
    const ALL: [(Self, &str); 2] = [(Self::Asf, "asf"), (Self::Bvh, "bvh")];

    /// That of a file of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::from_extension(&extension(name))
    }

    /// That of a file with that extension, in upper or lower case.
    pub(crate) fn from_extension(extension: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|(_, own)| own.eq_ignore_ascii_case(extension)).map(|(format, _)| format)
    }

    /// The extensions of all formats.
    pub(crate) fn extensions() -> [&'static str; Self::ALL.len()] {
        Self::ALL.map(|(_, extension)| extension)
    }

    /// Reads the file, unpacked. A BVH, which says nothing of it, is taken to have the unit of the CMU library.
    ///
    /// # Errors
    /// Says where, what was found and what was expected.
    pub fn read(self, bytes: &[u8], options: &Options) -> Result<Read<asf::File>> {
        match self {
            Self::Asf => asf::read(bytes),
            Self::Bvh => {
                let Read { value, warnings } = bvh::read(bytes, &options.bvh)?;
                let skeleton = value.skeleton().clone();
                let value = asf::File { skeleton, metres_per_unit: asf::CMU_METRES_PER_UNIT };
                Ok(Read { value, warnings })
            }
        }
    }
}

/// A format of one motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MotionFormat {
    /// Acclaim; needs a skeleton beside it
    Amc,
    /// with its own skeleton
    Bvh,
}

impl MotionFormat {
    /// All of them, with the extensions of their files.
    const ALL: [(Self, &str); 2] = [(Self::Amc, "amc"), (Self::Bvh, "bvh")];

    /// That of a file of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::from_extension(&extension(name))
    }

    /// That of a file with that extension, in upper or lower case.
    pub(crate) fn from_extension(extension: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|(_, own)| own.eq_ignore_ascii_case(extension)).map(|(format, _)| format)
    }

    /// The extensions of all formats.
    pub(crate) fn extensions() -> [&'static str; Self::ALL.len()] {
        Self::ALL.map(|(_, extension)| extension)
    }

    /// Whether its files say what skeleton the motion is on; else that is in a file beside them.
    pub fn has_own_skeleton(self) -> bool {
        match self {
            Self::Amc => false,
            Self::Bvh => true,
        }
    }

    /// Reads the file, unpacked, of a motion with its own skeleton; `None` of one without.
    pub(crate) fn read_alone(self, bytes: &[u8], bvh: &BvhOptions) -> Option<Result<Read<Motion>>> {
        match self {
            Self::Amc => None,
            Self::Bvh => Some(bvh::read(bytes, bvh)),
        }
    }

    /// Reads the file, unpacked. An AMC is on `skeleton`; the frame rate of one that does not state it is that under which it
    /// takes about `seconds`.
    ///
    /// # Errors
    /// Says where, what was found and what was expected.
    pub fn read(
        self,
        bytes: &[u8],
        skeleton: &asf::File,
        seconds: f64,
        options: &Options,
    ) -> Result<Read<Motion>> {
        if let Some(read) = self.read_alone(bytes, &options.bvh) {
            return read;
        }
        let Read { value, warnings } = amc::read(bytes, skeleton, AMC_FRAME_RATE)?;
        let stated = amc::stated_frame_rate(bytes);
        let rate = stated.unwrap_or_else(|| amc_frame_rate(value.num_frames(), seconds));
        let value = Motion::new(skeleton.skeleton.clone(), rate, value.values().to_vec())?;
        Ok(Read { value, warnings })
    }
}

/// The usual rate under which so many frames take nearest to `seconds`, Hz; CMU's 120 where none comes near.
fn amc_frame_rate(frames: usize, seconds: f64) -> f64 {
    let off = |rate: &f64| (frames as f64 / rate / seconds.max(1e-9)).ln().abs();
    let best = [120.0, 60.0, 30.0, 240.0, 100.0].into_iter().min_by(|a, b| off(a).total_cmp(&off(b)));
    best.filter(|rate| off(rate) < 0.05).unwrap_or(AMC_FRAME_RATE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_of_an_amc_is_that_which_makes_it_as_long_as_the_session() {
        assert_eq!(amc_frame_rate(1200, 10.0), 120.0);
        assert_eq!(amc_frame_rate(601, 10.0), 60.0);
        assert_eq!(amc_frame_rate(5, 10.0), 120.0);
    }
}
