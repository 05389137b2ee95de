use kinematics::{ControlPoint, Kinematics, Parametrisation, PointSet, ROOT_DOFS, State};
use model::{Motion, PointTrajectories, Skeleton};
use nalgebra::Vector3;
use posterior::{ControlPoints, GaussianPrior, MapSolver, Measurement, SolverParameters};

use crate::targets::{Move, longest_way, moves};
use crate::{Contacts, DetectSettings, Error, Feet, POINTS, Result, detect};

/// How feet are held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoldSettings {
    /// what counts as standing
    pub detect: DetectSettings,
    /// frames before and after a contact over which a foot is let go
    pub ramp_frames: usize,
    /// a contact in which a point would have to move farther than this is not held, metres
    pub farthest_m: f64,
    /// standard deviation of a held point's coordinate, metres
    pub foot_sigma_m: f64,
    /// the same for the ball of a foot whose ankle is measured: the foot is short, and turns a lot to move its ball a little
    pub measured_foot_sigma_m: f64,
    /// standard deviation with which measured points stay where they are, metres
    pub control_sigma_m: f64,
    /// standard deviation with which angles of hips, knees and ankles stay as they are, radians
    pub leg_sigma_rad: f64,
    /// the same for a leg whose ankle is measured, radians
    pub measured_leg_sigma_rad: f64,
    /// standard deviation with which all other angles stay as they are, radians
    pub angle_sigma_rad: f64,
    /// standard deviation with which the root stays where it is, metres
    pub root_sigma_m: f64,
}

impl Default for HoldSettings {
    fn default() -> Self {
        Self {
            detect: DetectSettings::default(),
            ramp_frames: 5,
            farthest_m: 0.1,
            foot_sigma_m: 0.002,
            measured_foot_sigma_m: 0.004,
            control_sigma_m: 0.0005,
            leg_sigma_rad: 0.1,
            measured_leg_sigma_rad: 0.03,
            angle_sigma_rad: 0.005,
            root_sigma_m: 0.003,
        }
    }
}

/// A motion whose feet do not slide where they stand.
#[derive(Debug, Clone, PartialEq)]
pub struct Held {
    /// the motion; frames outside contacts and their ramps are what they were, bit by bit
    pub motion: Motion,
    /// the contacts: of what is held, and of measured ankles, which stay as they are
    pub contacts: Contacts,
    /// mean speed over the floor of what is held before, centimetres a second; `None` without contacts
    pub slide_before_cm_s: Option<f64>,
    /// the same after
    pub slide_after_cm_s: Option<f64>,
    /// of every frame, after: the fastest standing point, see [`crate::FootTracks::slides_cm_s`]
    pub slides_cm_s: Vec<Option<f64>>,
    /// frames that were changed
    pub frames_changed: usize,
}

/// Keeps standing feet of `motion` where they stand: for every frame of a contact, and a ramp on both sides, the pose
/// nearest to the motion's whose foot points are at the contact's place and whose measured points stay where they are.
///
/// `parametrisation`: coordinates in which poses are sought (see [`Parametrisation::smooth`]); `points`: the control
/// points; `trajectories`: their measured positions, frames as the motion's, of which only matters which were measured. An
/// ankle that was itself measured is not moved. The same arguments always give the same bits.
///
/// # Errors
/// If the skeleton has no known feet, or the trajectories have other frames.
pub fn hold_feet(
    motion: &Motion,
    parametrisation: &Parametrisation,
    points: &[ControlPoint],
    trajectories: &PointTrajectories,
    settings: &HoldSettings,
) -> Result<Held> {
    let frames = motion.num_frames();
    if trajectories.num_frames() != frames {
        return Err(Error::Frames { found: trajectories.num_frames(), expected: frames });
    }
    let feet = Feet::find(motion.skeleton())?;
    let tracks = feet.tracks(motion);
    let mut contacts = detect(&tracks, &settings.detect);
    contacts.retain(|contact| longest_way(&tracks, contact) <= settings.farthest_m);
    let moves = moves(&tracks, &contacts, settings.ramp_frames);

    let skeleton = motion.skeleton();
    let mut solver = FrameSolver::new(skeleton, parametrisation, &feet, points, settings);
    let mut values = motion.values().to_vec();
    let dofs = skeleton.num_dofs();
    let mut frames_changed = 0;
    for (frame, moves) in moves.iter().enumerate() {
        let is_measured = |p: usize| trajectories.position(frame, p).is_some();
        let pose = &mut values[frame * dofs..][..dofs];
        if solver.hold(skeleton, motion.pose(frame), moves, is_measured, pose) {
            frames_changed += 1;
        }
    }
    let mut free = contacts.clone();
    free.retain(|contact| {
        let is_measured = |p: usize| contact.frames.clone().any(|f| trajectories.position(f, p).is_some());
        !solver.same[contact.point].is_some_and(is_measured)
    });
    let motion = Motion::new(skeleton.clone(), motion.frame_rate(), values)?;
    let after = feet.tracks(&motion);
    Ok(Held {
        slide_before_cm_s: tracks.slide_cm_s(&free),
        slide_after_cm_s: after.slide_cm_s(&free),
        slides_cm_s: after.slides_cm_s(&free),
        motion,
        contacts,
        frames_changed,
    })
}

