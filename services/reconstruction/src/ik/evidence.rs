//! What was measured of a session, brought to the frames that are solved.

use formats::{PointsOptions, session};
use jobs::inverse_kinematics::InverseKinematics;
use kinematics::{ControlPoint, control_points};
use model::{Axis, PointTrajectories, Skeleton};
use nalgebra::Vector3;
use sparse::FarSamples;

use super::MAX_POINTS;
use crate::{
    InputError,
    control::{self, Chosen, Markers},
    inputs::{self, NamedBytes},
};

/// Reads the session's measured points. Without `points` in the request, those of the file that the skeleton has are used.
///
/// # Errors
/// If there is no such file, or names in it or in the request stand for nothing.
pub(super) fn read(
    files: &[NamedBytes],
    how: &InverseKinematics,
    up: Option<Axis>,
    skeleton: &Skeleton,
    warnings: &mut Vec<String>,
) -> Result<Chosen, InputError> {
    let markers = Markers::new(&how.choice)?;
    let points = PointsOptions { up, ..PointsOptions::default() };
    let reading = session::Options { points, ..session::Options::default() };
    let (file, trajectories) = inputs::measured_points(files, reading, warnings)?;
    let mut wanted = how.choice.points.clone();
    if wanted.is_empty() && matches!(markers, Markers::Auto | Markers::AsNamed) {
        let is_known = |name: &&String| control_points(skeleton, &[name]).is_ok();
        let (known, unknown): (Vec<&String>, Vec<&String>) = trajectories.names().iter().partition(is_known);
        if known.len() > 1 && !unknown.is_empty() {
            let listed = |names: &[&String]| {
                names.iter().take(12).map(|name| name.as_str()).collect::<Vec<_>>().join(", ")
            };
            let joints: Vec<&String> = skeleton.joints().iter().map(|joint| &joint.name).collect();
            warnings.push(format!(
                "{file}: {} not used, no points of the body: {} (understood: left_wrist, right_wrist, left_ankle, right_ankle, \
                 root, head, and joints: {})",
                if unknown.len() == 1 { "a trajectory is" } else { "trajectories are" },
                listed(&unknown),
                joints.iter().map(|name| name.as_str()).collect::<Vec<_>>().join(", "),
            ));
            wanted = known.into_iter().cloned().collect();
        }
    }
    let chosen = control::choose(&file, trajectories, &markers, &wanted, skeleton, warnings)?;
    // single ones are warned of with the other samples that can't be
    FarSamples::find(&chosen.trajectories, &chosen.points)?;
    if chosen.points.len() > MAX_POINTS {
        let some: Vec<&str> =
            chosen.points.iter().take(MAX_POINTS).map(|point| point.name.as_str()).collect();
        return Err(InputError::TooManyPoints {
            file,
            found: chosen.points.len(),
            limit: MAX_POINTS,
            some: some.join(","),
        });
    }
    Ok(chosen)
}

/// Frames of a constant rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frames {
    /// the first, from 0 at the beginning of the file of points
    pub first: usize,
    /// how many
    pub count: usize,
    /// frames a second
    pub rate: f64,
}

impl Frames {
    /// How many frames of `rate` from `first` on lie within the trajectories.
    pub fn within(trajectories: &PointTrajectories, first: usize, rate: f64) -> Self {
        let seconds = trajectories.num_frames().saturating_sub(1) as f64 / trajectories.frame_rate();
        // the last sample is a frame of its own, though rounding may put it a little too early
        let end = (seconds * rate + 1e-6).floor() as usize + 1;
        let end = if trajectories.num_frames() == 0 { 0 } else { end };
        Self { first, count: end.saturating_sub(first), rate }
    }
}

/// Positions of `points` at the frames, metres, NaN where not measured, shape `[frames][points]`: linearly between measured
/// neighbours.
pub(super) fn resampled(
    trajectories: &PointTrajectories,
    points: &[ControlPoint],
    frames: Frames,
) -> Vec<Vec<Vector3<f64>>> {
    let columns: Vec<_> = points.iter().map(|point| trajectories.point_index(&point.name)).collect();
    let last = trajectories.num_frames().saturating_sub(1);
    let nothing = Vector3::repeat(f64::NAN);
    let frame = |index: usize| {
        let at = (frames.first + index) as f64 / frames.rate * trajectories.frame_rate();
        // what falls on a sample does not need its neighbour
        let at = if (at - at.round()).abs() < 1e-6 { at.round() } else { at };
        let low = at.floor() as usize;
        if low > last {
            return vec![nothing; points.len()];
        }
        let (before, after) = (trajectories.frame(low), trajectories.frame((low + 1).min(last)));
        let share = at - low as f64;
        let between = |column: &Option<usize>| match column {
            Some(column) if share == 0.0 => before[*column],
            Some(column) => before[*column].lerp(&after[*column], share),
            None => nothing,
        };
        columns.iter().map(between).collect()
    };
    (0..frames.count).map(frame).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(frame_rate: f64, frames: usize) -> (PointTrajectories, Vec<ControlPoint>) {
        let at = |frame: usize| Vector3::new(frame as f64 / frame_rate, 1.0, 0.0);
        let trajectories =
            PointTrajectories::new(vec!["root".into()], frame_rate, (0..frames).map(at).collect()).unwrap();
        (trajectories, vec![ControlPoint { name: "root".into(), joint: 0, offset: Vector3::zeros() }])
    }

    #[test]
    fn points_are_where_they_were_at_the_time_of_the_frame() {
        let (trajectories, points) = line(100.0, 101);
        let frames = Frames::within(&trajectories, 5, 29.97);
        assert_eq!(frames.count, 29 + 1 - 5);
        for (index, found) in resampled(&trajectories, &points, frames).iter().enumerate() {
            let seconds = (5 + index) as f64 / 29.97;
            assert!((found[0].x - seconds).abs() < 1e-9, "{} {seconds}", found[0].x);
        }
    }

    #[test]
    fn a_file_at_its_own_rate_stays_as_it_is() {
        let (trajectories, points) = line(60.0, 61);
        let frames = Frames::within(&trajectories, 0, 60.0);
        assert_eq!(frames.count, 61);
        let found = resampled(&trajectories, &points, frames);
        assert!((0..61).all(|frame| found[frame][0] == trajectories.frame(frame)[0]));
    }

    #[test]
    fn what_was_not_measured_stays_so() {
        let (trajectories, points) = line(60.0, 3);
        let frames = Frames { first: 0, count: 9, rate: 120.0 };
        let found = resampled(&trajectories, &points, frames);
        assert!(found[4][0].x.is_finite() && found[8][0].x.is_nan());
    }
}
