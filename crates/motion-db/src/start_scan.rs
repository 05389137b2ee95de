use std::ops::Range;

use nalgebra::Vector3;

use crate::start::{DISTINCT_FRAMES, Observation};
use crate::{ControlTable, MotionDatabase, StartPose};

/// Poses of a clip that are looked at in the first pass: every fourth. Neighbouring poses are nearly the same.
const STRIDE: usize = 4;
/// Best places that are kept and looked at closely.
const KEPT: usize = 32;

/// The search of [`crate::start_poses`] in slices, for those who may not stop to search: it finds the poses that a
/// person may be in *now*, given what was measured over the last frames.
///
/// Allocates nothing once made.
#[derive(Debug, Clone)]
pub struct StartScan {
    /// frames before the pose in its clip
    history: usize,
    skeleton_weight: f64,
    observation: Observation,
    /// frames from the oldest to the newest observed
    span: usize,
    clip: usize,
    pose: usize,
    /// best first; their `pose` is the one of the oldest frame observed
    best: Vec<StartPose>,
}

impl StartScan {
    /// Room for observations of `points` points over at most `frames` frames. `history`: frames that must come before a
    /// pose in its clip; `skeleton_weight`: as for [`crate::start_poses`].
    pub fn new(points: usize, frames: usize, history: usize, skeleton_weight: f64) -> Self {
        Self {
            history,
            skeleton_weight,
            observation: Observation::with_capacity(frames * points),
            span: 0,
            clip: 0,
            pose: 0,
            best: Vec::with_capacity(KEPT + 1),
        }
    }

    /// Begins anew with other observations.
    pub fn begin(&mut self) {
        self.best.clear();
        (self.clip, self.pose) = (0, 0);
        self.forget();
    }

    /// Forgets what was observed, not what was found.
    pub fn forget(&mut self) {
        self.observation.clear();
        self.span = 0;
    }

    /// Adds what was observed `offset` frames after the oldest frame observed, oldest first: positions (metres, world; NaN
    /// where not measured), shape `[points]`.
    pub fn observe(&mut self, offset: usize, positions: &[Vector3<f64>]) {
        self.observation.add(offset, positions.iter().map(|p| p.x.is_finite().then_some(*p)));
        self.span = offset;
    }

    /// Looks further, at most at about `work` samples (poses × frames × points); `true` when all was looked at.
    pub fn advance(
        &mut self,
        database: &MotionDatabase,
        table: &ControlTable,
        exclude: &[Range<usize>],
        work: usize,
    ) -> bool {
        if self.observation.len() < 2 {
            return true;
        }
        let mut left = (work / self.observation.len()).max(1);
        let clips = database.clips();
        while let Some(clip) = clips.get(self.clip) {
            let range = self.range(clip.first_pose..clip.first_pose + clip.num_poses);
            let unlike = self.unlikeness(table, self.clip);
            self.pose = self.pose.max(range.start);
            while self.pose < range.end {
                if left == 0 {
                    return false;
                }
                left -= 1;
                if !exclude.iter().any(|r| r.contains(&self.pose)) {
                    self.keep(table, self.pose, unlike);
                }
                self.pose += STRIDE;
            }
            self.clip += 1;
            self.pose = 0;
        }
        true
    }

    /// Fits the best places again to what is observed by now, `later` frames after the search began, and puts the poses in
    /// which the person then is, best first, into `out`: `pose` is the one that comes next, as [`crate::start_poses`] has it.
    pub fn finish(
        &mut self,
        database: &MotionDatabase,
        table: &ControlTable,
        exclude: &[Range<usize>],
        later: usize,
        out: &mut Vec<StartPose>,
    ) {
        let mut places = [0; KEPT];
        let count = self.best.len().min(KEPT);
        for (place, start) in places.iter_mut().zip(&self.best) {
            *place = start.pose;
        }
        self.best.clear();
        let count = if self.observation.len() < 2 { 0 } else { count };
        for &place in &places[..count] {
            let index = database.clip_at(place);
            let clip = &database.clips()[index];
            let range = self.range(clip.first_pose..clip.first_pose + clip.num_poses);
            let unlike = self.unlikeness(table, index);
            let near = (place + later).saturating_sub(STRIDE - 1)..place + later + STRIDE;
            for pose in near.filter(|p| range.contains(p)) {
                if !exclude.iter().any(|r| r.contains(&pose)) {
                    self.keep(table, pose, unlike);
                }
            }
        }
        let span = self.span();
        out.clear();
        out.extend(self.best.iter().map(|s| StartPose { pose: s.pose + span + 1, ..*s }));
    }

    /// Poses of a clip that can be that of the oldest frame observed.
    fn range(&self, clip: Range<usize>) -> Range<usize> {
        let span = self.span();
        let first = clip.start + self.history.saturating_sub(span + 1);
        first..clip.end.saturating_sub(span)
    }

    /// Frames from the oldest to the newest observed.
    pub fn span(&self) -> usize {
        self.span
    }

    /// What the unlikeness of a clip's skeleton adds to the squared distance, metres².
    fn unlikeness(&self, table: &ControlTable, clip: usize) -> f64 {
        (self.skeleton_weight * table.unlikeness(clip) / 100.0).powi(2)
    }

    /// Keeps a place if it is among the best and better than those beside it.
    fn keep(&mut self, table: &ControlTable, pose: usize, unlikeness: f64) {
        let distance = (self.observation.misfit(table, pose) + unlikeness).sqrt();
        let is_worse = |s: &StartPose| s.distance > distance;
        if self.best.len() == KEPT && !self.best.last().is_some_and(is_worse) {
            return;
        }
        if let Some(beside) = self.best.iter().position(|s| s.pose.abs_diff(pose) <= DISTINCT_FRAMES) {
            if !is_worse(&self.best[beside]) {
                return;
            }
            self.best.remove(beside);
        }
        let at = self.best.partition_point(|s| s.distance <= distance);
        self.best.insert(at, self.observation.place(table, pose, distance));
        self.best.truncate(KEPT);
    }
}
