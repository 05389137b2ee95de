//! The files that people get of a person who was followed.

use std::sync::Arc;

use body::{BodyModel, Poses, Shape};
use model::{Motion, PointTrajectories};
use nalgebra::Vector3;
use tracking::{Chunk, Stage};

use crate::{InputError, csv, report::Meeting};

/// A session that was followed from its first to its last frame.
#[derive(Debug)]
pub(crate) struct Finished {
    pub model: Arc<BodyModel>,
    pub shape: Shape,
    /// all frames
    pub tracked: Chunk,
    /// where its chunks meet
    pub meetings: Vec<Meeting>,
    /// names, in the order of the overlaps
    pub cameras: Vec<String>,
    /// frames a second
    pub frame_rate: f64,
}

impl Finished {
    fn poses(&self) -> Vec<Vec<f64>> {
        self.tracked.frames.iter().map(|tracked| tracked.pose.clone()).collect()
    }

    fn motion(&self) -> Result<Motion, InputError> {
        Ok(self.model.motion(&self.shape, &self.poses(), self.frame_rate)?)
    }

    /// Centres of the joints; missing where nobody was found.
    fn joints(&self) -> Result<PointTrajectories, InputError> {
        let names = self.model.rig().joints().iter().map(|joint| joint.name.clone()).collect();
        let positions = self.tracked.frames.iter().flat_map(|tracked| {
            let is_seen = tracked.stage != Stage::Unseen;
            tracked.joints.iter().map(move |joint| if is_seen { *joint } else { Vector3::repeat(f64::NAN) })
        });
        Ok(PointTrajectories::new(names, self.frame_rate, positions.collect())?)
    }
}

/// A result's name, its media type, and how it is written.
pub(crate) struct Export {
    /// Name of the file.
    pub name: &'static str,
    /// Its media type.
    pub media_type: &'static str,
    /// Makes the content.
    pub write: fn(&Finished) -> Result<Vec<u8>, InputError>,
}

const TEXT: &str = "text/plain; charset=utf-8";
const CSV: &str = "text/csv; charset=utf-8";

/// All of them, made one after the other so that only one is in memory at a time.
pub(crate) const EXPORTS: [Export; 7] = [
    Export {
        name: "motion.bvh",
        media_type: TEXT,
        write: |finished| Ok(formats::bvh::write(&finished.motion()?).into_bytes()),
    },
    Export {
        name: "body.glb",
        media_type: "model/gltf-binary",
        write: |finished| {
            let poses = finished.poses();
            let poses = Poses { poses: &poses, frame_rate: finished.frame_rate };
            Ok(body::glb(&finished.model, &finished.shape, Some(poses))?)
        },
    },
    Export {
        name: "joints.c3d",
        media_type: "application/octet-stream",
        write: |finished| Ok(formats::c3d::write(&finished.joints()?)),
    },
    Export {
        name: "joints.trc",
        media_type: TEXT,
        write: |finished| Ok(formats::trc::write("joints.trc", &finished.joints()?).into_bytes()),
    },
    Export {
        name: "joints.csv",
        media_type: CSV,
        write: |finished| Ok(formats::points_csv::write(&finished.joints()?).into_bytes()),
    },
    Export {
        name: "poses.csv",
        media_type: CSV,
        write: |finished| Ok(formats::motion_csv::write(&finished.motion()?).into_bytes()),
    },
    Export {
        name: "quality.csv",
        media_type: CSV,
        write: |finished| Ok(csv::quality(finished).into_bytes()),
    },
];
