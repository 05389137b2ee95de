use std::sync::atomic::{AtomicBool, Ordering};

use body::{BodyModel, Posed};
use model::Silhouette;
use nalgebra::Vector3;
use rayon::prelude::*;
use shape_fit::limb_dofs;
use vision::{Rasteriser, Topology, View};

use crate::{
    Error, Misalignment, ObservedFrame, Options, Part, Parzen, PoseSpace, Result, Search, Stage,
    built_in_poses,
    lift::Lifter,
    local::{Local, Problem},
    misalignment::Judge,
    particles::{Particles, Space},
    predict::{unwind, wound},
    predicted,
};

/// The pose of a frame and how well it fits.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracked {
    /// number of the frame in the session
    pub frame: usize,
    /// root translation (metres), rotation vector and angles (radians), shape `[dofs]`; the vector goes on beyond half a turn,
    /// with the whole turns that bring it nearest to that of the frame before
    pub pose: Vec<f64>,
    /// joints in their pose, metres, in the order of the model's rig
    pub joints: Vec<Vector3<f64>>,
    /// intersection over union of the body and each camera's cleaned silhouette, `None` where nobody was seen, shape
    /// `[cameras]`
    pub ious: Vec<Option<f64>>,
    /// how every limb fits
    pub misalignment: Misalignment,
    /// what gave the pose
    pub stage: Stage,
    /// of the particles of the last search, `None` without one
    pub effective_sample_size: Option<f64>,
}

impl Tracked {
    /// Mean of the cameras that see somebody; 0 if none does.
    pub fn mean_iou(&self) -> f64 {
        let seen: Vec<f64> = self.ious.iter().flatten().copied().collect();
        seen.iter().sum::<f64>() / seen.len().max(1) as f64
    }
}

/// Ways to search, in the order in which they are tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Attempt {
    AsAsked,
    LimbByLimb,
}

/// Limbs are searched one by one where an error is still above this many times the threshold.
const FAR: f64 = 2.5;

/// Tracks one person of known shape from frame to frame.
pub struct Tracker<'a> {
    model: &'a BodyModel,
    topology: Topology,
    options: Options,
    training_poses: Vec<Vec<f64>>,
    parzen: Parzen,
    pose_space: PoseSpace,
    local: Local,
    judge: Judge,
    particles: Particles,
    lifter: Lifter,
    before: Vec<f64>,
    last: Vec<f64>,
    /// the last pose as it was told, with whole turns
    told: Vec<f64>,
}

impl<'a> Tracker<'a> {
    /// Begins with a shape (coefficients, standard deviations; missing ones are 0) and the pose of the first frame, with the
    /// built-in poses as the prior's.
    ///
    /// # Errors
    /// [`Error::Shape`], [`Error::Pose`] or [`Error::Option`] if one of them is invalid.
    pub fn new(model: &'a BodyModel, alpha: &[f64], start: &[f64], options: Options) -> Result<Self> {
        Self::with_training_poses(model, alpha, start, options, built_in_poses(model))
    }

    /// The same with training poses of shape `[poses][dofs]`, about a hundred.
    ///
    /// # Errors
    /// As [`new`](Self::new), or [`Error::TrainingPoses`].
    pub fn with_training_poses(
        model: &'a BodyModel,
        alpha: &[f64],
        start: &[f64],
        options: Options,
        training_poses: Vec<Vec<f64>>,
    ) -> Result<Self> {
        options.check()?;
        if alpha.len() > model.num_components() || alpha.iter().any(|x| !x.is_finite()) {
            return Err(Error::Shape { found: alpha.len(), expected: model.num_components() });
        }
        check_pose(model, start)?;
        Ok(Self {
            model,
            topology: Topology::new(model.faces(), model.num_vertices()),
            options,
            parzen: Parzen::new(model, &training_poses)?,
            pose_space: PoseSpace::new(model, &training_poses)?,
            training_poses,
            local: Local::new(model.shape(alpha)),
            judge: Judge::default(),
            particles: Particles::default(),
            lifter: Lifter::default(),
            before: wound(start),
            last: wound(start),
            told: start.to_vec(),
        })
    }

    /// Takes up a pose of a frame that wasn't tracked, such as a key frame; there is no velocity then.
    ///
    /// # Errors
    /// [`Error::Pose`] if it is of another rig.
    pub fn restart(&mut self, pose: &[f64]) -> Result<()> {
        check_pose(self.model, pose)?;
        (self.before, self.last) = (wound(pose), wound(pose));
        self.told = pose.to_vec();
        self.lifter.forget();
        Ok(())
    }

