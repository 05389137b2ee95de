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

/// Finds the database poses from which the session may have started (method §2, mend 8): those whose control points
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
    let last = offsets.iter().copied().max().unwrap_or(0);
    let mut all = Vec::new();
    for (index, clip) in database.clips().iter().enumerate() {
        let unlike = skeleton_weight * table.unlikeness(index) / 100.0;
        let end = (clip.first_pose + clip.num_poses).saturating_sub(last);
        for pose in clip.first_pose + history..end {
            if exclude.iter().any(|r| r.contains(&pose)) {
                continue;
            }
            if let Some(start) = fit(table, pose, offsets, observed) {
                all.push(StartPose { distance: start.distance.hypot(unlike), ..start });
            }
        }
    }
    all.sort_by(|a, b| a.distance.total_cmp(&b.distance).then(a.pose.cmp(&b.pose)));
    let mut chosen: Vec<StartPose> = Vec::new();
    for start in all {
        if chosen.len() == count {
            break;
        }
        let is_distinct = |c: &StartPose| {
            c.pose.abs_diff(start.pose) > DISTINCT_FRAMES
                || database.clip_of(c.pose) != database.clip_of(start.pose)
        };
        if chosen.iter().all(is_distinct) {
            chosen.push(start);
        }
    }
    chosen
}

/// Best turn and shift of one pose: Procrustes in the plane, heights compared as they are.
pub(crate) fn fit(
    table: &ControlTable,
    pose: usize,
    offsets: &[usize],
    observed: &[Option<Vector3<f64>>],
) -> Option<StartPose> {
    let points = table.num_points();
    let mut count = 0.0;
    let (mut mean_a, mut mean_b) = ([0.0; 2], [0.0; 2]);
    let (mut squares, mut dot, mut cross) = (0.0, 0.0, 0.0);
    for (step, &offset) in offsets.iter().enumerate() {
        for (point, a) in table.world(pose + offset).iter().enumerate() {
            let Some(b) = observed[step * points + point] else { continue };
            let (ax, ay, az) = (f64::from(a[0]), f64::from(a[1]), f64::from(a[2]));
            count += 1.0;
            mean_a[0] += ax;
            mean_a[1] += az;
            mean_b[0] += b.x;
            mean_b[1] += b.z;
            squares += ax * ax + az * az + b.x * b.x + b.z * b.z + (ay - b.y).powi(2);
            dot += ax * b.x + az * b.z;
            cross += az * b.x - ax * b.z;
        }
    }
    if count < 2.0 {
        return None;
    }
    for v in mean_a.iter_mut().chain(&mut mean_b) {
        *v /= count;
    }
    squares -= count * (mean_a[0].powi(2) + mean_a[1].powi(2) + mean_b[0].powi(2) + mean_b[1].powi(2));
    dot -= count * (mean_a[0] * mean_b[0] + mean_a[1] * mean_b[1]);
    cross -= count * (mean_a[1] * mean_b[0] - mean_a[0] * mean_b[1]);
    // world = R_y(turn) a + shift with R_y: x' = c x + s z, z' = −s x + c z.
    let turn = cross.atan2(dot);
    let (sin, cos) = turn.sin_cos();
    let error = (squares - 2.0 * dot.hypot(cross)).max(0.0);
    let shift =
        [mean_b[0] - cos * mean_a[0] - sin * mean_a[1], mean_b[1] + sin * mean_a[0] - cos * mean_a[1]];
    Some(StartPose { pose, turn, shift, distance: (error / count).sqrt() })
}
