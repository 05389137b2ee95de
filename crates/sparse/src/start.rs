use motion_db::{StartPose, start_poses};
use nalgebra::Vector3;

use crate::frame_solver::FrameSolver;
use crate::problem::Problem;
use crate::track::Track;
use crate::{Error, FramePart, Result};

/// Start poses that are run over all of the frames on which they are compared.
const FINALISTS: usize = 3;

/// Where a track begins.
pub(crate) struct Start {
    pub track: Track,
    /// first frame that it is to be stepped through: before it nothing to start from was measured
    pub frame: usize,
    /// the database's pose in that frame, if it is one's
    pub pose: Option<StartPose>,
}

/// A start pose on trial.
struct Probe {
    start: Track,
    pose: Option<StartPose>,
    now: Track,
    /// minus the log of the probability it gave to what was measured since
    surprise: f64,
}

/// The best of several beginnings at `frame` (docs/papers.md#start-poses): database poses whose control points fit the
/// coming frames, each run over these frames, and `current` among them if there is one. The one that makes the
/// measurements most probable wins. If fewer than two points are measured at `frame`, it begins at the first frame in which
/// two are.
pub(crate) fn start(
    problem: &Problem<'_>,
    solver: &mut FrameSolver<'_>,
    frame: usize,
    current: Option<Track>,
) -> Result<Start> {
    solver.begin(FramePart::Start);
    let trajectories = &problem.session.trajectories;
    // Without two measured points there is nothing to fit: look at the first frame that has them.
    let has_two = |f: &usize| trajectories.frame(*f).iter().filter(|p| p.x.is_finite()).count() >= 2;
    let after = (frame..trajectories.num_frames()).find(has_two);
    // Nothing is measured any more: start from where things stood when something last was.
    let first = after.or_else(|| (0..frame).rev().find(has_two)).unwrap_or(frame);
    let ahead = problem.parameters.start_frames.min(trajectories.num_frames() - first);
    let offsets: Vec<usize> = (0..ahead).step_by(3).collect();
    let observed: Vec<Option<Vector3<f64>>> = offsets
        .iter()
        .flat_map(|o| (0..trajectories.num_points()).map(move |p| trajectories.position(first + o, p)))
        .collect();
    let starts = start_poses(
        problem.database,
        &problem.table,
        &offsets,
        &observed,
        problem.parameters.window,
        problem.parameters.start_skeleton_weight,
        &problem.exclude_poses,
        problem.parameters.start_candidates,
    );
    let from_database = starts.iter().map(|s| (solver.track_from(s), Some(*s)));
    let mut probes: Vec<Probe> = from_database
        .chain(current.map(|track| (track, None)))
        .map(|(start, pose)| Probe { now: start.clone(), start, pose, surprise: 0.0 })
        .collect();
    // All run a third of the way, the best few to the end.
    for (part, keep) in [(first..first + ahead / 3, FINALISTS), (first + ahead / 3..first + ahead, 1)] {
        for probe in &mut probes {
            for f in part.clone() {
                probe.surprise += solver.step(&mut probe.now, problem.observed(f)).solution.surprise();
            }
        }
        probes.sort_by(|a, b| a.surprise.total_cmp(&b.surprise));
        probes.truncate(keep);
    }
    let best = probes.into_iter().next().ok_or(Error::NoStart { frame })?;
    // Where nothing is measured any more, it continues from here without measurements.
    Ok(Start { track: best.start, frame: after.unwrap_or(frame), pose: best.pose })
}
