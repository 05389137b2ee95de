//! Files of a capture session: which reader they need, by what they are for and by their name.

use model::PointTrajectories;

use crate::{BvhOptions, PointsOptions, Read, Result, asf, bvh, c3d, extension::extension, points_csv, trc};

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

    /// Reads the file, unpacked.
    ///
    /// # Errors
    /// Says where, what was found and what was expected.
    pub fn read(self, bytes: &[u8], options: &Options) -> Result<Read<PointTrajectories>> {
        (self.read)(bytes, &options.points)
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
    /// That of a file of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        match extension(name).as_str() {
            "asf" => Some(Self::Asf),
            "bvh" => Some(Self::Bvh),
            _ => None,
        }
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
    /// That of a file of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        match extension(name).as_str() {
            "amc" => Some(Self::Amc),
            "bvh" => Some(Self::Bvh),
            _ => None,
        }
    }
}
