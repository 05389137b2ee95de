//! The files that people get of a person who was followed.

use std::sync::Arc;

use body::Poses;
use queue::JobError;
use results::{
    ResultFile, formats,
    media_type::{CSV, GLB},
};

use crate::{InputError, csv, finished::Finished};

/// The motion in every format, the body, and how well each frame is known.
pub(crate) fn files(finished: &Arc<Finished>) -> Vec<ResultFile> {
    let mut files = formats(finished);
    let moving = finished.clone();
    files.push(ResultFile::new("body.glb", GLB, move || {
        let poses = moving.poses();
        let poses = Poses { poses: &poses, frame_rate: moving.frame_rate };
        Ok::<_, InputError>(body::glb(&moving.model, &moving.shape, Some(poses))?)
    }));
    let known = finished.clone();
    files.push(ResultFile::new("quality.csv", CSV, move || {
        Ok::<_, JobError>(csv::quality(&known).into_bytes())
    }));
    files
}
