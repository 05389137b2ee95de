use kinematics::HEADING;
use motion_db::{ControlTable, HeadingFrame, MotionDatabase, Neighbour, WindowIndex};
use regression::Examples;

/// Inputs and targets of a frame's neighbours, gathered from the database.
///
/// Inputs are the window's principal features and, if they join, the control points (times their weight); targets
/// are the poses that followed, relative to the heading frame of the window's newest pose, degrees and centimetres.
#[derive(Debug, Clone)]
pub struct ExampleBuffer {
    width: usize,
    dofs: usize,
    inputs: Vec<f64>,
    targets: Vec<f64>,
    distances: Vec<f64>,
    before: Vec<f64>,
    after: Vec<f64>,
}

impl ExampleBuffer {
    pub fn new(neighbours: usize, width: usize, dofs: usize) -> Self {
        Self {
            width,
            dofs,
            inputs: vec![0.0; neighbours * width],
            targets: vec![0.0; neighbours * dofs],
            distances: Vec::with_capacity(neighbours),
            before: vec![0.0; dofs],
            after: vec![0.0; dofs],
        }
    }

    /// `controls`: the table and the weight of each of its numbers (0 for a point that was not measured).
    pub fn gather(
        &mut self,
        database: &MotionDatabase,
        index: &WindowIndex,
        neighbours: &[Neighbour],
        controls: Option<(&ControlTable, &[f64])>,
    ) -> Examples<'_> {
        self.distances.clear();
        let window_width = index.width();
        for (k, neighbour) in neighbours.iter().enumerate() {
            self.distances.push(neighbour.distance_squared);
            let input = &mut self.inputs[k * self.width..(k + 1) * self.width];
            let (window, rest) = input.split_at_mut(window_width);
            for (v, f) in window.iter_mut().zip(index.features(neighbour.row)) {
                *v = f64::from(*f);
            }
            if let Some((table, weights)) = controls {
                table.copy_relative(neighbour.row, rest);
                for (v, w) in rest.iter_mut().zip(weights) {
                    *v *= w;
                }
            }
            let target = index.target(neighbour.row);
            database.copy_pose(target - 1, &mut self.before);
            database.copy_pose(target, &mut self.after);
            let frame = HeadingFrame::from_coordinates(&self.before);
            let out = &mut self.targets[k * self.dofs..(k + 1) * self.dofs];
            frame.relative(&self.after, out);
            index.scale().scale(out);
            debug_assert!(out[HEADING].abs() < 360.0);
        }
        let count = neighbours.len();
        Examples {
            width: self.width,
            dofs: self.dofs,
            inputs: &self.inputs[..count * self.width],
            targets: &self.targets[..count * self.dofs],
            distances_squared: &self.distances,
        }
    }
}
