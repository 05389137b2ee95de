use std::ops::Range;

use faer::Mat;

use crate::search::{Blocks, PREFIX};
use crate::{Error, HeadingFrame, MotionDatabase, Result};

/// Longest window, frames.
const MAX_WINDOW: usize = 16;
/// Number of windows that the principal axes are learned from, at most.
const AXES_SAMPLE: usize = 20_000;

/// What one unit of a feature is worth: angles count in degrees, translations in centimetres (scaled to the
/// database's leg length), so that 1° and 1 cm weigh the same.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureScale {
    /// features per coordinate unit (metre or radian), shape `[dofs]`
    pub per_dof: Vec<f64>,
}

impl FeatureScale {
    /// Degrees and centimetres.
    pub fn of(database: &MotionDatabase) -> Self {
        let parametrisation = database.parametrisation();
        let scale = |dof| if parametrisation.is_angle(dof) { 180.0 / std::f64::consts::PI } else { 100.0 };
        Self { per_dof: (0..database.num_dofs()).map(scale).collect() }
    }

    /// The features of the window `Q_{t,m}`: for i = 1 … m the pose of frame t − i relative to the heading frame of
    /// frame t − 1 (method §2, mend 1). `poses[i − 1]` is `q_{t−i}` in world coordinates; `out` has shape `[m · dofs]`.
    pub fn window_features(&self, poses: &[&[f64]], out: &mut [f64]) {
        let frame = HeadingFrame::of(poses[0]);
        for (pose, out) in poses.iter().zip(out.chunks_exact_mut(self.per_dof.len())) {
            frame.relative(pose, out);
            self.scale(out);
        }
    }

    /// Multiplies coordinates by their scale, in place.
    pub fn scale(&self, coordinates: &mut [f64]) {
        for (v, s) in coordinates.iter_mut().zip(&self.per_dof) {
            *v *= s;
        }
    }
}

/// All windows of a database, in principal axes.
///
/// A *row* is one window `Q_{t,m}` together with its target, the pose t. Features are centred and rotated to their
/// principal axes: distances and inner products stay what they were, and the leading numbers of a row are a
/// lower bound of its distance, which makes the exact search fast.
#[derive(Debug, Clone)]
pub struct WindowIndex {
    window: usize,
    scale: FeatureScale,
    /// shape `[width]`
    mean: Vec<f64>,
    /// rows are principal axes, strongest first, shape `[width, width]`
    axes: Vec<f64>,
    /// target pose of each row
    targets: Vec<u32>,
    /// rows of each clip
    clip_rows: Vec<Range<u32>>,
    /// leading features, in blocks for the scan
    pub(crate) prefix: Blocks,
    /// all features, shape `[rows, width]`
    features: Vec<f32>,
}

impl WindowIndex {
    /// Cuts `database` into windows of `window` frames.
    ///
    /// # Errors
    /// [`Error::Window`] if no clip is longer than the window, or the window is longer than 16 frames.
    pub fn new(database: &MotionDatabase, window: usize) -> Result<Self> {
        let longest = database.clips().iter().map(|c| c.num_poses).max().unwrap_or(0);
        let max = MAX_WINDOW.min(longest.saturating_sub(1));
        if window == 0 || window > max {
            return Err(Error::Window { found: window, max });
        }
        let scale = FeatureScale::of(database);
        let width = window * database.num_dofs();
        let (targets, clip_rows) = rows(database, window);
        let raw = RawWindows { database, scale: &scale, window };
        let (mean, axes) = principal_axes(&raw, &targets, width);
        let mut features = Vec::with_capacity(targets.len() * width);
        let mut scratch = vec![0.0; width];
        let mut rotated = vec![0.0; width];
        for &target in &targets {
            raw.features(target as usize, &mut scratch);
            rotate(&mean, &axes, &mut scratch, &mut rotated);
            features.extend(rotated.iter().map(|v| *v as f32));
        }
        let prefix = Blocks::new(targets.len(), PREFIX.min(width), |row, out| {
            out.copy_from_slice(&features[row * width..][..out.len()]);
        });
        Ok(Self { window, scale, mean, axes, targets, clip_rows, prefix, features })
    }

    /// Length of the windows m, frames.
    pub fn window(&self) -> usize {
        self.window
    }

    /// Number of features of a window, m·D.
    pub fn width(&self) -> usize {
        self.mean.len()
    }

    /// Number of windows.
    pub fn num_rows(&self) -> usize {
        self.targets.len()
    }

    /// The units of the features.
    pub fn scale(&self) -> &FeatureScale {
        &self.scale
    }

