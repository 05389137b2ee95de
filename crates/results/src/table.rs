//! The table of formats. One that every kind of run is to write is a row here, and nothing else.

use std::{borrow::Cow, sync::Arc};

use body::{BodyModel, Poses, Shape};
use formats::{
    amc, asf, bvh, c3d,
    media_type::{BINARY, CSV, GLB, TEXT},
    motion_csv, points_csv, trc,
};
use model::{Motion, PointTrajectories};
use queue::JobError;

use crate::{ResultFile, positions::positions_csv};

/// A kind of runs, as far as its files have names of their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kind(pub &'static str);

impl Kind {
    /// from control points and a motion database
    pub const SPARSE: Self = Self("sparse");
    /// by inverse kinematics
    pub const INVERSE_KINEMATICS: Self = Self("inverse-kinematics");
    /// a person followed by cameras
    pub const TRACKING: Self = Self("tracking");
    /// a person in the first frames of cameras
    pub const SHAPE: Self = Self("shape");
}

/// What the kinds of runs have in common when they are done. A format is written where there is what it is of.
pub trait Finished: Send + Sync + 'static {
    /// The kind.
    const KIND: Kind;

    /// Writes `quality.csv`, a row a frame, where frames can be told apart by how good they are.
    const QUALITY: Option<fn(&Self) -> String> = None;

    /// The body in its poses, where there is one.
    const BODY: Option<fn(&Self) -> Body<'_>> = None;

    /// The whole motion.
    fn motion(&self) -> &Motion;

    /// Centres of the joints, where the motion does not tell all of them: missing where nobody was found.
    fn joints(&self) -> Option<&PointTrajectories> {
        None
    }
}

/// A body in its poses.
#[derive(Debug)]
pub struct Body<'a> {
    /// the model that it is of
    pub model: &'a BodyModel,
    /// whose it is
    pub shape: &'a Shape,
    /// shape `[frames][dofs]`
    pub poses: Cow<'a, [Vec<f64>]>,
}

/// A format: how it is written, and what its file is called.
struct Format {
    name: Name,
    media_type: &'static str,
    content: Writer,
}

enum Name {
    /// the same for all kinds
    One(&'static str),
    /// the same for all kinds, but others for some; a kind that has none does not write it
    Except(&'static str, &'static [(Kind, Option<&'static str>)]),
    /// for some kinds alone
    Only(&'static [(Kind, &'static str)]),
}

impl Name {
    /// The name that a kind gives it, if it writes it.
    fn for_kind(&self, kind: Kind) -> Option<&'static str> {
        match *self {
            Self::One(name) => Some(name),
            Self::Except(name, others) => {
                others.iter().find(|(other, _)| *other == kind).map_or(Some(name), |(_, name)| *name)
            }
            Self::Only(names) => names.iter().find(|(other, _)| *other == kind).map(|(_, name)| *name),
        }
    }
}

enum Writer {
    Motion(fn(&Motion) -> String),
    /// given the file's name too
    Joints(fn(&str, &PointTrajectories) -> Vec<u8>),
    Quality,
    Body,
}

const FORMATS: [Format; 10] = [
    Format {
        name: Name::Except("motion.bvh", &[(Kind::SHAPE, Some("pose.bvh"))]),
        media_type: TEXT,
        content: Writer::Motion(bvh::write),
    },
    Format {
        name: Name::Only(&[(Kind::SPARSE, "motion.amc")]),
        media_type: TEXT,
        content: Writer::Motion(amc::write),
    },
    Format {
        name: Name::Only(&[(Kind::SPARSE, "skeleton.asf")]),
        media_type: TEXT,
        content: Writer::Motion(|motion| asf::write(motion.skeleton())),
    },
    Format {
        name: Name::Except("poses.csv", &[(Kind::SHAPE, None)]),
        media_type: CSV,
        content: Writer::Motion(motion_csv::write),
    },
    Format {
        name: Name::Only(&[(Kind::SPARSE, "positions.csv"), (Kind::INVERSE_KINEMATICS, "joints.csv")]),
        media_type: CSV,
        content: Writer::Motion(positions_csv),
    },
    Format {
        name: Name::One("joints.c3d"),
        media_type: BINARY,
        content: Writer::Joints(|_, joints| c3d::write(joints)),
    },
    Format {
        name: Name::One("joints.trc"),
        media_type: TEXT,
        content: Writer::Joints(|name, joints| trc::write(name, joints).into_bytes()),
    },
    Format {
        name: Name::One("joints.csv"),
        media_type: CSV,
        content: Writer::Joints(|_, joints| points_csv::write(joints).into_bytes()),
    },
    Format { name: Name::One("body.glb"), media_type: GLB, content: Writer::Body },
    Format { name: Name::One("quality.csv"), media_type: CSV, content: Writer::Quality },
];

/// The files of a finished run in all formats of its kind.
pub fn formats<F: Finished>(finished: &Arc<F>) -> Vec<ResultFile> {
    FORMATS.iter().filter_map(|format| file(format, finished.clone())).collect()
}

/// The file of a format, if this run has what it is of.
fn file<F: Finished>(format: &'static Format, finished: Arc<F>) -> Option<ResultFile> {
    let (name, media_type) = (format.name.for_kind(F::KIND)?, format.media_type);
    Some(match format.content {
        Writer::Motion(write) => ResultFile::new(name, media_type, move || {
            Ok::<_, JobError>(write(finished.motion()).into_bytes())
        }),
        Writer::Joints(write) => {
            finished.joints()?;
            ResultFile::new(name, media_type, move || {
                let joints = finished.joints().ok_or_else(|| JobError::retry("the joints are gone"))?;
                Ok::<_, JobError>(write(name, joints))
            })
        }
        Writer::Quality => {
            let write = F::QUALITY?;
            ResultFile::new(name, media_type, move || Ok::<_, JobError>(write(&finished).into_bytes()))
        }
        Writer::Body => {
            let body = F::BODY?;
            ResultFile::new(name, media_type, move || {
                let Body { model, shape, poses } = body(&finished);
                let poses = Poses { poses: &poses, frame_rate: finished.motion().frame_rate() };
                body::glb(model, shape, Some(poses)).map_err(JobError::bad_input)
            })
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_kind_writes_two_files_of_one_name() {
        for (kind, has_joints) in [
            (Kind::SPARSE, false),
            (Kind::INVERSE_KINEMATICS, false),
            (Kind::TRACKING, true),
            (Kind::SHAPE, false),
            (Kind("another"), true),
        ] {
            let written =
                FORMATS.iter().filter(|format| has_joints || !matches!(format.content, Writer::Joints(_)));
            let mut names: Vec<&str> = written.filter_map(|format| format.name.for_kind(kind)).collect();
            assert!(names.iter().any(|name| name.ends_with(".bvh")), "{kind:?}: {names:?}");
            names.sort_unstable();
            assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{kind:?}: {names:?}");
        }
    }
}
