use std::ops::Range;

use crate::{Contact, Contacts, FootTracks, POINTS};

/// What counts as standing. The thresholds are cautious: a foot that moves on purpose must not be held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetectSettings {
    /// height above the floor at which a point begins to stand, metres
    pub low_m: f64,
    /// height above which it no longer stands, metres
    pub high_m: f64,
    /// speed at which it begins to stand, metres a second
    pub slow_m_s: f64,
    /// speed above which it no longer stands, metres a second
    pub fast_m_s: f64,
    /// speed from the first to the last of its place above which it slides, and does not stand, metres a second
    pub drift_m_s: f64,
    /// shortest contact, seconds
    pub shortest_s: f64,
    /// a floor farther than this from a height of 0 is none, metres
    pub floor_range_m: f64,
}

impl Default for DetectSettings {
    fn default() -> Self {
        Self {
            low_m: 0.03,
            high_m: 0.05,
            slow_m_s: 0.15,
            fast_m_s: 0.25,
            drift_m_s: 0.12,
            shortest_s: 0.1,
            floor_range_m: 0.25,
        }
    }
}

/// Finds the contacts of both feet.
///
/// The floor of a point is the height that a tenth of its slow frames are below, ankles and balls each for
/// themselves (an ankle never comes down to the floor), left and right together. A contact begins where a point is low and
/// slow, reaches as far as it is not high or fast, lasts at least `shortest_s`, and is none if the point travels.
pub fn detect(tracks: &FootTracks, settings: &DetectSettings) -> Contacts {
    let num_frames = tracks.positions.len();
    let mut all = Vec::new();
    let speeds: Vec<Vec<f64>> = (0..POINTS).map(|point| speeds(tracks, point)).collect();
    for kind in 0..2 {
        let points = [kind, kind + 2];
        let Some(floor) = floor(tracks, &speeds, points, settings) else { continue };
        for point in points {
            all.extend(contacts_of(tracks, &speeds[point], point, floor, settings));
        }
    }
    all.sort_by_key(|c| (c.point, c.frames.start));
    Contacts::new(all, num_frames)
}

/// Speed of a point over two frames to either side (as far as there are any), metres a second; not a number where a
/// position is missing.
fn speeds(tracks: &FootTracks, point: usize) -> Vec<f64> {
    let last = tracks.positions.len().saturating_sub(1);
    let speed = |frame: usize| {
        let (from, to) = (frame.saturating_sub(2), (frame + 2).min(last));
        if from == to {
            return f64::NAN;
        }
        let way = tracks.positions[to][point] - tracks.positions[from][point];
        way.norm() * tracks.frame_rate / (to - from) as f64
    };
    (0..tracks.positions.len()).map(speed).collect()
}

/// The height on which two points stand; `None` if they never do, or far from where a floor may be.
fn floor(
    tracks: &FootTracks,
    speeds: &[Vec<f64>],
    points: [usize; 2],
    settings: &DetectSettings,
) -> Option<f64> {
    let slow = points.into_iter().flat_map(|point| {
        let frames = tracks.positions.iter().zip(&speeds[point]);
        frames.filter(|(_, speed)| **speed < settings.slow_m_s).map(move |(p, _)| p[point].y)
    });
    let mut heights: Vec<f64> = slow.filter(|y| y.is_finite()).collect();
    heights.sort_by(f64::total_cmp);
    let floor = *heights.get(heights.len() / 10)?;
    (floor.abs() <= settings.floor_range_m).then_some(floor)
}

fn contacts_of(
    tracks: &FootTracks,
    speeds: &[f64],
    point: usize,
    floor: f64,
    settings: &DetectSettings,
) -> Vec<Contact> {
    let is_within = |frame: usize, height: f64, speed: f64| {
        // Not where one of them is not a number.
        tracks.positions[frame][point].y - floor < height && speeds[frame] < speed
    };
    let shortest = (settings.shortest_s * tracks.frame_rate).round().max(2.0) as usize;
    let mut found = Vec::new();
    let mut frame = 0;
    while frame < speeds.len() {
        if !is_within(frame, settings.high_m, settings.fast_m_s) {
            frame += 1;
            continue;
        }
        let start = frame;
        let mut begins = false;
        while frame < speeds.len() && is_within(frame, settings.high_m, settings.fast_m_s) {
            begins |= is_within(frame, settings.low_m, settings.slow_m_s);
            frame += 1;
        }
        let frames = start..frame;
        if begins && frames.len() >= shortest && !travels(tracks, point, &frames, settings) {
            found.push(Contact { point, frames });
        }
    }
    found
}