    /// The pose that follows a window.
    pub fn target(&self, row: usize) -> usize {
        self.targets[row] as usize
    }

    /// The row whose target is `pose`, if it has a whole window before it.
    pub fn row_of_target(&self, pose: usize) -> Option<usize> {
        self.targets.binary_search(&(pose as u32)).ok()
    }

    /// The windows of a clip.
    pub fn clip_rows(&self, clip: usize) -> Range<usize> {
        let rows = &self.clip_rows[clip];
        rows.start as usize..rows.end as usize
    }

    /// Features of a window in principal axes, shape `[width]`, degrees and centimetres.
    pub fn features(&self, row: usize) -> &[f32] {
        let width = self.width();
        &self.features[row * width..(row + 1) * width]
    }

    /// The query of a window: its features in principal axes. `poses[i − 1]` is `q_{t−i}` in world coordinates,
    /// translations in the database's scale; `scratch` and `out` have shape `[width]`.
    pub fn query_features(&self, poses: &[&[f64]], scratch: &mut [f64], out: &mut [f64]) {
        self.scale.window_features(poses, scratch);
        rotate(&self.mean, &self.axes, scratch, out);
    }
}

/// Windows straight from the database's poses.
struct RawWindows<'a> {
    database: &'a MotionDatabase,
    scale: &'a FeatureScale,
    window: usize,
}

impl RawWindows<'_> {
    fn features(&self, target: usize, out: &mut [f64]) {
        let dofs = self.database.num_dofs();
        let mut newest = vec![0.0; dofs];
        self.database.copy_pose(target - 1, &mut newest);
        let frame = HeadingFrame::of(&newest);
        let mut pose = vec![0.0; dofs];
        for (i, out) in (1..=self.window).zip(out.chunks_exact_mut(dofs)) {
            self.database.copy_pose(target - i, &mut pose);
            frame.relative(&pose, out);
            self.scale.scale(out);
        }
    }
}

fn rows(database: &MotionDatabase, window: usize) -> (Vec<u32>, Vec<Range<u32>>) {
    let mut targets = Vec::new();
    let mut clip_rows = Vec::new();
    for clip in database.clips() {
        let first = targets.len() as u32;
        let end = clip.first_pose + clip.num_poses;
        targets.extend((clip.first_pose + window..end).map(|t| t as u32));
        clip_rows.push(first..targets.len() as u32);
    }
    (targets, clip_rows)
}

/// Mean and principal axes (rows, strongest first) of the windows.
fn principal_axes(raw: &RawWindows<'_>, targets: &[u32], width: usize) -> (Vec<f64>, Vec<f64>) {
    let step = targets.len().div_ceil(AXES_SAMPLE).max(1);
    let sample: Vec<u32> = targets.iter().copied().step_by(step).collect();
    let mut windows = Mat::<f64>::zeros(width, sample.len());
    let mut mean = vec![0.0; width];
    let mut scratch = vec![0.0; width];
    for (column, &target) in sample.iter().enumerate() {
        raw.features(target as usize, &mut scratch);
        for (i, v) in scratch.iter().enumerate() {
            windows[(i, column)] = *v;
            mean[i] += v / sample.len() as f64;
        }
    }
    for column in 0..sample.len() {
        for i in 0..width {
            windows[(i, column)] -= mean[i];
        }
    }
    let covariance = &windows * windows.transpose();
    let mut axes = vec![0.0; width * width];
    match covariance.self_adjoint_eigen(faer::Side::Lower) {
        Ok(eigen) => {
            // Eigenvalues come in rising order.
            for k in 0..width {
                for i in 0..width {
                    axes[k * width + i] = eigen.U()[(i, width - 1 - k)];
                }
            }
        }
        // Any orthonormal axes are right, only slower.
        Err(_) => (0..width).for_each(|i| axes[i * width + i] = 1.0),
    }
    (mean, axes)
}

fn rotate(mean: &[f64], axes: &[f64], features: &mut [f64], out: &mut [f64]) {
    for (v, m) in features.iter_mut().zip(mean) {
        *v -= m;
    }
    for (out, axis) in out.iter_mut().zip(axes.chunks_exact(mean.len())) {
        *out = dot(axis, features);
    }
}

/// Inner product in four lanes, so that it is vectorised; the order of the sum is fixed.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 4];
    let (a4, a_rest) = a.as_chunks::<4>();
    let (b4, b_rest) = b.as_chunks::<4>();
    for (x, y) in a4.iter().zip(b4) {
        for i in 0..4 {
            lanes[i] += x[i] * y[i];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(x, y)| x * y).sum();
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + rest
}
