//! A run of frames in which the person has to be found first, and found again when they were lost.

use std::{
    ops::Range,
    sync::atomic::{AtomicBool, Ordering},
};

use body::{BodyModel, Posed, Shape};
use model::{Camera, PointMatch, Silhouette};

use crate::{Chunk, Error, ObservedFrame, Stage, Tracked, Tracker};

/// Frames from one try to find the person to the next: a try takes as long as ten frames.
const RETRY: usize = 6;
/// A frame with misaligned limbs whose body covers less of the silhouettes lost the person.
const LOST: f64 = 0.6;

/// What was seen in a frame.
#[derive(Debug, Clone)]
pub struct Seen {
    /// every camera with its silhouette
    pub views: Vec<(Camera, Silhouette)>,
    /// points that each camera found again, in the order of the cameras; may be empty
    pub matches: Vec<Vec<PointMatch>>,
}

impl Seen {
    fn observed(&self, frame: usize) -> Result<ObservedFrame, Error> {
        let mut observed = ObservedFrame::new(frame, &self.views)?;
        for (camera, matches) in self.matches.iter().enumerate() {
            observed = observed.with_matches(camera, matches);
        }
        Ok(observed)
    }
}

/// Where frames come from, and how a person is found without a start.
pub struct Footage<S, F> {
    /// numbers of the frames
    pub frames: Range<usize>,
    /// what was seen in a frame; may be asked for the same frame again
    pub see: S,
    /// the pose in what cameras saw, shape `[dofs]`, as `shape_fit::fit_pose` finds it
    pub find: F,
}

/// Tracks a run of frames from the first in which the person is found: on from there, and back to the beginning. Where they
/// leave, or are lost, they are looked for again. Frames in which nobody was found are [`Stage::Unseen`] with the pose of a
/// frame near them, so that there is a result for each frame, whatever was seen. `each` is told how many frames are done.
///
/// # Errors
/// [`Error::View`] and [`Error::Stopped`] as from [`Tracker::track`], and those of `see`.
pub fn track_footage<S, F, E>(
    tracker: &mut Tracker<'_>,
    footage: Footage<S, F>,
    stop: &AtomicBool,
    mut each: impl FnMut(usize),
) -> Result<Chunk, E>
where
    S: FnMut(usize) -> Result<Seen, E>,
    F: FnMut(&[(Camera, Silhouette)]) -> Option<Vec<f64>>,
    E: From<Error>,
{
    let Footage { frames, mut see, mut find } = footage;
    let mut tracked: Vec<Tracked> = Vec::with_capacity(frames.len());
    // frames from here on wait for a pose; none do while the person is tracked
    let mut waiting = Some(frames.start);
    let mut next_try = frames.start;
    for frame in frames.clone() {
        each(frame - frames.start);
        let seen = see(frame)?;
        let observed = seen.observed(frame)?;
        if let Some(first) = waiting {
            let mut pose = None;
            if frame >= next_try && observed.num_views() > 1 {
                check(stop, frame)?;
                pose = find(&seen.views);
                next_try = frame + RETRY;
            }
            let Some(pose) = pose else { continue };
            tracker.restart(&pose)?;
            let back = backwards(tracker, first..frame, &mut see, stop)?;
            tracked.extend(back);
            tracker.restart(&pose)?;
            waiting = None;
        }
        let mut found = tracker.track(&observed, stop)?;
        if is_lost(&found) && frame >= next_try {
            next_try = frame + RETRY;
            check(stop, frame)?;
            if let Some(pose) = find(&seen.views) {
                tracker.restart(&pose)?;
                found = tracker.track(&observed, stop)?;
            }
        }
        if found.stage == Stage::Unseen {
            waiting = Some(frame + 1);
            next_try = frame + 1;
        }
        tracked.push(found);
    }
    if let Some(first) = waiting {
        for frame in first..frames.end {
            tracked.push(unseen(tracker, frame, &see(frame)?, stop)?);
        }
    }
    each(frames.len());
    Ok(Chunk { frames: tracked })
}

/// Tracks frames from the last to the first, as far as the person is there.
fn backwards<S, E>(
    tracker: &mut Tracker<'_>,
    frames: Range<usize>,
    see: &mut S,
    stop: &AtomicBool,
) -> Result<Vec<Tracked>, E>
where
    S: FnMut(usize) -> Result<Seen, E>,
    E: From<Error>,
{
    let mut tracked = Vec::with_capacity(frames.len());
    let mut is_gone = false;
    for frame in frames.rev() {
        let seen = see(frame)?;
        let found = if is_gone {
            unseen(tracker, frame, &seen, stop)?
        } else {
            let before = tracker.pose().to_vec();
            let found = tracker.track(&seen.observed(frame)?, stop)?;
            is_gone = is_lost(&found) || found.stage == Stage::Unseen;
            if is_gone {
                tracker.restart(&before)?;
                unseen(tracker, frame, &seen, stop)?
            } else {
                found
            }
        };
        tracked.push(found);
    }
    tracked.reverse();
    Ok(tracked)
}

fn check(stop: &AtomicBool, frame: usize) -> Result<(), Error> {
    if stop.load(Ordering::Relaxed) { Err(Error::Stopped { frame }) } else { Ok(()) }
}

fn is_lost(found: &Tracked) -> bool {
    found.stage == Stage::Misaligned && found.mean_iou() < LOST
}

/// A frame in which the person was not found, whatever is in the silhouettes.
fn unseen(tracker: &mut Tracker<'_>, frame: usize, seen: &Seen, stop: &AtomicBool) -> Result<Tracked, Error> {
    let empty: Vec<_> = seen
        .views
        .iter()
        .map(|(camera, silhouette)| {
            (camera.clone(), Silhouette::empty(silhouette.width(), silhouette.height()))
        })
        .collect();
    tracker.track(&ObservedFrame::new(frame, &empty)?, stop)
}

/// Gives frames in which no person was found the pose of the last frame in which one was; at the beginning, of the
/// one after. Returns how many there are.
pub fn hold_unseen(model: &BodyModel, shape: &Shape, frames: &mut [Tracked]) -> usize {
    let is_seen = |tracked: &Tracked| tracked.stage != Stage::Unseen;
    let Some(first) = frames.iter().find(|tracked| is_seen(tracked)) else { return frames.len() };
    let mut pose = first.pose.clone();
    let mut posed = Posed::default();
    let mut count = 0;
    for tracked in frames {
        if is_seen(tracked) {
            pose.clone_from(&tracked.pose);
        } else {
            shape.pose_joints(model, &pose, &mut posed);
            tracked.pose.clone_from(&pose);
            tracked.joints.clone_from(&posed.joints);
            count += 1;
        }
    }
    count
}
