use kinematics::{Kinematics, PointSet};
use model::Skeleton;
use nalgebra::Vector3;

use crate::search::Blocks;
use crate::{HeadingFrame, MotionDatabase, SkeletonSize, WindowIndex};

/// Where a session's control points would be in every pose of a database, on the performer's own skeleton.
#[derive(Debug, Clone)]
pub struct ControlTable {
    points: usize,
    /// shape `[poses, points]`, metres, where the pose was recorded
    world: Vec<[f32; 3]>,
    /// of each window's target pose, relative to the heading frame before it, centimetres, `[rows, 3·points]`
    pub(crate) relative: Blocks,
}

impl ControlTable {
    /// Forward kinematics of all poses. `kinematics` and `skeleton` are the performer's.
    pub fn new(
        database: &MotionDatabase,
        index: &WindowIndex,
        skeleton: &Skeleton,
        kinematics: &Kinematics,
        points: &PointSet,
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
            frames.push(HeadingFrame::new(pose[0] + offset.x, pose[2] + offset.z, pose[kinematics::HEADING]));
            points.positions(kinematics, &pose, &mut state, &mut found);
            world.extend(found.iter().map(|p| [p.x as f32, p.y as f32, p.z as f32]));
        }
        let num_points = points.len();
        let relative = Blocks::new(index.num_rows(), 3 * num_points, |row, out| {
            let target = index.target(row);
            for (point, out) in out.chunks_exact_mut(3).enumerate() {
                let p = world[target * num_points + point].map(f64::from);
                let local = frames[target - 1].local_from_world(&Vector3::from(p)) * 100.0;
                out.copy_from_slice(&[local.x as f32, local.y as f32, local.z as f32]);
            }
        });
        Self { points: num_points, world, relative }
    }

    /// Number of points P.
    pub fn num_points(&self) -> usize {
        self.points
    }

    /// World positions of the points in a recorded pose, metres, shape `[points]`.
    pub fn world(&self, pose: usize) -> &[[f32; 3]] {
        &self.world[pose * self.points..(pose + 1) * self.points]
    }

    /// Positions of the points in a window's target pose, relative to the heading frame of the window's newest pose,
    /// centimetres, shape `[3·points]`.
    pub fn copy_relative(&self, row: usize, out: &mut [f64]) {
        self.relative.copy_row(row, out);
    }
}