    /// The pose of the last frame, shape `[dofs]`.
    pub fn pose(&self) -> &[f64] {
        &self.told
    }

    /// The same for a frame whose number is known, so that matches may lead back to it.
    ///
    /// # Errors
    /// [`Error::Pose`] if it is of another rig.
    pub fn restart_at(&mut self, frame: usize, pose: &[f64]) -> Result<()> {
        self.restart(pose)?;
        self.lifter.remember(frame, pose, &Misalignment::from_errors([0.0; 10], f64::INFINITY));
        Ok(())
    }

    /// The model.
    pub fn model(&self) -> &'a BodyModel {
        self.model
    }

    /// The pose that is expected in the next frame, shape `[dofs]`.
    pub fn prediction(&self) -> Vec<f64> {
        predicted(self.model, &self.before, &self.last)
    }

    /// Tracks the next frame: local optimisation, misalignment, particles only if a limb is misaligned, local optimisation
    /// again. Inside the frame `stop` is looked at before every iteration.
    ///
    /// # Errors
    /// [`Error::Stopped`] if `stop` became true; the tracker is as before the frame then.
    pub fn track(&mut self, frame: &ObservedFrame, stop: &AtomicBool) -> Result<Tracked> {
        let stopped = Error::Stopped { frame: frame.index };
        if frame.num_views() == 0 {
            return Ok(self.unseen(frame));
        }
        let prediction = self.prediction();
        let last = self.last.clone();
        let goes_on = || !stop.load(Ordering::Relaxed);
        let starts = [prediction.as_slice(), last.as_slice()];
        let mut pose = self.optimise(frame, &prediction, &starts, &goes_on).ok_or(stopped.clone())?;
        let mut misalignment = self.misalignment(frame, &pose);
        let (mut stage, mut effective_sample_size) = (Stage::Local, None);
        if misalignment.any() {
            for attempt in [Attempt::AsAsked, Attempt::LimbByLimb] {
                let is_far = misalignment.worst_m() > FAR * self.options.misaligned_m;
                if !misalignment.any() || attempt == Attempt::LimbByLimb && !is_far {
                    break;
                }
                let found = self.attempt(frame, &prediction, &pose, &misalignment, attempt, &goes_on);
                let Some(found) = found.ok_or(stopped.clone())? else { break };
                effective_sample_size = Some(found.effective_sample_size);
                let optimised = self.optimise(frame, &prediction, &[&found.pose], &goes_on);
                let optimised = optimised.ok_or(stopped.clone())?;
                let after = self.misalignment(frame, &optimised);
                if after.total_m() < misalignment.total_m() {
                    (pose, misalignment) = (optimised, after);
                }
            }
            stage = if misalignment.any() { Stage::Misaligned } else { Stage::Particles };
        }
        self.before = std::mem::replace(&mut self.last, wound(&pose));
        if stage != Stage::Local {
            // a jump from a wrong pose to a right one is not a velocity
            self.before.clone_from(&self.last);
        }
        self.lifter.remember(frame.index, &self.last, &misalignment);
        Ok(self.tracked(frame, misalignment, stage, effective_sample_size))
    }

    /// Local optimisation: the pose that a frame's contours, and its matches with frames that were tracked, pull the best of
    /// several starts to, with the prior about `prediction`. `None` if `goes_on` said no.
    pub fn optimise(
        &mut self,
        frame: &ObservedFrame,
        prediction: &[f64],
        starts: &[&[f64]],
        goes_on: &dyn Fn() -> bool,
    ) -> Option<Vec<f64>> {
        let points = match &self.local.body.shape {
            Some(shape) => self.lifter.lift(self.model, &self.topology, shape, frame),
            None => vec![Vec::new(); frame.num_views()],
        };
        let problem = Problem {
            model: self.model,
            topology: &self.topology,
            frame,
            points: &points,
            predicted: prediction,
            options: &self.options.fit,
        };
        self.local.optimise(&problem, starts, goes_on)
    }

    /// How every limb of a pose fits a frame.
    pub fn misalignment(&mut self, frame: &ObservedFrame, pose: &[f64]) -> Misalignment {
        self.local.body.pose(self.model, pose);
        let vertices = &self.local.body.posed.vertices;
        let errors = self.judge.errors(self.model, &self.topology, frame, vertices);
        Misalignment::from_errors(errors, self.options.misaligned_m)
    }

    /// Searches by particles from a pose. `None` if `goes_on` said no; `Some(None)` if there is nothing to search: no DOF moves
    /// what is misaligned, or [`Options::particles`] is `None`.
    pub fn search(
        &mut self,
        frame: &ObservedFrame,
        prediction: &[f64],
        start: &[f64],
        misalignment: &Misalignment,
        goes_on: &dyn Fn() -> bool,
    ) -> Option<Option<Search>> {
        let part = self.options.particles.map_or(Part::Misaligned, |particles| particles.part);
        let dofs = match part {
            Part::Misaligned => misalignment.dofs(self.model),
            Part::Whole => (0..self.model.rig().num_dofs()).collect(),
        };
        self.search_dofs(frame, prediction, start, &dofs, goes_on)
    }

    /// One way to search: as [`search`](Self::search), or arms and legs one after the other, each from what the one before
    /// found, for limbs that were blamed for another's error.
    fn attempt(
        &mut self,
        frame: &ObservedFrame,
        prediction: &[f64],
        start: &[f64],
        misalignment: &Misalignment,
        attempt: Attempt,
        goes_on: &dyn Fn() -> bool,
    ) -> Option<Option<Search>> {
        if attempt == Attempt::AsAsked {
            return self.search(frame, prediction, start, misalignment, goes_on);
        }
        let mut found: Option<Search> = None;
        for limb in limb_dofs(self.model) {
            let dofs: Vec<usize> = limb.into_iter().flatten().collect();
            let from = found.as_ref().map_or(start, |found| &found.pose).to_vec();
            // the first particle is the start, so that nothing gets worse
            if let Some(better) = self.search_dofs(frame, prediction, &from, &dofs, goes_on)? {
                found = Some(better);
            }
        }
        Some(found)
    }

    /// As [`search`](Self::search), over the DOFs of these indices.
    pub fn search_dofs(
        &mut self,
        frame: &ObservedFrame,
        prediction: &[f64],
        start: &[f64],
        dofs: &[usize],
        goes_on: &dyn Fn() -> bool,
    ) -> Option<Option<Search>> {
        let Some(options) = &self.options.particles else { return Some(None) };
        let Some(shape) = &self.local.body.shape else { return Some(None) };
        if dofs.is_empty() {
            return Some(None);
        }
        let space = Space {
            model: self.model,
            topology: &self.topology,
            shape,
            frame,
            start,
            predicted: prediction,
            dofs,
            parzen: &self.parzen,
            pose_space: &self.pose_space,
            training_poses: &self.training_poses,
            options,
        };
        self.particles.search(&space, goes_on).map(Some)
    }

    fn unseen(&mut self, frame: &ObservedFrame) -> Tracked {
        self.before.clone_from(&self.last);
        self.tracked(frame, Misalignment::from_errors([0.0; 10], f64::INFINITY), Stage::Unseen, None)
    }

    /// The last pose as a result.
    fn tracked(
        &mut self,
        frame: &ObservedFrame,
        misalignment: Misalignment,
        stage: Stage,
        effective_sample_size: Option<f64>,
    ) -> Tracked {
        self.local.body.pose(self.model, &self.last);
        let Posed { vertices, joints, .. } = &self.local.body.posed;
        let draw = |view: &crate::observed_frame::ObservedView| {
            let mut drawn = Silhouette::empty(0, 0);
            let full = View::new(&view.observation.camera);
            Rasteriser::new().silhouette(&full, vertices, &self.topology, &mut drawn);
            drawn.iou(&view.observation.silhouette)
        };
        let found: Vec<f64> = frame.views.par_iter().map(draw).collect();
        let mut ious = vec![None; frame.num_cameras()];
        frame.views.iter().zip(found).for_each(|(view, iou)| ious[view.camera] = Some(iou));
        let mut pose = self.last.clone();
        unwind(&mut pose, &self.told);
        self.told.clone_from(&pose);
        Tracked {
            frame: frame.index,
            pose,
            joints: joints.clone(),
            ious,
            misalignment,
            stage,
            effective_sample_size,
        }
    }
}

fn check_pose(model: &BodyModel, pose: &[f64]) -> Result<()> {
    let expected = model.rig().num_dofs();
    if pose.len() != expected || pose.iter().any(|x| !x.is_finite()) {
        return Err(Error::Pose { found: pose.len(), expected });
    }
    Ok(())
}
