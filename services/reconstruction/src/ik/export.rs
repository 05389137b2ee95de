//! The files that people get of a session that was solved.

use std::sync::Arc;

use queue::JobError;
use results::{ResultFile, formats, media_type::CSV};

use super::{finished::Finished, report::quality_csv};

/// The motion in every format, and how well each frame is solved.
pub(super) fn files(finished: &Arc<Finished>) -> Vec<ResultFile> {
    let mut files = formats(finished);
    let finished = finished.clone();
    files.push(ResultFile::new("quality.csv", CSV, move || {
        let Finished { solved, measured, frame_rate, .. } = &*finished;
        Ok::<_, JobError>(quality_csv(solved, measured, *frame_rate).into_bytes())
    }));
    files
}
