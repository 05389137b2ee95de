use kinematics::{Kinematics, PointSet};
use model::Skeleton;
use nalgebra::Vector3;

use crate::blocks::Blocks;
use crate::database::proportions;
use crate::segments::Segments;
use crate::{ClipInfo, HeadingFrame, MotionDatabase, SkeletonSize, WindowIndex};

/// Where a session's control points would be in every pose of a database, on the performer's own skeleton; and how
/// unlike that skeleton each clip's is.
///
/// Recordings differ in their zero pose from one performer and calibration to the next by more than windows of motion
/// differ (docs/papers.md#zero-poses). A performer's skeleton tells which clips are their own.
#[derive(Debug, Clone)]
pub struct ControlTable {
    points: usize,
    /// distance of each clip's skeleton from the performer's, centimetres, shape `[clips]`
    unlikeness: Vec<f64>,
    /// shape `[poses, points]`, metres, where the pose was recorded
    world: Vec<[f32; 3]>,
    /// of each window's target pose, relative to the heading frame before it, centimetres, and last the unlikeness of
    /// its clip, `[rows, 3·points·(1 + frames around) + 1]`
    pub(crate) relative: Blocks,
    /// means of `relative` over the rows of each segment of the index, shape `[segments, 3·points + 1]`
    by_segment: Vec<f32>,
    /// means of those over the segments of each list, and the least unlikeness, shape `[lists, 3·points + 1]`
    by_list: Vec<f32>,
}

fn segment_controls(relative: &Blocks, segments: &Segments, num_rows: usize) -> Vec<f32> {
    let dims = relative.dims();
    let mut means = vec![0.0; segments.len() * dims];
    let mut row_numbers = vec![0.0; dims];
    for (segment, mean) in means.chunks_exact_mut(dims).enumerate() {
        let rows = segments.rows(segment, num_rows);
        let share = 1.0 / rows.len().max(1) as f64;
        for row in rows {
            relative.copy_row(row, &mut row_numbers);
            mean.iter_mut().zip(&row_numbers).for_each(|(mean, v)| *mean += (share * v) as f32);
        }
    }
    means
}

fn list_controls(by_segment: &[f32], dims: usize, segments: &Segments) -> Vec<f32> {
    let mut means = vec![0.0; segments.lists.len() * dims];
    for (list, mean) in means.chunks_exact_mut(dims).enumerate() {
        let range = segments.lists.segments(list);
        let share = 1.0 / range.len().max(1) as f32;
        let mut least = f32::INFINITY;
        for numbers in range.map(|s| &by_segment[s * dims..][..dims]) {
            mean.iter_mut().zip(numbers).for_each(|(mean, v)| *mean += share * v);
            least = least.min(numbers[dims - 1]);
        }
        // A list may hold recordings of many performers: the performer's own are not to be missed.
        mean[dims - 1] = if least.is_finite() { least } else { 0.0 };
    }
    means
}

/// In four lanes, so that it is vectorised; the order of the sum is fixed.
#[inline(always)]
fn weighted_distance(a: &[f32], b: &[f32], weights: &[f32]) -> f32 {
    let a = &a[..b.len()];
    let mut lanes = [0.0; 4];
    let (a4, a_rest) = a.as_chunks::<4>();
    let (b4, b_rest) = b.as_chunks::<4>();
    let (w4, w_rest) = weights.as_chunks::<4>();
    for ((a, b), w) in a4.iter().zip(b4).zip(w4) {
        for i in 0..4 {
            lanes[i] += w[i] * (a[i] - b[i]) * (a[i] - b[i]);
        }
    }
    let rest: f32 = a_rest.iter().zip(b_rest).zip(w_rest).map(|((a, b), w)| w * (a - b) * (a - b)).sum();
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + rest
}

