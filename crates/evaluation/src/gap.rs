//! What a gap in the measurement costs, and how long.

use motion_db::FRAME_RATE;
use serde::{Deserialize, Serialize};

use crate::{Comparison, Gap};

/// Frames after a gap that are looked at.
const AFTER: usize = 30;
/// Frames in a row that must be as good as without the gap.
const STEADY: usize = 6;
/// How much worse than without the gap is as good.
const FACTOR: f64 = 1.25;
/// Degrees by which it may be worse in any case.
const SLACK_DEG: f64 = 0.5;

/// Errors in a gap and after it, beside those of the same frames when nothing was hidden.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GapErrors {
    /// RMS of the joint angles over the gap, degrees
    pub inside_deg: f64,
    /// the same frames without the gap, degrees
    pub inside_undisturbed_deg: f64,
    /// mean joint position error over the gap, centimetres
    pub inside_cm: f64,
    /// the same frames without the gap, centimetres
    pub inside_undisturbed_cm: f64,
    /// RMS of the joint angles over the half second after the gap, degrees
    pub after_deg: f64,
    /// the same frames without the gap, degrees
    pub after_undisturbed_deg: f64,
    /// seconds after the gap from which on, for a tenth of a second, every frame is at most a quarter and half a degree worse
    /// than without the gap; `None` if that does not come before the trial ends
    pub recovery_s: Option<f64>,
}

/// Compares a trial with a gap with the same trial without: both against the truth.
pub fn gap_errors(occluded: &Comparison, undisturbed: &Comparison, gap: &Gap) -> GapErrors {
    let end = occluded.frame_rms_deg.len();
    let after = gap.frames.end..(gap.frames.end + AFTER).min(end);
    let square = |values: &[f64], frames: &std::ops::Range<usize>| {
        let part = &values[frames.clone()];
        (part.iter().map(|v| v * v).sum::<f64>() / part.len().max(1) as f64).sqrt()
    };
    let mean = |values: &[f64]| {
        let part = &values[gap.frames.clone()];
        part.iter().sum::<f64>() / part.len().max(1) as f64
    };
    let is_good =
        |frame: usize| occluded.frame_rms_deg[frame] <= FACTOR * undisturbed.frame_rms_deg[frame] + SLACK_DEG;
    let recovered = (gap.frames.end..(end + 1).saturating_sub(STEADY))
        .find(|&begin| (begin..begin + STEADY).all(is_good))
        .map(|frame| (frame - gap.frames.end) as f64 / FRAME_RATE);
    GapErrors {
        inside_deg: square(&occluded.frame_rms_deg, &gap.frames),
        inside_undisturbed_deg: square(&undisturbed.frame_rms_deg, &gap.frames),
        inside_cm: mean(&occluded.frame_mpjpe_cm),
        inside_undisturbed_cm: mean(&undisturbed.frame_mpjpe_cm),
        after_deg: square(&occluded.frame_rms_deg, &after),
        after_undisturbed_deg: square(&undisturbed.frame_rms_deg, &after),
        recovery_s: recovered,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Errors;

    fn curve(frames: usize, error: impl Fn(usize) -> f64) -> Comparison {
        let frame_rms_deg: Vec<f64> = (0..frames).map(error).collect();
        let errors = Errors {
            frames,
            rms_deg: 0.0,
            mae_deg: 0.0,
            geodesic_deg: 0.0,
            mpjpe_cm: 0.0,
            mpjpe_aligned_cm: 0.0,
        };
        Comparison { errors, frame_mpjpe_cm: frame_rms_deg.clone(), frame_rms_deg, joints: Vec::new() }
    }

    #[test]
    fn errors_in_and_after_a_gap_are_those_of_its_frames() {
        let gap = Gap { frames: 40..70, points: 0..1 };
        let undisturbed = curve(120, |_| 2.0);
        // 8 degrees in the gap, and for 12 frames after it.
        let occluded = curve(120, |f| if (40..82).contains(&f) { 8.0 } else { 2.0 });
        let found = gap_errors(&occluded, &undisturbed, &gap);
        assert_eq!((found.inside_deg, found.inside_undisturbed_deg), (8.0, 2.0));
        assert_eq!((found.inside_cm, found.inside_undisturbed_cm), (8.0, 2.0));
        let after = ((12.0 * 64.0 + 18.0 * 4.0) / 30f64).sqrt();
        assert!((found.after_deg - after).abs() < 1e-12 && found.after_undisturbed_deg == 2.0);
        assert_eq!(found.recovery_s, Some(0.2));
    }

    #[test]
    fn a_moment_of_luck_is_no_recovery() {
        let gap = Gap { frames: 40..70, points: 0..1 };
        let undisturbed = curve(120, |_| 2.0);
        let lucky = curve(120, |f| if f < 40 || (80..85).contains(&f) { 2.0 } else { 8.0 });
        assert_eq!(gap_errors(&lucky, &undisturbed, &gap).recovery_s, None);
        // At most 2 · 1.25 + 0.5.
        let slightly_worse = curve(120, |f| if (40..70).contains(&f) { 9.0 } else { 3.0 });
        assert_eq!(gap_errors(&slightly_worse, &undisturbed, &gap).recovery_s, Some(0.0));
    }

    #[test]
    fn a_trial_that_ends_soon_after_its_gap_may_still_recover() {
        let gap = Gap { frames: 40..70, points: 0..1 };
        let undisturbed = curve(76, |_| 2.0);
        assert_eq!(gap_errors(&curve(76, |_| 2.0), &undisturbed, &gap).recovery_s, Some(0.0));
        assert_eq!(gap_errors(&curve(75, |_| 2.0), &curve(75, |_| 2.0), &gap).recovery_s, None);
    }
}