/// Whether a point is somewhere else in the end than in the beginning: it slides.
fn travels(tracks: &FootTracks, point: usize, frames: &Range<usize>, settings: &DetectSettings) -> bool {
    let third = (frames.len() / 3).max(1);
    let mean = |range: Range<usize>| {
        let count = range.len() as f64;
        range.map(|f| tracks.positions[f][point].xz()).sum::<nalgebra::Vector2<f64>>() / count
    };
    let way = mean(frames.end - third..frames.end) - mean(frames.start..frames.start + third);
    let seconds = (frames.len() - third) as f64 / tracks.frame_rate;
    way.norm() > settings.drift_m_s * seconds
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    /// Both balls and ankles on the floor; the left foot as `left` says, the right 2 m away and still.
    fn tracks(frames: usize, left: impl Fn(f64) -> Vector3<f64>) -> FootTracks {
        let still = Vector3::new(2.0, 0.0, 0.0);
        let ankle = Vector3::new(0.0, 0.08, -0.1);
        let position = |frame: usize| {
            let foot = left(frame as f64 / 60.0);
            [foot + ankle, foot, still + ankle, still]
        };
        FootTracks { frame_rate: 60.0, positions: (0..frames).map(position).collect() }
    }

    fn left_standing(contacts: &Contacts) -> Vec<Range<usize>> {
        contacts.all().iter().filter(|c| c.point == 1).map(|c| c.frames.clone()).collect()
    }

    #[test]
    fn a_foot_that_steps_stands_before_and_after() {
        // Half a second still, half a second through the air, half a second still.
        let step = |t: f64| {
            let share = ((t - 0.5) / 0.5).clamp(0.0, 1.0);
            let way = share * share * (3.0 - 2.0 * share);
            Vector3::new(0.0, 0.15 * (std::f64::consts::PI * share).sin(), 0.7 * way)
        };
        let tracks = tracks(90, step);
        let contacts = detect(&tracks, &DetectSettings::default());
        let found = left_standing(&contacts);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].start == 0 && (28..=32).contains(&found[0].end), "{found:?}");
        assert!((58..=62).contains(&found[1].start) && found[1].end == 90, "{found:?}");
        assert_eq!(contacts.feet()[45], [false, true]);
    }

    #[test]
    fn the_slide_of_a_known_speed_is_measured_and_not_taken_for_standing_when_it_is_on_purpose() {
        let creeping = tracks(120, |t| Vector3::new(0.05 * t, 0.0, 0.0));
        let contacts = detect(&creeping, &DetectSettings::default());
        assert_eq!(left_standing(&contacts), vec![0..120; 1]);
        // Left at 5 cm/s, right at none.
        assert!((creeping.slide_cm_s(&contacts).unwrap() - 2.5).abs() < 1e-9);
        assert!((creeping.slides_cm_s(&contacts)[60].unwrap() - 5.0).abs() < 1e-9);
        let shuffling = tracks(120, |t| Vector3::new(0.25 * t, 0.0, 0.0));
        assert_eq!(
            left_standing(&detect(&shuffling, &DetectSettings::default())),
            Vec::<Range<usize>>::new()
        );
    }

    #[test]
    fn nothing_stands_in_the_air_or_where_nothing_is_known() {
        let flying = |t: f64| Vector3::new(0.0, 0.6 + 0.1 * (3.0 * t).sin(), 3.0 * t);
        let mut in_air = tracks(60, flying);
        in_air.positions.iter_mut().for_each(|p| (p[2], p[3]) = (p[0], p[1]));
        assert!(detect(&in_air, &DetectSettings::default()).all().is_empty());
        let mut unknown = tracks(60, |_| Vector3::zeros());
        unknown.positions.iter_mut().for_each(|p| *p = [Vector3::repeat(f64::NAN); POINTS]);
        let contacts = detect(&unknown, &DetectSettings::default());
        assert!(contacts.all().is_empty() && unknown.slide_cm_s(&contacts).is_none());
    }

    #[test]
    fn a_gap_ends_a_contact() {
        let mut tracks = tracks(60, |_| Vector3::zeros());
        tracks.positions[30][1] = Vector3::repeat(f64::NAN);
        let found = left_standing(&detect(&tracks, &DetectSettings::default()));
        assert_eq!(found.len(), 2);
        assert!(found[0].end <= 30 && found[1].start > 30, "{found:?}");
    }

    #[test]
    fn no_frames_have_no_contacts_and_one_frame_neither() {
        for frames in [0, 1, 2] {
            let contacts = detect(&tracks(frames, |_| Vector3::zeros()), &DetectSettings::default());
            assert!(contacts.all().is_empty());
            assert_eq!(contacts.num_frames(), frames);
        }
    }
}
