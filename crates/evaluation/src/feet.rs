//! How far feet slide while they stand (docs/papers.md#foot-contacts). What stands is decided here, by thresholds of
//! its own, so that whoever holds feet is not judged by their own idea of a contact.

use contacts::Feet;
use model::Motion;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// When a foot is taken to stand on the floor. It comes down below the lower and leaves above the higher thresholds
/// (hysteresis), so that a foot at rest does not flicker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactThresholds {
    /// height above the floor under which a foot may come to stand, metres
    pub enter_height_m: f64,
    /// height above which it no longer stands, metres
    pub leave_height_m: f64,
    /// speed under which a foot may come to stand, metres per second
    pub enter_speed_m_s: f64,
    /// speed above which it no longer stands, metres per second
    pub leave_speed_m_s: f64,
}

impl Default for ContactThresholds {
    /// 4 and 6 cm, 0.25 and 0.5 m/s: the ball of a walker's foot rises more than that as it leaves, and moves at some 5 cm/s
    /// while it stands (marker noise and soft shoes) against several m/s in the swing.
    fn default() -> Self {
        Self { enter_height_m: 0.04, leave_height_m: 0.06, enter_speed_m_s: 0.25, leave_speed_m_s: 0.5 }
    }
}

/// The balls of both feet in a motion.
#[derive(Debug, Clone, PartialEq)]
pub struct FootPaths {
    frame_rate: f64,
    /// left and right: position in each frame, metres, y up
    feet: [Vec<Vector3<f64>>; 2],
}

impl FootPaths {
    /// The balls of a motion's feet (see [`contacts::Feet`]); `None` if the skeleton has no feet of known names.
    pub fn from_motion(motion: &Motion) -> Option<Self> {
        let tracks = Feet::find(motion.skeleton()).ok()?.tracks(motion);
        let path = |point: usize| tracks.positions.iter().map(|points| points[point]).collect();
        // Points are ankle and ball of the left foot, then of the right.
        Some(Self { frame_rate: tracks.frame_rate, feet: [path(1), path(3)] })
    }

    /// Paths given as they are: left and right, metres, y up, one position a frame.
    pub fn new(frame_rate: f64, left: Vec<Vector3<f64>>, right: Vec<Vector3<f64>>) -> Self {
        Self { frame_rate, feet: [left, right] }
    }

    /// Velocity of a foot, metres per second: central differences, one-sided at the ends.
    fn velocity(&self, foot: usize, frame: usize) -> Vector3<f64> {
        let path = &self.feet[foot];
        let (before, after) = (frame.saturating_sub(1), (frame + 1).min(path.len() - 1));
        if before == after {
            return Vector3::zeros();
        }
        (path[after] - path[before]) * (self.frame_rate / (after - before) as f64)
    }

    /// Height of the floor: what a twentieth of the feet's heights are below, metres.
    fn floor(&self) -> f64 {
        let mut heights: Vec<f64> = self.feet.iter().flatten().map(|p| p.y).collect();
        heights.sort_by(f64::total_cmp);
        heights.get(heights.len() / 20).copied().unwrap_or(0.0)
    }

    /// In which frames each foot stands, shape `[2][frames]`.
    pub fn contacts(&self, thresholds: &ContactThresholds) -> [Vec<bool>; 2] {
        let floor = self.floor();
        [0, 1].map(|foot| {
            let mut stands = false;
            let frames = self.feet[foot].iter().enumerate().map(|(frame, position)| {
                let (height, speed) = (position.y - floor, self.velocity(foot, frame).norm());
                stands = if stands {
                    height <= thresholds.leave_height_m && speed <= thresholds.leave_speed_m_s
                } else {
                    height <= thresholds.enter_height_m && speed <= thresholds.enter_speed_m_s
                };
                stands
            });
            frames.collect()
        })
    }

    /// Mean horizontal speed over the frames in which `contacts` has a foot stand, metres per second, and their number.
    fn slide(&self, contacts: &[Vec<bool>; 2]) -> (f64, usize) {
        let (mut sum, mut count) = (0.0, 0);
        for (foot, contacts) in contacts.iter().enumerate() {
            for frame in (0..contacts.len().min(self.feet[foot].len())).filter(|&frame| contacts[frame]) {
                let v = self.velocity(foot, frame);
                sum += v.x.hypot(v.z);
                count += 1;
            }
        }
        (if count > 0 { sum / count as f64 } else { 0.0 }, count)
    }
}

