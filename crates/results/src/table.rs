//! The table of formats. One that every kind of run is to write is a row here, and nothing else.

use std::sync::Arc;

use formats::{amc, asf, bvh, c3d, motion_csv, points_csv, trc};
use model::{Motion, PointTrajectories};
use queue::JobError;

use crate::{
    ResultFile,
    media_type::{BINARY, CSV, TEXT},
    positions::positions_csv,
};

/// The kinds of runs, as far as their files differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// from control points and a motion database
    Sparse,
    /// by inverse kinematics
    InverseKinematics,
    /// a person followed by cameras
    Tracking,
    /// a person in the first frames of cameras
    Shape,
}

/// What all kinds of runs have in common when they are done.
pub trait Finished: Send + Sync + 'static {
    /// The kind.
    const KIND: Kind;

    /// The whole motion.
    fn motion(&self) -> &Motion;

    /// Centres of the joints, where the motion does not tell all of them: missing where nobody was found.
    fn joints(&self) -> Option<&PointTrajectories> {
        None
    }
}

/// A format: how it is written, and what its file is called by kind of run; kinds that are not named don't write it.
struct Format {
    names: &'static [(Kind, &'static str)],
    media_type: &'static str,
    content: Writer,
}

enum Writer {
    Motion(fn(&Motion) -> String),
    /// given the file's name too
    Joints(fn(&str, &PointTrajectories) -> Vec<u8>),
}

use Kind::{InverseKinematics, Shape, Sparse, Tracking};

const FORMATS: [Format; 8] = [
    Format {
        names: &[
            (Sparse, "motion.bvh"),
            (InverseKinematics, "motion.bvh"),
            (Tracking, "motion.bvh"),
            (Shape, "pose.bvh"),
        ],
        media_type: TEXT,
        content: Writer::Motion(bvh::write),
    },
    Format { names: &[(Sparse, "motion.amc")], media_type: TEXT, content: Writer::Motion(amc::write) },
    Format {
        names: &[(Sparse, "skeleton.asf")],
        media_type: TEXT,
        content: Writer::Motion(|motion| asf::write(motion.skeleton())),
    },
    Format {
        names: &[(Sparse, "poses.csv"), (InverseKinematics, "poses.csv"), (Tracking, "poses.csv")],
        media_type: CSV,
        content: Writer::Motion(motion_csv::write),
    },
    Format {
        names: &[(Sparse, "positions.csv"), (InverseKinematics, "joints.csv")],
        media_type: CSV,
        content: Writer::Motion(positions_csv),
    },
    Format {
        names: &[(Tracking, "joints.c3d")],
        media_type: BINARY,
        content: Writer::Joints(|_, joints| c3d::write(joints)),
    },
    Format {
        names: &[(Tracking, "joints.trc")],
        media_type: TEXT,
        content: Writer::Joints(|name, joints| trc::write(name, joints).into_bytes()),
    },
    Format {
        names: &[(Tracking, "joints.csv")],
        media_type: CSV,
        content: Writer::Joints(|_, joints| points_csv::write(joints).into_bytes()),
    },
];

/// The files of a finished run in all formats of its kind.
pub fn formats<F: Finished>(finished: &Arc<F>) -> Vec<ResultFile> {
    let file = |format: &'static Format| {
        let (_, name) = *format.names.iter().find(|(kind, _)| *kind == F::KIND)?;
        let finished = finished.clone();
        Some(ResultFile::new(name, format.media_type, move || match (&format.content, finished.joints()) {
            (Writer::Motion(write), _) => Ok(write(finished.motion()).into_bytes()),
            (Writer::Joints(write), Some(joints)) => Ok(write(name, joints)),
            (Writer::Joints(_), None) => Err(JobError::retry(format!("{name} needs joints, there are none"))),
        }))
    };
    FORMATS.iter().filter_map(file).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_kind_writes_two_files_of_one_name() {
        for kind in [Sparse, InverseKinematics, Tracking, Shape] {
            let names = FORMATS.iter().flat_map(|format| format.names);
            let mut names: Vec<&str> = names.filter(|(k, _)| *k == kind).map(|(_, name)| *name).collect();
            assert!(!names.is_empty(), "{kind:?}");
            names.sort_unstable();
            assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{kind:?}: {names:?}");
        }
    }
}