impl ControlTable {
    /// Forward kinematics of all poses. `kinematics`, `skeleton` and `zero_pose` (radians, shape `[dofs]`) are the
    /// performer's. With frames `around`, what a window has of the points is followed by where they are so many frames
    /// after its target (before, if negative; a clip's first and last poses stand for what it does not have).
    pub fn new(
        database: &MotionDatabase,
        index: &WindowIndex,
        skeleton: &Skeleton,
        kinematics: &Kinematics,
        points: &PointSet,
        zero_pose: &[f64],
        around: &[i32],
    ) -> Self {
        let scale = SkeletonSize::leg_length(skeleton) / database.leg_length();
        let offset = skeleton.joints()[0].offset;
        let mut state = kinematics.state();
        let mut pose = vec![0.0; database.num_dofs()];
        let mut found = vec![Vector3::zeros(); points.len()];
        let mut world = Vec::with_capacity(database.num_poses() * points.len());
        let mut frames = Vec::with_capacity(database.num_poses());
        for p in 0..database.num_poses() {
            database.copy_pose(p, &mut pose);
            pose[..3].iter_mut().for_each(|v| *v *= scale);
            pose.iter_mut().zip(zero_pose).for_each(|(v, o)| *v += o);
            frames.push(HeadingFrame::new(pose[0] + offset.x, pose[2] + offset.z, pose[kinematics::HEADING]));
            points.positions(kinematics, &pose, &mut state, &mut found);
            world.extend(found.iter().map(|p| [p.x as f32, p.y as f32, p.z as f32]));
        }
        let num_points = points.len();
        let own = proportions(skeleton);
        let distance = |clip: &ClipInfo| {
            let squares: f64 = own.iter().zip(&clip.proportions).map(|(a, b)| (a - b).powi(2)).sum();
            squares.sqrt() * 100.0
        };
        let unlikeness: Vec<f64> = database.clips().iter().map(distance).collect();
        let width = 3 * num_points * (1 + around.len());
        let relative = Blocks::new(index.num_rows(), width + 1, |row, out| {
            let target = index.target(row);
            let number = database.clip_at(target);
            out[width] = unlikeness[number] as f32;
            let clip = &database.clips()[number];
            let last = clip.first_pose + clip.num_poses - 1;
            let frames_away = std::iter::once(0).chain(around.iter().copied());
            for (away, out) in frames_away.zip(out.chunks_exact_mut(3 * num_points)) {
                let pose = target.saturating_add_signed(away as isize).clamp(clip.first_pose, last);
                for (point, out) in out.chunks_exact_mut(3).enumerate() {
                    let p = world[pose * num_points + point].map(f64::from);
                    let local = frames[target - 1].local_from_world(&Vector3::from(p)) * 100.0;
                    out.copy_from_slice(&[local.x as f32, local.y as f32, local.z as f32]);
                }
            }
        });
        let (by_segment, by_list) = index.segments.as_ref().map_or_else(Default::default, |segments| {
            let by_segment = segment_controls(&relative, segments, index.num_rows());
            let by_list = list_controls(&by_segment, relative.dims(), segments);
            (by_segment, by_list)
        });
        Self { points: num_points, unlikeness, world, relative, by_segment, by_list }
    }

    /// Squared, weighted distance of `controls` from the middle of a segment's.
    #[inline(always)]
    pub(crate) fn segment_distance(&self, segment: usize, controls: &[f32], weights: &[f32]) -> f32 {
        weighted_distance(&self.by_segment[segment * self.relative.dims()..], controls, weights)
    }

    /// Squared, weighted distance of `controls` from the middle of a list's.
    #[inline(always)]
    pub(crate) fn list_distance(&self, list: usize, controls: &[f32], weights: &[f32]) -> f32 {
        weighted_distance(&self.by_list[list * self.relative.dims()..], controls, weights)
    }

    /// Number of points P.
    pub fn num_points(&self) -> usize {
        self.points
    }

    /// Distance of a clip's skeleton from the performer's: root of the summed squares of all offsets, centimetres.
    pub fn unlikeness(&self, clip: usize) -> f64 {
        self.unlikeness[clip]
    }

    /// World positions of the points in a recorded pose, metres, shape `[points]`.
    pub fn world(&self, pose: usize) -> &[[f32; 3]] {
        &self.world[pose * self.points..(pose + 1) * self.points]
    }

    /// Positions of the points in a window's target pose, relative to the heading frame of the window's newest pose,
    /// centimetres, then those in the frames around it, shape `[3·points·(1 + frames around)]`.
    pub fn copy_relative(&self, row: usize, out: &mut [f64]) {
        self.relative.copy_row(row, out);
    }
}
