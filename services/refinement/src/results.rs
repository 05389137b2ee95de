//! The files that people get of a person who was tracked.

use body::Poses;

use crate::{InputError, csv, finished::Finished};

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
