//! Standing feet, kept from sliding.

use contacts::{HoldSettings, hold_feet};
use motion_db::MotionDatabase;
use serde::Serialize;
use sparse::{Merged, Session};

/// A whole result: the motion, how well it is known, and what its feet do.
pub(crate) struct Finished {
    /// motion and quality
    pub merged: Merged,
    /// contacts, where feet were looked for and found
    pub feet: Option<FootFrames>,
}

/// The feet in every frame.
pub(crate) struct FootFrames {
    /// whether left and right stand, shape `[frames]`
    pub stand: Vec<[bool; 2]>,
    /// speed over the floor of the fastest standing point, centimetres a second, shape `[frames]`
    pub slides_cm_s: Vec<Option<f64>>,
    /// all frames together
    pub report: FootReport,
}

/// What holding the feet came to, for `run.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct FootReport {
    /// contacts of ankles and balls that were held
    contacts: usize,
    /// frames in which at least one foot stands
    frames_standing: usize,
    /// frames that were changed
    frames_changed: usize,
    /// mean speed over the floor of standing points before, centimetres a second
    slide_before_cm_s: Option<f64>,
    /// the same after
    slide_after_cm_s: Option<f64>,
}

/// Holds the feet of a merged motion. A skeleton without known feet stays as it is.
pub(crate) fn hold(database: &MotionDatabase, session: &Session, merged: Merged) -> Finished {
    let held = hold_feet(
        &merged.motion,
        database.parametrisation(),
        &session.points,
        &session.trajectories,
        &HoldSettings::default(),
    );
    let Ok(held) = held else { return Finished { merged, feet: None } };
    let stand = held.contacts.feet();
    let report = FootReport {
        contacts: held.contacts.all().len(),
        frames_standing: stand.iter().filter(|feet| feet.contains(&true)).count(),
        frames_changed: held.frames_changed,
        slide_before_cm_s: held.slide_before_cm_s,
        slide_after_cm_s: held.slide_after_cm_s,
    };
    let feet = FootFrames { stand, slides_cm_s: held.slides_cm_s, report };
    Finished { merged: Merged { motion: held.motion, ..merged }, feet: Some(feet) }
}
