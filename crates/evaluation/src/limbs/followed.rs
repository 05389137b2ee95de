use body::{BodyModel, Shape};
use inverse_kinematics::{Evidence, ImageView, Solver, SupportWidth, flesh::along};
use nalgebra::Vector3;

use super::limb::{self, Build, Limb};
use super::{Limbs, Method};
use crate::recording::{LIMBS, rig_joints};
use crate::{Error, Result};

/// One limb being followed by one method.
pub(super) struct FollowedLimb {
    pub limb: Limb,
    pub solver: Solver,
    /// the last solution
    pub x: Vec<f64>,
    /// place of the inner joint, metres
    pub found: Vector3<f64>,
    /// preferred
    pub posture: Vec<f64>,
    /// the rig's joints: base, inner, end
    pub bones: [usize; 3],
    /// cameras, by number
    pub views: Vec<usize>,
    swivels: Vec<f64>,
    pub width: SupportWidth,
    is_started: bool,
}

impl FollowedLimb {
    pub fn new(
        model: &BodyModel,
        shape: &Shape,
        limbs: Limbs,
        index: usize,
        method: &Method,
    ) -> Result<Self> {
        let bones = rig_joints(model, LIMBS[index].1)?;
        let [base, inner, end] = bones.map(|joint| shape.joints[joint]);
        let dofs = model.rig().dofs();
        let joint_dofs = |joint: usize| dofs.iter().filter(move |dof| dof.joint == joint);
        // the rig's last rotation at the base is about the bone, the only one of the inner joint is its hinge
        let missing = Error::MissingJoint { name: LIMBS[index].1[1] };
        let (twist, hinge) =
            joint_dofs(bones[0]).next_back().zip(joint_dofs(bones[1]).next()).ok_or(missing)?;
        let free = [f64::NEG_INFINITY, f64::INFINITY];
        let limits = |dof: &body::Dof| dof.limits.filter(|_| method.has_limits).unwrap_or(free);
        let limb = Limb::new(&Build {
            upper: inner - base,
            lower: end - inner,
            hinge: hinge.axis,
            bend: limits(hinge),
            twist: limits(twist),
            play: if method.has_limits { PLAY } else { f64::INFINITY },
            half_width_m: method.width.inside_m,
            upper_flesh: along(model, shape, bones[0], &(inner - base)),
            lower_flesh: along(model, shape, bones[1], &(end - inner)),
        })?;
        let mut posture = vec![0.0; limb::DOFS];
        posture[limb::LOWER] = limbs.neutral_bend();
        Ok(Self {
            solver: Solver::new(limb.chain.clone(), method.options.clone())?,
            limb,
            x: posture.clone(),
            found: Vector3::zeros(),
            posture,
            bones,
            views: method.cameras.clone(),
            swivels: method.swivels.clone(),
            width: method.width,
            is_started: false,
        })
    }

    /// One frame; returns how far the end is from its target, metres.
    pub fn solve(
        &mut self,
        base: &Vector3<f64>,
        end: &Vector3<f64>,
        heading: f64,
        views: &[ImageView],
    ) -> Result<f64> {
        for x in [&mut self.x, &mut self.posture] {
            limb::place(x, base, heading);
        }
        let mut targets = vec![None; self.solver.chain().points().len()];
        targets[limb::END] = Some(*end);
        let posture = self.posture.clone();
        let evidence = Evidence { targets: &targets, views, posture: &posture };
        if self.is_started {
            let swivels = self.swivels.clone();
            let residual_m = self.find(&swivels, base, end, &evidence)?;
            if residual_m < LOST_M {
                return Ok(residual_m);
            }
        }
        self.is_started = true;
        self.x.copy_from_slice(&self.posture);
        let around = (0..STARTS).map(|turn| f64::from(turn) * std::f64::consts::TAU / f64::from(STARTS));
        self.find(&around.collect::<Vec<_>>(), base, end, &evidence)
    }

    /// Solves from the last solution turned about the line from base to end, and keeps the best; returns how far the end is
    /// from its target, metres. Without images the first turn is the only one.
    fn find(
        &mut self,
        turns: &[f64],
        base: &Vector3<f64>,
        end: &Vector3<f64>,
        evidence: &Evidence<'_>,
    ) -> Result<f64> {
        let turns = if evidence.views.is_empty() { &turns[..1] } else { turns };
        let start = self.x.clone();
        let mut best = f64::NEG_INFINITY;
        let mut residual_m = 0.0;
        for &turn in turns {
            let mut x = start.clone();
            self.limb.swivel(&mut x, &(end - base), turn);
            let outcome = self.solver.solve(&mut x, evidence)?;
            // what the images and the posture say of it, and whether it reaches the end
            let score = self.solver.criterion(&x, evidence) - 10.0 * outcome.residual_m;
            if score > best + if best.is_finite() { MARGIN } else { 0.0 } {
                best = score;
                residual_m = outcome.residual_m;
                self.found = self.solver.positions()[limb::INNER];
                self.x = x;
            }
        }
        Ok(residual_m)
    }
}

/// An end effector farther than this from its target, metres, starts the limb anew: it ran into its limits.
const LOST_M: f64 = 0.002;
/// How far elbows and knees give way about other axes than their hinge, radians.
const PLAY: f64 = 0.02;
/// Number of elbow positions, around the line from base to end, that the first frame is started from.
const STARTS: u32 = 8;
/// How much more another elbow must agree with the evidence.
const MARGIN: f64 = 0.02;
