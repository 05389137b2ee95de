//! The files that people get of a session that was solved.

use model::Motion;
use results::Kind;

use super::{finished::Finished, report::quality_csv};

impl results::Finished for Finished {
    const KIND: Kind = Kind::INVERSE_KINEMATICS;
    const QUALITY: Option<fn(&Self) -> String> =
        Some(|finished| quality_csv(&finished.solved, &finished.measured, finished.frame_rate));

    fn motion(&self) -> &Motion {
        &self.motion
    }
}
