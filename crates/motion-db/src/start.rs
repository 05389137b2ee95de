use std::ops::Range;

use nalgebra::Vector3;

use crate::{ControlTable, MotionDatabase};

/// A database pose put where the control points of a session begin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StartPose {
    /// the pose
    pub pose: usize,
    /// turn about y that brings the database's pose into the session, radians
    pub turn: f64,
    /// where the database's origin comes to lie, metres
    pub shift: [f64; 2],
    /// root mean square distance of the control points after that, metres, with the unlikeness of skeletons
    pub distance: f64,
}

/// Two starts of the same clip nearer than this (frames) are one.
pub(crate) const DISTINCT_FRAMES: usize = 6;

/// Where control points were over the frames of a start. Sums that do not depend on the database's poses are taken once.
#[derive(Debug, Clone, Default)]
pub(crate) struct Observation {
    samples: Vec<Sample>,
    /// sums of x and of z, metres
    sum: [f64; 2],
    /// sum of x² + z², metres²
    squares: f64,
}

/// One point that was measured in one frame.
#[derive(Debug, Clone, Copy)]
struct Sample {
    /// frames after the oldest one observed
    offset: usize,
    point: usize,
    /// metres, world
    position: [f64; 3],
}

/// Sums over the samples from which turn, shift and error follow, metres and metres².
struct Sums {
    own: [f64; 2],
    squares: f64,
    dot: f64,
    cross: f64,
}

impl Observation {
    /// Room for this many samples.
    pub fn with_capacity(samples: usize) -> Self {
        Self { samples: Vec::with_capacity(samples), ..Self::default() }
    }

    /// Forgets what was observed.
    pub fn clear(&mut self) {
        self.samples.clear();
        (self.sum, self.squares) = ([0.0; 2], 0.0);
    }

    /// Adds what was measured `offset` frames after the oldest frame; `None` where nothing was. Shape `[points]`.
    pub fn add(&mut self, offset: usize, positions: impl Iterator<Item = Option<Vector3<f64>>>) {
        for (point, position) in positions.enumerate() {
            let Some(p) = position else { continue };
            self.samples.push(Sample { offset, point, position: p.into() });
            self.sum[0] += p.x;
            self.sum[1] += p.z;
            self.squares += p.x * p.x + p.z * p.z;
        }
    }

    /// How many points were measured, summed over the frames.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    #[inline]
    fn sums(&self, table: &ControlTable, pose: usize) -> Sums {
        let mut sums = Sums { own: [0.0; 2], squares: 0.0, dot: 0.0, cross: 0.0 };
        for sample in &self.samples {
            let [ax, ay, az] = table.world(pose + sample.offset)[sample.point].map(f64::from);
            let [bx, by, bz] = sample.position;
            sums.own[0] += ax;
            sums.own[1] += az;
            sums.squares += ax * ax + az * az + (ay - by) * (ay - by);
            sums.dot += ax * bx + az * bz;
            sums.cross += az * bx - ax * bz;
        }
        let each = 1.0 / self.len() as f64;
        let [x, z] = sums.own;
        let [bx, bz] = self.sum;
        sums.squares += self.squares - each * (x * x + z * z + bx * bx + bz * bz);
        sums.dot -= each * (x * bx + z * bz);
        sums.cross -= each * (z * bx - x * bz);
        sums
    }

    /// Mean squared distance of the points of a pose from those observed, after the best turn about y and shift on the
    /// floor, metres²: Procrustes in the plane, heights compared as they are. Needs two samples.
    pub fn misfit(&self, table: &ControlTable, pose: usize) -> f64 {
        let sums = self.sums(table, pose);
        let both = (sums.dot * sums.dot + sums.cross * sums.cross).sqrt();
        (sums.squares - 2.0 * both).max(0.0) / self.len() as f64
    }

    /// The best turn and shift of a pose. `distance` is stated as it is given.
    pub fn place(&self, table: &ControlTable, pose: usize, distance: f64) -> StartPose {
        let sums = self.sums(table, pose);
        let each = 1.0 / self.len() as f64;
        // world = R_y(turn) a + shift with R_y: x' = c x + s z, z' = −s x + c z.
        let turn = sums.cross.atan2(sums.dot);
        let (sin, cos) = turn.sin_cos();
        let [x, z] = sums.own.map(|sum| sum * each);
        let shift = [self.sum[0] * each - cos * x - sin * z, self.sum[1] * each + sin * x - cos * z];
        StartPose { pose, turn, shift, distance }
    }
}

/// Finds the database poses from which the session may have started (docs/papers.md#start-poses): those whose control points
/// over the frames `offsets` fit the observed ones best, after the best turn about y and shift on the floor.
///
/// `observed`: world positions (metres), shape `[offsets, points]`, `None` where not measured; `history`: number of
/// frames that must come before the pose in its clip; `skeleton_weight`: metres that a metre of unlikeness between
/// skeletons counts for; `exclude`: ranges of poses not to be used, in rising order.
/// Best first, at most `count`, no two of one clip within 6 frames of each other.
#[expect(
    clippy::too_many_arguments,
    reason = "two data sets, one observation, three limits: each named above"
)]
pub fn start_poses(
    database: &MotionDatabase,
    table: &ControlTable,
    offsets: &[usize],
    observed: &[Option<Vector3<f64>>],
    history: usize,
    skeleton_weight: f64,
    exclude: &[Range<usize>],
    count: usize,
) -> Vec<StartPose> {
    let mut observation = Observation::with_capacity(observed.len());
    for (offset, positions) in offsets.iter().zip(observed.chunks(table.num_points())) {
        observation.add(*offset, positions.iter().copied());
    }
    if observation.len() < 2 {
        return Vec::new();
    }
    let last = offsets.iter().copied().max().unwrap_or(0);
    let mut all: Vec<(f64, usize)> = Vec::with_capacity(database.num_poses());
    for (index, clip) in database.clips().iter().enumerate() {
        let unlike = (skeleton_weight * table.unlikeness(index) / 100.0).powi(2);
        let end = (clip.first_pose + clip.num_poses).saturating_sub(last);
        let poses = (clip.first_pose + history..end).filter(|pose| !exclude.iter().any(|r| r.contains(pose)));
        all.extend(poses.map(|pose| (observation.misfit(table, pose) + unlike, pose)));
    }
    // Each pose chosen rules out a limited number of others: the rest need not be sorted.
    let enough = count * (2 * DISTINCT_FRAMES + 1);
    let best_first = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
    if enough < all.len() {
        all.select_nth_unstable_by(enough, best_first);
        all.truncate(enough);
    }
    all.sort_unstable_by(best_first);
    let mut chosen: Vec<StartPose> = Vec::with_capacity(count);
    for (squared, pose) in all {
        if chosen.len() == count {
            break;
        }
        let is_distinct = |c: &StartPose| {
            c.pose.abs_diff(pose) > DISTINCT_FRAMES || database.clip_at(c.pose) != database.clip_at(pose)
        };
        if chosen.iter().all(is_distinct) {
            chosen.push(observation.place(table, pose, squared.sqrt()));
        }
    }
    chosen
}
