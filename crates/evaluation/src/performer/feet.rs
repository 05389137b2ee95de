use std::ops::ControlFlow;

use contacts::{DetectSettings, Feet, HoldSettings, detect, hold_feet};
use kinematics::control_points;
use model::Motion;
use motion_db::{ClipInfo, MotionDatabase, WindowIndex};
use serde::Serialize;
use sparse::{Parameters, Reconstructor, Session};

use super::positions::{accelerations, mean_distance_cm};
use crate::{compare, control_trajectories};

/// A motion against the truth, its feet above all.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FootNumbers {
    /// root mean square error of the joint angles, degrees
    pub rms_deg: f64,
    /// mean distance of the joints from their true positions, centimetres
    pub mpjpe_cm: f64,
    /// speed over the floor of the points that stand in the true motion, centimetres a second
    pub slide_cm_s: f64,
    /// the same of the balls alone, by the reconstruction's own contacts
    pub own_slide_cm_s: f64,
    /// root mean square acceleration of the joints, metres a second squared
    pub acceleration: f64,
    /// largest acceleration of a joint, metres a second squared
    pub largest_acceleration: f64,
}

/// One trial: the truth, and what was found without and with feet held.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FeetResult {
    /// the true motion against itself: what recordings slide
    pub truth: FootNumbers,
    /// as reconstructed
    pub free: FootNumbers,
    /// with standing feet held
    pub held: FootNumbers,
    /// share of the true contacts' frames that lie in contacts that were found
    pub recall: f64,
    /// share of the found contacts' frames that lie in true ones
    pub precision: f64,
}

/// Reconstructs `truth` (60 frames a second) from its control points `names`, holds its feet, and compares. `None` if its
/// skeleton has no known feet or nothing stands.
///
/// # Errors
/// If it does not fit the database or cannot be reconstructed.
pub fn evaluate_feet(
    truth: &Motion,
    database: &MotionDatabase,
    index: &WindowIndex,
    is_excluded: impl Fn(&ClipInfo) -> bool,
    names: &[&str],
    parameters: &Parameters,
    settings: &HoldSettings,
) -> Result<Option<FeetResult>, sparse::Error> {
    let points = control_points(truth.skeleton(), names)?;
    let session = Session::new(truth.skeleton().clone(), points, &control_trajectories(truth, names)?)?;
    let mut reconstructor = Reconstructor::new(database, index, &session, parameters)?;
    reconstructor.exclude(is_excluded);
    let found = reconstructor.reconstruct(0..session.num_frames(), &mut |_| ControlFlow::Continue(()))?;
    let uncut = Parameters { chunk_frames: session.num_frames().max(60), ..parameters.clone() };
    let free = sparse::merge(database, &session, &uncut, std::slice::from_ref(&found))?.motion;
    let held = hold_feet(&free, database.parametrisation(), &session.points, &session.trajectories, settings);
    let (Ok(held), Ok(feet)) = (held, Feet::find(truth.skeleton())) else { return Ok(None) };
    let standing = detect(&feet.tracks(truth), &DetectSettings::default());
    let mut balls = held.contacts.clone();
    balls.retain(|c| c.point % 2 == 1);
    let numbers = |motion: &Motion| {
        let tracks = feet.tracks(motion);
        let (acceleration, largest_acceleration) = accelerations(motion);
        Some(FootNumbers {
            rms_deg: compare(truth, motion).rms_deg,
            mpjpe_cm: mean_distance_cm(truth, motion),
            slide_cm_s: tracks.slide_cm_s(&standing)?,
            own_slide_cm_s: tracks.slide_cm_s(&balls)?,
            acceleration,
            largest_acceleration,
        })
    };
    let (Some(truth), Some(free), Some(found)) = (numbers(truth), numbers(&free), numbers(&held.motion))
    else {
        return Ok(None);
    };
    let (mut both, mut true_frames, mut found_frames) = (0.0, 0.0f64, 0.0f64);
    for (t, f) in standing.feet().iter().zip(held.contacts.feet()) {
        for (t, f) in t.iter().zip(f) {
            both += f64::from(u8::from(*t && f));
            true_frames += f64::from(u8::from(*t));
            found_frames += f64::from(u8::from(f));
        }
    }
    let (recall, precision) = (both / true_frames.max(1.0), both / found_frames.max(1.0));
    Ok(Some(FeetResult { truth, free, held: found, recall, precision }))
}
