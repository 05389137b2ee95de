use std::ops::{ControlFlow, Range};
use std::sync::Arc;

use motion_db::{ControlTable, MotionDatabase, StartPose, WindowIndex};
use regression::gplvm::Gplvm;

use crate::frame_solver::FrameSolver;
use crate::problem::Problem;
use crate::start::{Start, start};
use crate::uncertainty::Uncertainty;
use crate::zero_pose::learn_zero_pose;
use crate::{Error, FramePart, FrameQuality, Parameters, Reconstruction, Result, Session};

/// Reconstructs frames of one session with one database.
pub struct Reconstructor<'a> {
    pub(crate) problem: Problem<'a>,
}

impl<'a> Reconstructor<'a> {
    /// Prepares a session: where its control points would be in every pose of the database (about 3 µs a pose).
    ///
    /// `index` must have been made from `database` with the parameters' window.
    ///
    /// # Errors
    /// If a parameter is out of range or the session's skeleton has another structure than the database's.
    pub fn new(
        database: &'a MotionDatabase,
        index: &'a WindowIndex,
        session: &'a Session,
        parameters: &'a Parameters,
    ) -> Result<Self> {
        Ok(Self { problem: Problem::new(database, index, session, parameters)? })
    }

    /// As [`Self::new`], with the [`control_table`](crate::control_table) of the same database, index and session made before, and without the
    /// frames around a frame ([`Parameters::smooth`]).
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_table(
        database: &'a MotionDatabase,
        index: &'a WindowIndex,
        session: &'a Session,
        parameters: &'a Parameters,
        table: Arc<ControlTable>,
    ) -> Result<Self> {
        Ok(Self { problem: Problem::with_table(database, index, session, parameters, table)? })
    }

    /// With the latent variable model of the database ([`crate::train_gplvm`]), which method `gplvm` needs.
    ///
    /// # Errors
    /// [`Error::OtherModel`] if its poses are not the database's.
    pub fn with_model(mut self, model: &'a Gplvm) -> Result<Self> {
        let (found, expected) = (model.dofs(), self.problem.database.num_dofs());
        if found != expected {
            return Err(Error::OtherModel { found, expected });
        }
        self.problem.model = Some(model);
        Ok(self)
    }

    /// Calls `watcher` whenever a part of a frame begins, so that it can be timed: this crate has no clock.
    pub fn watched(mut self, watcher: &'a (dyn Fn(FramePart) + Sync)) -> Self {
        self.problem.watcher = Some(watcher);
        self
    }

    /// Leaves clips out of every search: `is_excluded` sees each clip of the database.
    pub fn exclude(&mut self, is_excluded: impl Fn(&motion_db::ClipInfo) -> bool) {
        let problem = &mut self.problem;
        problem.exclude_rows.clear();
        problem.exclude_poses.clear();
        for (i, clip) in problem.database.clips().iter().enumerate().filter(|(_, c)| is_excluded(c)) {
            problem.exclude_rows.push(problem.index.clip_rows(i));
            problem.exclude_poses.push(clip.first_pose..clip.first_pose + clip.num_poses);
        }
    }

    /// Learns the zero pose of a performer whose recordings the database does not hold, from the first frames
    /// ([`Parameters::zero_pose_frames`]); without this call it is guessed from their skeleton. Does nothing for performers
    /// in the database, or if [`Parameters::learn_zero_pose`] is off. Clips to be left out must have been excluded before
    /// the database was built: the zero poses of others are made from them.
    ///
    /// # Errors
    /// If no start pose is found or the method's model is missing.
    pub fn learn_zero_pose(&mut self) -> Result<()> {
        learn_zero_pose(&mut self.problem)
    }

