use std::ops::Range;

use faer::Mat;

use crate::blocks::{Blocks, PREFIX};
use crate::column::Column;
use crate::segments::{Cutter, Segments, squared_distance};
use crate::{Error, HeadingFrame, MotionDatabase, OneThread, Result, Threads};

/// Longest window, frames.
const MAX_WINDOW: usize = 16;
/// Number of windows that the principal axes are learned from, at most.
const AXES_SAMPLE: usize = 20_000;
/// Number of windows whose distance to the next is looked at, at most.
const STEPS_SAMPLE: usize = 4_096;
/// Windows that are worked out together, and by one thread.
const ROWS_A_BATCH: usize = 8_192;
const ROWS_A_PIECE: usize = 256;

/// What one unit of a feature is worth: angles count in degrees, translations in centimetres (scaled to the
/// database's leg length), so that 1° and 1 cm weigh the same.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureScale {
    /// features per coordinate unit (metre or radian), shape `[dofs]`
    pub per_dof: Vec<f64>,
}

impl FeatureScale {
    /// Degrees and centimetres.
    pub fn from_database(database: &MotionDatabase) -> Self {
        let parametrisation = database.parametrisation();
        let scale = |dof| if parametrisation.is_angle(dof) { 180.0 / std::f64::consts::PI } else { 100.0 };
        Self { per_dof: (0..database.num_dofs()).map(scale).collect() }
    }