/// Solves one frame at a time, in memory that is kept.
struct FrameSolver<'a> {
    kinematics: Kinematics,
    points: PointSet,
    state: State,
    positions: Vec<Vector3<f64>>,
    likelihood: ControlPoints,
    solver: MapSolver,
    prior: GaussianPrior,
    targets: Vec<Option<Measurement>>,
    /// the measured point that each foot point is, if it is one
    same: [Option<usize>; POINTS],
    settings: &'a HoldSettings,
}

impl<'a> FrameSolver<'a> {
    fn new(
        skeleton: &Skeleton,
        parametrisation: &Parametrisation,
        feet: &Feet,
        controls: &[ControlPoint],
        settings: &'a HoldSettings,
    ) -> Self {
        let kinematics = Kinematics::new(skeleton, parametrisation.clone());
        let all: Vec<_> = feet.points().iter().chain(controls).cloned().collect();
        let points = PointSet::new(&kinematics, all);
        let is_same =
            |a: &ControlPoint, b: &ControlPoint| a.joint == b.joint && (a.offset - b.offset).norm() < 1e-6;
        let same = feet.points().each_ref().map(|foot| controls.iter().position(|c| is_same(foot, c)));
        let dofs = kinematics.num_dofs();
        let mut prior = GaussianPrior::new(dofs);
        let legs = [0, 2].map(|ankle: usize| match same[ankle] {
            Some(_) => settings.measured_leg_sigma_rad,
            None => settings.leg_sigma_rad,
        });
        for (dof, sigma) in sigmas(skeleton, parametrisation, feet, settings, legs).into_iter().enumerate() {
            prior.covariance[dof * dofs + dof] = sigma * sigma;
        }
        Self {
            state: kinematics.state(),
            positions: vec![Vector3::zeros(); points.len()],
            likelihood: ControlPoints::new(&kinematics, points.clone()),
            solver: MapSolver::new(points.len(), dofs),
            targets: vec![None; points.len()],
            kinematics,
            points,
            prior,
            same,
            settings,
        }
    }

    /// Moves the foot points of `pose` (channels) by `moves` and writes the pose found to `out`; `false`, and nothing
    /// written, if none is to be moved.
    fn hold(
        &mut self,
        skeleton: &Skeleton,
        pose: &[f64],
        moves: &[Option<Move>; POINTS],
        is_measured: impl Fn(usize) -> bool,
        out: &mut [f64],
    ) -> bool {
        let is_free = |foot: usize| !self.same[foot].is_some_and(&is_measured);
        if !(0..POINTS).any(|foot| moves[foot].is_some() && is_free(foot)) {
            return false;
        }
        let parametrisation = self.kinematics.parametrisation();
        parametrisation.coordinates_from_pose(skeleton, pose, 0.0, &mut self.prior.mean);
        self.points.positions(&self.kinematics, &self.prior.mean, &mut self.state, &mut self.positions);
        let (feet, controls) = self.targets.split_at_mut(POINTS);
        for (foot, target) in feet.iter_mut().enumerate() {
            *target = moves[foot].filter(|_| is_free(foot)).map(|wanted| Measurement {
                position: self.positions[foot] + wanted.by,
                sigma: match self.same[foot / 2 * 2] {
                    Some(_) => self.settings.measured_foot_sigma_m,
                    None => self.settings.foot_sigma_m,
                } / wanted.firmness.powi(2),
            });
        }
        for (c, target) in controls.iter_mut().enumerate() {
            *target = is_measured(c).then(|| Measurement {
                position: self.positions[POINTS + c],
                sigma: self.settings.control_sigma_m,
            });
        }
        let parameters = SolverParameters { max_steps: 20, relative_decrease: 1e-6 };
        self.solver.solve(&self.kinematics, &mut self.likelihood, &self.targets, &self.prior, &parameters);
        // Of all angles that stand for the pose, those nearest to the frame's own.
        parametrisation.pose_from_coordinates(skeleton, self.solver.coordinates(), Some(pose), out);
        true
    }
}

/// How firmly each coordinate stays, radians and metres; `legs`: of left and right leg, radians.
fn sigmas(
    skeleton: &Skeleton,
    parametrisation: &Parametrisation,
    feet: &Feet,
    settings: &HoldSettings,
    legs: [f64; 2],
) -> Vec<f64> {
    let sigma =
        |dof| if parametrisation.is_angle(dof) { settings.angle_sigma_rad } else { settings.root_sigma_m };
    let mut sigmas: Vec<f64> = (0..skeleton.num_dofs()).map(sigma).collect();
    for (point, foot) in feet.points().iter().enumerate() {
        let mut joint = foot.joint;
        while let Some(parent) = skeleton.joints()[joint].parent {
            for dof in skeleton.dofs(joint).filter(|d| *d >= ROOT_DOFS && parametrisation.is_angle(*d)) {
                sigmas[dof] = legs[point / 2];
            }
            joint = parent;
        }
    }
    sigmas
}
