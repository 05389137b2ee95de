//! What the papers print, to stand beside what we measure.

/// Errors (degrees) of Shen et al. 2014, table 1, for 2 to 6 control points, trial out; they do not say whether RMS
/// or mean absolute.
pub const LOCAL_REGRESSION: [f64; 5] = [18.63, 7.86, 2.67, 2.25, 1.90];

/// The papers' speed: window of two frames, one core of 2.8 GHz, frames a second (table 1 of the Chinese paper).
pub const FRAMES_PER_SECOND: f64 = 59.0;

/// The paper's error for a number of control points, degrees.
pub fn local_regression(points: usize) -> Option<f64> {
    points.checked_sub(2).and_then(|i| LOCAL_REGRESSION.get(i)).copied()
}
