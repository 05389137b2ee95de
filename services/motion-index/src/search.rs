//! The two searches, as plain functions on an index file.
//!
//! Distances depend on the poses and the question alone: what an index rounds, or finds in another order, because it
//! holds other clips beside, does not show. So the shards of a database answer as the whole does.

use crate::Error;
use kinematics::PointSet;
use model::{Motion, PointTrajectories};
use motion_db::{
    ControlTable, FRAME_RATE, MotionDatabase, Query, Scratch, SkeletonSize, WindowIndex, resample,
    start_poses,
};
use nalgebra::Vector3;

/// A pose that was found.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Match {
    /// Name of the clip.
    pub clip: String,
    /// Frame in the clip.
    pub frame: usize,
    /// Of windows: (degrees, centimetres). Of poses: root mean square, metres.
    pub distance: f64,
}

impl Match {
    /// A match that another replica found.
    pub fn from_wire(pose: Option<proto::v1::DatabasePose>, distance: f64) -> Self {
        let pose = pose.unwrap_or_default();
        Self { clip: pose.clip, frame: pose.frame as usize, distance }
    }
}

/// Which windows are like this one?
#[derive(Debug, Clone)]
pub(crate) struct WindowQuestion {
    values: Vec<f64>,
    dofs: usize,
    num_matches: usize,
}

impl WindowQuestion {
    /// `values`: channel values on the database's skeleton, oldest pose first, shape `[frames, dofs]`.
    pub fn new(values: Vec<f64>, dofs: usize, num_matches: usize) -> Self {
        Self { values, dofs, num_matches }
    }

    pub fn num_frames(&self) -> usize {
        self.values.len() / self.dofs.max(1)
    }
}

/// Which poses put their control points here?
#[derive(Debug, Clone)]
pub(crate) struct PointQuestion {
    points: PointTrajectories,
    num_matches: usize,
}

impl PointQuestion {
    /// `points`: one frame.
    pub fn new(points: PointTrajectories, num_matches: usize) -> Self {
        Self { points, num_matches }
    }

    pub fn names(&self) -> &[String] {
        self.points.names()
    }
}

/// Where some control points are in every pose of a database.
#[derive(Debug)]
pub(crate) struct PointTable(ControlTable);

impl PointTable {
    pub fn new(database: &MotionDatabase, names: &[String]) -> Result<Self, Error> {
        let skeleton = database.skeleton();
        let kinematics = database.kinematics(skeleton);
        let points = PointSet::new(&kinematics, kinematics::control_points(skeleton, names)?);
        let shortest = WindowIndex::new(database, 1)?;
        Ok(Self(ControlTable::new(database, &shortest, skeleton, &kinematics, &points, &[], &[])))
    }
}

/// Memory of the index of windows of `window` frames, bytes.
pub(crate) fn window_bytes(database: &MotionDatabase, window: usize) -> u64 {
    let prefix = 16;
    let numbers = database.num_poses() * (window * database.num_dofs() + prefix + 1);
    (numbers * size_of::<f32>()) as u64
}

/// Memory of the table of `points` points, bytes.
pub(crate) fn table_bytes(database: &MotionDatabase, points: usize) -> u64 {
    (database.num_poses() * points * 2 * 3 * size_of::<f32>()) as u64
}

/// Matches that are sought beyond those asked for: windows whose distances are so alike that the rounding of an index
/// may have exchanged them.
const MARGIN: usize = 16;

/// Whether no clip of the database has a window of `frames` frames and a pose after it.
pub(crate) fn is_too_short(database: &MotionDatabase, frames: usize) -> bool {
    database.clips().iter().all(|clip| clip.num_poses <= frames)
}

/// The windows nearest to the question, nearest first; a match is the newest pose of its window.
///
/// # Errors
/// If the window is no motion of the database's skeleton.
pub(crate) fn nearest_windows(
    database: &MotionDatabase,
    index: &WindowIndex,
    question: &WindowQuestion,
) -> Result<Vec<Match>, Error> {
    let coordinates = coordinates(database, &question.values)?;
    let newest_first: Vec<&[f64]> = coordinates.chunks_exact(question.dofs).rev().collect();
    let mut scratch = vec![0.0; index.width()];
    let mut features = vec![0.0; index.width()];
    index.query_features(&newest_first, &mut scratch, &mut features);
    let rotated: Vec<f32> = features.iter().map(|v| *v as f32).collect();
    let query = Query { features: &rotated, controls: None, exclude: &[], hints: &[] };
    let mut found = Vec::new();
    index.nearest(&query, question.num_matches + MARGIN, &mut Scratch::default(), &mut found);
    index.scale().window_features(&newest_first, &mut features);
    let mut exact: Vec<(f64, usize)> = found
        .iter()
        .map(|n| {
            let newest = index.target(n.row) - 1;
            (distance(database, index, newest, &features, &mut scratch), newest)
        })
        .collect();
    exact.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    exact.truncate(question.num_matches);
    Ok(exact.into_iter().map(|(distance, newest)| at(database, newest, distance)).collect())
}

/// Distance of the window that ends with pose `newest` from one of these features, (degrees, centimetres).
fn distance(
    database: &MotionDatabase,
    index: &WindowIndex,
    newest: usize,
    features: &[f64],
    scratch: &mut [f64],
) -> f64 {
    let dofs = database.num_dofs();
    let mut poses = vec![0.0; index.window() * dofs];
    for (i, pose) in poses.chunks_exact_mut(dofs).enumerate() {
        database.copy_pose(newest - i, pose);
    }
    let newest_first: Vec<&[f64]> = poses.chunks_exact(dofs).collect();
    index.scale().window_features(&newest_first, scratch);
    scratch.iter().zip(features).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// The poses whose control points fit best, best first.
pub(crate) fn nearest_poses(
    database: &MotionDatabase,
    table: &PointTable,
    question: &PointQuestion,
) -> Vec<Match> {
    let frame = question.points.frame(0);
    let observed: Vec<Option<Vector3<f64>>> = frame.iter().map(|p| p.x.is_finite().then_some(*p)).collect();
    let found = start_poses(database, &table.0, &[0], &observed, 0, 0.0, &[], question.num_matches);
    found.iter().map(|s| at(database, s.pose, s.distance)).collect()
}

/// Smooth coordinates of consecutive channel poses, translations in the database's scale.
fn coordinates(database: &MotionDatabase, values: &[f64]) -> Result<Vec<f64>, Error> {
    let skeleton = database.skeleton();
    let scale = database.leg_length() / SkeletonSize::leg_length(skeleton);
    let motion = Motion::new(skeleton.clone(), FRAME_RATE, values.to_vec())?;
    let mut all = resample(&motion, database.parametrisation());
    for pose in all.chunks_exact_mut(database.num_dofs()) {
        pose[..3].iter_mut().for_each(|v| *v *= scale);
    }
    Ok(all)
}

fn at(database: &MotionDatabase, pose: usize, distance: f64) -> Match {
    let clip = &database.clips()[database.clip_at(pose)];
    Match { clip: clip.name.clone(), frame: pose - clip.first_pose, distance }
}
