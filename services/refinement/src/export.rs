//! The files that people get of a person who was followed.

use model::{Motion, PointTrajectories};
use results::{Body, Kind};

use crate::{
    csv,
    finished::{Finished, poses},
};

impl results::Finished for Finished {
    const KIND: Kind = Kind::TRACKING;
    const QUALITY: Option<fn(&Self) -> String> = Some(csv::quality);
    const BODY: Option<fn(&Self) -> Body<'_>> = Some(|finished| Body {
        model: &finished.model,
        shape: &finished.shape,
        poses: poses(&finished.tracked).into(),
    });

    fn motion(&self) -> &Motion {
        &self.motion
    }

    fn joints(&self) -> Option<&PointTrajectories> {
        Some(&self.joints)
    }
}