    /// The features of the window `Q_{t,m}`: for i = 1 … m the pose of frame t − i relative to the heading frame of
    /// frame t − 1 (docs/papers.md#heading-frame). `poses[i − 1]` is `q_{t−i}` in world coordinates; `out` has shape
    /// `[m · dofs]`.
    pub fn window_features(&self, poses: &[&[f64]], out: &mut [f64]) {
        let frame = HeadingFrame::from_coordinates(poses[0]);
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
/// lower bound of its distance, which makes the exact search fast. For the fast search ([`Self::nearest_fast`]), rows
/// that follow one another are grouped, the groups sorted into lists and joined to a graph.
#[derive(Debug, Clone)]
pub struct WindowIndex {
    pub(crate) window: usize,
    pub(crate) scale: FeatureScale,
    /// shape `[width]`
    pub(crate) mean: Vec<f64>,
    /// rows are principal axes, strongest first, shape `[width, width]`
    pub(crate) axes: Vec<f64>,
    /// target pose of each row
    pub(crate) targets: Vec<u32>,
    /// rows of each clip
    pub(crate) clip_rows: Vec<Range<u32>>,
    /// leading features, in blocks for the scan
    pub(crate) prefix: Blocks,
    /// all features, shape `[rows, width]`
    pub(crate) features: Column<f32>,
    /// what the fast search goes by; `None` if there are too few rows to be worth it
    pub(crate) segments: Option<Segments>,
}

impl WindowIndex {
    /// Cuts `database` into windows of `window` frames.
    ///
    /// # Errors
    /// [`Error::Window`] if no clip is longer than the window, or the window is longer than 16 frames.
    pub fn new(database: &MotionDatabase, window: usize) -> Result<Self> {
        Self::with_threads(database, window, &OneThread)
    }

    /// As [`Self::new`], by several threads; the index is the same.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_threads(database: &MotionDatabase, window: usize, threads: &impl Threads) -> Result<Self> {
        let mut features = Vec::new();
        let mut index = Self::without_features(database, window, threads, &mut |rows| {
            if features.is_empty() {
                // All at once: a vector that grows would take twice as much.
                features.reserve_exact(count_rows(database, window) * window * database.num_dofs());
            }
            features.extend_from_slice(rows);
            Ok(())
        })?;
        index.features = features.into();
        Ok(index)
    }

    /// The index with its features not kept but given to `emit`, a batch of rows after the other: `features` stays
    /// empty. What is kept is a fifth as large.
    pub(crate) fn without_features(
        database: &MotionDatabase,
        window: usize,
        threads: &impl Threads,
        emit: &mut dyn FnMut(&[f32]) -> Result<()>,
    ) -> Result<Self> {
        check_window(database, window)?;
        let scale = FeatureScale::from_database(database);
        let width = window * database.num_dofs();
        let (targets, clip_rows) = rows(database, window);
        let raw = RawWindows { database, scale: &scale, window };
        let (mean, axes) = principal_axes(&raw, &targets, width);
        let mut cutter = Cutter::new(width, median_step(&raw, &targets, width));
        let mut prefix = Blocks::zeros(targets.len(), PREFIX.min(width));
        let mut batch = vec![0.0f32; ROWS_A_BATCH.min(targets.len()) * width];
        for (start, targets) in (0..).step_by(ROWS_A_BATCH).zip(targets.chunks(ROWS_A_BATCH)) {
            let batch = &mut batch[..targets.len() * width];
            threads.for_each_piece(batch, ROWS_A_PIECE * width, |piece, out| {
                let mut memory = RawMemory::new(&raw);
                let mut rotated = vec![0.0; width];
                for (target, out) in targets[piece * ROWS_A_PIECE..].iter().zip(out.chunks_exact_mut(width)) {
                    let features = raw.features(*target as usize, &mut memory);
                    rotate(&mean, &axes, features, &mut rotated);
                    out.iter_mut().zip(&rotated).for_each(|(out, v)| *out = *v as f32);
                }
            });
            for (i, row) in batch.chunks_exact(width).enumerate() {
                prefix.set(start + i, row);
                let continues = i > 0 && targets[i] == targets[i - 1] + 1;
                cutter.add(row, continues);
            }
            emit(batch)?;
        }
        drop(batch);
        let segments = cutter.finish(threads);
        let features = Vec::new().into();
        Ok(Self { window, scale, mean, axes, targets, clip_rows, prefix, features, segments })
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
    pub fn target_row(&self, pose: usize) -> Option<usize> {
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

/// Memory for [`RawWindows::features`].
struct RawMemory {
    newest: Vec<f64>,
    pose: Vec<f64>,
    features: Vec<f64>,
}

impl RawMemory {
    fn new(raw: &RawWindows<'_>) -> Self {
        let dofs = raw.database.num_dofs();
        Self { newest: vec![0.0; dofs], pose: vec![0.0; dofs], features: vec![0.0; raw.window * dofs] }
    }
}

impl RawWindows<'_> {
    fn features<'m>(&self, target: usize, memory: &'m mut RawMemory) -> &'m mut [f64] {
        self.database.copy_pose(target - 1, &mut memory.newest);
        let frame = HeadingFrame::from_coordinates(&memory.newest);
        let dofs = self.database.num_dofs();
        for (i, out) in (1..=self.window).zip(memory.features.chunks_exact_mut(dofs)) {
            self.database.copy_pose(target - i, &mut memory.pose);
            frame.relative(&memory.pose, out);
            self.scale.scale(out);
        }
        &mut memory.features
    }
}

pub(crate) fn check_window(database: &MotionDatabase, window: usize) -> Result<()> {
    let longest = database.clips().iter().map(|c| c.num_poses).max().unwrap_or(0);
    let max = MAX_WINDOW.min(longest.saturating_sub(1));
    if window == 0 || window > max { Err(Error::Window { found: window, max }) } else { Ok(()) }
}

/// Number of windows of `window` frames.
pub(crate) fn count_rows(database: &MotionDatabase, window: usize) -> usize {
    database.clips().iter().map(|c| c.num_poses.saturating_sub(window)).sum()
}

/// Target of each row, and the rows of each clip.
pub(crate) fn rows(database: &MotionDatabase, window: usize) -> (Vec<u32>, Vec<Range<u32>>) {
    let mut targets = Vec::with_capacity(count_rows(database, window));
    let mut clip_rows = Vec::with_capacity(database.clips().len());
    for clip in database.clips() {
        let first = targets.len() as u32;
        let end = clip.first_pose + clip.num_poses;
        targets.extend((clip.first_pose + window..end).map(|t| t as u32));
        clip_rows.push(first..targets.len() as u32);
    }
    (targets, clip_rows)
}

/// Median distance between a window and the next of its clip.
fn median_step(raw: &RawWindows<'_>, targets: &[u32], width: usize) -> f32 {
    let mut memory = RawMemory::new(raw);
    let mut single = |target: u32| -> Vec<f32> {
        raw.features(target as usize, &mut memory).iter().map(|v| *v as f32).collect()
    };
    let every = targets.len().div_ceil(STEPS_SAMPLE).max(1);
    let pairs = targets.windows(2).step_by(every).filter(|pair| pair[1] == pair[0] + 1);
    let mut steps: Vec<f32> =
        pairs.map(|pair| squared_distance(&single(pair[0]), &single(pair[1])).sqrt()).collect();
    steps.sort_by(f32::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(width as f32)
}

/// Mean and principal axes (rows, strongest first) of the windows.
fn principal_axes(raw: &RawWindows<'_>, targets: &[u32], width: usize) -> (Vec<f64>, Vec<f64>) {
    let step = targets.len().div_ceil(AXES_SAMPLE).max(1);
    let sample: Vec<u32> = targets.iter().copied().step_by(step).collect();
    let mut windows = Mat::<f64>::zeros(width, sample.len());
    let mut mean = vec![0.0; width];
    let mut memory = RawMemory::new(raw);
    for (column, &target) in sample.iter().enumerate() {
        for (i, v) in raw.features(target as usize, &mut memory).iter().enumerate() {
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