    /// Reconstructs `frames` of the session in order. `progress` is called after every frame with the number of frames
    /// done, and may stop it. The same arguments always give the same bits.
    ///
    /// # Errors
    /// If the range is not in the session, no start pose is found, the method's model is missing, or `progress` stops
    /// it.
    pub fn reconstruct(
        &self,
        frames: Range<usize>,
        progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<Reconstruction> {
        let problem = &self.problem;
        let total = problem.session.num_frames();
        if frames.start >= frames.end || frames.end > total {
            return Err(Error::Range { start: frames.start, end: frames.end, frames: total });
        }
        let mut solver = FrameSolver::new(problem)?;
        let dofs = problem.database.num_dofs();
        let mut reconstruction = Reconstruction {
            first_frame: frames.start,
            coordinates: Vec::with_capacity(frames.len() * dofs),
            sigmas: Vec::with_capacity(frames.len() * dofs),
            quality: Vec::with_capacity(frames.len()),
        };
        let mut sigmas = vec![0.0; dofs];
        let mut uncertainty = Uncertainty::new(&problem.zero_pose_variance);
        let begun = start(problem, &mut solver, frames.start, None)?;
        if begun.frame > frames.start {
            play_back(problem, &mut solver, &begun, &frames, &mut reconstruction);
        }
        let mut track = begun.track;
        let mut before = track.clone();
        let mut lost = 0;
        for frame in begun.frame..frames.end {
            before.copy_from(&track);
            let mut step = solver.step(&mut track, problem.observed(frame));
            lost = if step.energy() > problem.parameters.lost_energy { lost + 1 } else { 0 };
            if lost >= problem.parameters.lost_frames {
                lost = 0;
                uncertainty.restart();
                track = start(problem, &mut solver, frame, Some(before.clone()))?.track;
                step = solver.step(&mut track, problem.observed(frame));
            }
            reconstruction.coordinates.extend_from_slice(track.newest());
            reconstruction.quality.push(FrameQuality {
                residual_m: step.solution.residual_m,
                sigma_rad: solver.standard_deviations(&mut uncertainty, &mut sigmas),
                energy: step.energy(),
                neighbour_distance_deg: step.neighbour_distance,
                measured_points: step.measured / 3,
            });
            reconstruction.sigmas.extend_from_slice(&sigmas);
            if progress(frame - frames.start + 1).is_break() {
                return Err(Error::Stopped { frame });
            }
        }
        Ok(reconstruction)
    }
}

/// Adds the frames before a start, in which nothing to start from was measured: the database's clip that the start was
/// taken from, played backwards from there; with growing uncertainty.
fn play_back(
    problem: &Problem<'_>,
    solver: &mut FrameSolver<'_>,
    begun: &Start,
    frames: &Range<usize>,
    reconstruction: &mut Reconstruction,
) {
    let mut track = begun.track.clone();
    let step = solver.step(&mut track, problem.observed(begun.frame));
    let mut uncertainty = Uncertainty::new(&problem.zero_pose_variance);
    let mut sigmas = vec![0.0; problem.database.num_dofs()];
    solver.standard_deviations(&mut uncertainty, &mut sigmas);
    track.copy_from(&begun.track);
    let mut found = Vec::new();
    for frame in (frames.start..begun.frame).rev() {
        if let Some(start) = begun.pose {
            let clip = &problem.database.clips()[problem.database.clip_at(start.pose)];
            // The track of a start ends in the pose before it.
            let pose = (start.pose + 1 + frame).saturating_sub(begun.frame);
            solver.place(
                &StartPose { pose: pose.max(clip.first_pose + problem.parameters.window), ..start },
                &mut track,
            );
        }
        let quality = FrameQuality {
            residual_m: 0.0,
            sigma_rad: solver.unmeasured_deviations(&mut uncertainty, &mut sigmas),
            energy: 0.0,
            neighbour_distance_deg: step.neighbour_distance,
            measured_points: 0,
        };
        if frame < frames.end {
            found.push((track.newest().to_vec(), sigmas.clone(), quality));
        }
    }
    for (pose, sigmas, quality) in found.into_iter().rev() {
        reconstruction.coordinates.extend(pose);
        reconstruction.sigmas.extend(sigmas);
        reconstruction.quality.push(quality);
    }
}