/// How fast feet slide over the floor while they should stand.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FootSlide {
    /// frames (of either foot) in which the true foot stands
    pub contact_frames: usize,
    /// mean horizontal speed of the true feet in these frames, cm/s: what recording leaves
    pub truth_cm_s: f64,
    /// mean horizontal speed of the found feet in the same frames, cm/s
    pub found_cm_s: f64,
    /// frames in which the found foot stands by its own height and speed
    pub own_contact_frames: usize,
    /// mean horizontal speed of the found feet in those, cm/s: what somebody sees who has only the result
    pub own_cm_s: f64,
}

/// Foot slide of a result against the truth; `None` without feet or frames.
pub fn foot_slide(truth: &FootPaths, found: &FootPaths, thresholds: &ContactThresholds) -> Option<FootSlide> {
    if truth.feet.iter().chain(&found.feet).any(Vec::is_empty) {
        return None;
    }
    let (true_contacts, own_contacts) = (truth.contacts(thresholds), found.contacts(thresholds));
    let (true_speed, contact_frames) = truth.slide(&true_contacts);
    let (own_speed, own_contact_frames) = found.slide(&own_contacts);
    Some(FootSlide {
        contact_frames,
        truth_cm_s: 100.0 * true_speed,
        found_cm_s: 100.0 * found.slide(&true_contacts).0,
        own_contact_frames,
        own_cm_s: 100.0 * own_speed,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: f64 = 60.0;

    fn path(frames: usize, position: impl Fn(f64) -> Vector3<f64>) -> Vec<Vector3<f64>> {
        (0..frames).map(|f| position(f as f64 / RATE)).collect()
    }

    fn standing(x: f64) -> Vec<Vector3<f64>> {
        path(60, |_| Vector3::new(x, 0.02, 0.0))
    }

    #[test]
    fn a_slide_of_known_speed_is_measured_to_the_number() {
        let truth = FootPaths::new(RATE, standing(0.0), standing(0.2));
        // 3 cm/s along x and 4 along z, rising 1 cm/s, which does not count.
        let sliding = path(60, |t| Vector3::new(0.03 * t, 0.02 + 0.01 * t, 0.04 * t));
        let found = FootPaths::new(RATE, sliding.clone(), sliding);
        let slide = foot_slide(&truth, &found, &ContactThresholds::default()).unwrap();
        assert_eq!((slide.contact_frames, slide.own_contact_frames), (120, 120));
        assert!(slide.truth_cm_s < 1e-12);
        assert!((slide.found_cm_s - 5.0).abs() < 1e-9 && (slide.own_cm_s - 5.0).abs() < 1e-9, "{slide:?}");
    }

    #[test]
    fn only_frames_in_which_the_truth_stands_count() {
        // The true left foot stands for half a second, then swings at 2 m/s and 10 cm up; the right one always swings.
        let left = path(60, |t| {
            if t < 0.5 { Vector3::new(0.0, 0.0, 0.0) } else { Vector3::new(2.0 * (t - 0.5), 0.1, 0.0) }
        });
        let right = path(60, |t| Vector3::new(3.0 * t, 0.3, 0.0));
        let truth = FootPaths::new(RATE, left, right.clone());
        let found = FootPaths::new(RATE, path(60, |t| Vector3::new(0.1 * t, 0.0, 0.0)), right);
        let slide = foot_slide(&truth, &found, &ContactThresholds::default()).unwrap();
        // The last standing frame sees the foot leave: its central difference spans the step up.
        assert_eq!(slide.contact_frames, 29);
        assert!((slide.found_cm_s - 10.0).abs() < 1e-9, "{slide:?}");
    }

    #[test]
    fn a_foot_between_the_thresholds_stays_as_it_was() {
        let thresholds = ContactThresholds::default();
        // Down, then 5 cm up: between 4 and 6 cm it still stands; from 5 cm at the beginning it does not.
        let slow = |t: f64| if t < 0.5 { 0.0 } else { (0.2 * (t - 0.5)).min(0.05) };
        let down = path(60, |t| Vector3::new(0.0, slow(t), 0.0));
        let up = path(60, |_| Vector3::new(0.0, 0.05, 0.0));
        let contacts = FootPaths::new(RATE, down, up).contacts(&thresholds);
        assert!(contacts[0].iter().all(|&c| c) && contacts[1].iter().all(|&c| !c));
    }

    #[test]
    fn a_motion_without_frames_has_no_slide() {
        let none = FootPaths::new(RATE, Vec::new(), Vec::new());
        assert_eq!(foot_slide(&none, &none, &ContactThresholds::default()), None);
    }
}
