//! Reconstruction of what is being measured now: a frame in, its pose out.

mod contest;
mod recent;
mod state;

use kinematics::State;
use model::Samples;
use nalgebra::Vector3;

use crate::frame_solver::FrameSolver;
use crate::problem::Problem;
use crate::track::{Observed, Step, Track};
use crate::uncertainty::Uncertainty;
use crate::{FrameQuality, Reconstructor, Result};
use contest::Contest;
use recent::Recent;
pub use state::MAX_LIVE_STATE_BYTES;

/// What is said to be farther from the origin than this (metres, in any direction) was not measured.
const MAX_DISTANCE_M: f64 = 1e5;

/// The pose of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LivePose<'a> {
    /// the skeleton file's own channels, metres and radians, shape `[dofs]`; angles do not jump from frame to frame
    pub pose: &'a [f64],
    /// smooth coordinates (see [`kinematics::Parametrisation::smooth`]), metres and radians, shape `[dofs]`
    pub coordinates: &'a [f64],
    /// positions of all joints in the world, metres, shape `[joints]`
    pub joint_positions: &'a [Vector3<f64>],
    /// how well it is known
    pub quality: FrameQuality,
    /// whether other poses are still being tried: the next one may be somewhere else
    pub is_starting: bool,
}

/// A performer who is being followed.
///
/// What [`Reconstructor::reconstruct`] does with frames that lie before it, this does with frames that come: each is
/// computed when it comes, from what came before. A frame costs about the same whenever it comes: starts and re-entries
/// after loss are spread over the frames, see [`Contest`]. Allocates nothing once made.
pub struct Live<'a> {
    problem: &'a Problem<'a>,
    solver: FrameSolver<'a>,
    /// who is being followed; stands nowhere until `has_leader`
    leader: Track,
    has_leader: bool,
    contest: Contest,
    recent: Recent,
    /// lost frames in a row
    lost: usize,
    positions: Vec<Vector3<f64>>,
    sigmas: Vec<f64>,
    /// the last pose in channels
    pose: Vec<f64>,
    next_pose: Vec<f64>,
    has_pose: bool,
    joints: State,
    deviations: Vec<f64>,
    uncertainty: Uncertainty,
}

impl<'a> Live<'a> {
    /// Follows a performer with the skeleton and points of `reconstructor`'s session, whose frames are not looked at.
    ///
    /// # Errors
    /// If the method's model is missing.
    pub fn new(reconstructor: &'a Reconstructor<'a>) -> Result<Self> {
        let problem = &reconstructor.problem;
        let Problem { database, session, parameters, kinematics, .. } = problem;
        let (dofs, points) = (database.num_dofs(), session.points.len());
        Ok(Self {
            problem,
            solver: FrameSolver::new(problem)?,
            leader: Track::blank(dofs, parameters),
            has_leader: false,
            contest: Contest::new(points, dofs, parameters),
            recent: Recent::new(points, parameters.start_frames),
            lost: 0,
            positions: vec![Vector3::zeros(); points],
            sigmas: vec![f64::NAN; points],
            pose: vec![0.0; dofs],
            next_pose: vec![0.0; dofs],
            has_pose: false,
            joints: kinematics.state(),
            deviations: vec![0.0; dofs],
            uncertainty: Uncertainty::new(&problem.zero_pose_variance),
        })
    }

    /// Takes one frame, 1/60 s after the one before, and gives its pose; `None` until a start was found, for which two points
    /// must be measured at once. `samples` has as many positions as the session has points; what is not a number or more
    /// than 100 km away was not measured.
    ///
    /// # Panics
    /// If the number of positions is another one.
    pub fn push(&mut self, samples: Samples<'_>) -> Option<LivePose<'_>> {
        assert_eq!(samples.positions.len(), self.positions.len(), "positions of a frame and control points");
        for (p, (to, from)) in self.positions.iter_mut().zip(samples.positions).enumerate() {
            let is_measured = from.iter().all(|v| v.abs() <= MAX_DISTANCE_M);
            *to = if is_measured { *from } else { Vector3::repeat(f64::NAN) };
            self.sigmas[p] = samples.sigma(p).filter(|s| *s > 0.0).unwrap_or(f64::NAN);
        }
        self.recent.push(&self.positions);
        if !self.has_leader {
            self.find_leader()?;
        }
        let step = self.step();
        if !self.leader.newest().iter().all(|v| v.is_finite()) {
            // Measurements that no arithmetic stands: nothing is known any more.
            self.forget();
            return None;
        }
        let quality = self.quality(&step);
        self.look_for_others(&step);
        self.write_pose();
        Some(LivePose {
            pose: &self.pose,
            coordinates: self.leader.newest(),
            joint_positions: &self.joints.positions,
            quality,
            is_starting: !self.contest.is_over(),
        })
    }

    /// Number of degrees of freedom of a pose.
    pub fn num_dofs(&self) -> usize {
        self.pose.len()
    }

    /// A first pose, once the database was searched for one.
    fn find_leader(&mut self) -> Option<()> {
        if self.contest.is_over() {
            if !self.recent.has_two() {
                return None;
            }
            self.contest.begin(&self.recent);
        }
        let first = self.contest.search(self.problem, &self.recent)?;
        self.has_leader = self.contest.take_first(&self.solver, &mut self.leader, first);
        self.uncertainty.restart();
        self.lost = 0;
        self.has_leader.then_some(())
    }

    /// All tracks one frame further, the leader's last: the solver then knows how sure it is.
    fn step(&mut self) -> Step {
        let samples = Samples { positions: &self.positions, sigmas: &self.sigmas };
        self.contest.step(&mut self.solver, samples);
        self.solver.step(&mut self.leader, Observed { now: samples, session: None })
    }

    fn quality(&mut self, step: &Step) -> FrameQuality {
        FrameQuality {
            residual_m: step.solution.residual_m,
            sigma_rad: self.solver.standard_deviations(&mut self.uncertainty, &mut self.deviations),
            energy: step.energy(),
            neighbour_distance_deg: step.neighbour_distance,
            measured_points: step.measured / 3,
        }
    }

    /// Goes on with the contest, and begins one when the leader has lost the way.
    fn look_for_others(&mut self, step: &Step) {
        let parameters = self.problem.parameters;
        self.lost = if step.energy() > parameters.lost_energy { self.lost + 1 } else { 0 };
        if self.contest.is_over() {
            if self.lost >= parameters.lost_frames && self.recent.has_two() {
                self.lost = 0;
                self.contest.begin(&self.recent);
            }
            return;
        }
        if self.contest.advance(self.problem, &self.recent, &self.solver, &mut self.leader, step) {
            self.uncertainty.restart();
        }
    }

    fn write_pose(&mut self) {
        let Problem { database, session, kinematics, .. } = self.problem;
        let x = self.leader.newest();
        let previous = self.has_pose.then_some(&self.pose[..]);
        let parametrisation = database.parametrisation();
        parametrisation.pose_from_coordinates(&session.skeleton, x, previous, &mut self.next_pose);
        std::mem::swap(&mut self.pose, &mut self.next_pose);
        self.has_pose = true;
        kinematics.update(x, &mut self.joints);
    }

    fn forget(&mut self) {
        self.has_leader = false;
        self.contest.end();
        self.recent.clear();
        self.lost = 0;
    }
}
