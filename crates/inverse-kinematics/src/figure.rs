//! The figure: a morphable body or a skeleton, with the points of it that were measured.

use std::sync::Arc;

use body::{BodyModel, Dof, Shape};
use kinematics::{ControlPoint, Parametrisation, References};
use model::Skeleton;
use nalgebra::Vector3;

use crate::rig::{self, RigChain};
use crate::sequence::{FigureChain, SequenceSolver, Solved};
use crate::{Chain, Error, Method, Result, SupportWidth};

/// How far elbows and knees are bent where nothing else is known, radians.
const BENT: f64 = 0.3;

/// A body or a skeleton whose frames are solved.
#[derive(Debug, Clone)]
pub struct Figure {
    body: FigureChain,
    kind: Kind,
    /// indices among the chain's points of what was measured, in the order of the targets
    targeted: Vec<usize>,
    joint_names: Vec<String>,
    dof_names: Vec<String>,
}

#[derive(Debug, Clone)]
enum Kind {
    Body { rig: Box<RigChain>, dofs: usize },
    Skeleton { skeleton: Arc<Skeleton>, parametrisation: Parametrisation },
}

impl Figure {
    /// A body of a model. `measured`: its points that may be measured; their joints are the rig's, offsets are in metres
    /// along the axes of the rest pose.
    ///
    /// # Errors
    /// If the rig is none that a skeleton can be.
    pub fn body(model: &BodyModel, shape: &Shape, measured: &[ControlPoint]) -> Result<Self> {
        let rig = RigChain::with_points(model, shape, measured)?;
        let joints = model.rig().num_joints();
        let mut pose = vec![0.0; model.rig().num_dofs()];
        for (value, dof) in pose.iter_mut().zip(model.rig().dofs()) {
            *value = neutral(model, dof);
        }
        let mut neutral = vec![0.0; rig.chain.num_dofs()];
        rig.coordinates(&pose, &mut neutral);
        let body = FigureChain {
            chain: rig.chain.clone(),
            neutral,
            twists: rig.twists().to_vec(),
            width: rig::WIDTH,
        };
        Ok(Self {
            body,
            targeted: (joints..joints + measured.len()).collect(),
            joint_names: model.rig().joints().iter().map(|joint| joint.name.clone()).collect(),
            dof_names: model.rig().dofs().iter().map(|dof| dof.name.clone()).collect(),
            kind: Kind::Body { rig: Box::new(rig), dofs: pose.len() },
        })
    }

    /// A skeleton with a free root: bones for images, no limits, at rest where nothing else is known.
    ///
    /// # Errors
    /// If the root does not have three translations and three rotations.
    pub fn skeleton(skeleton: &Arc<Skeleton>, measured: &[ControlPoint]) -> Result<Self> {
        let joints = skeleton.joints();
        let at_joint = |(index, joint): (usize, &model::Joint)| ControlPoint {
            name: joint.name.clone(),
            joint: index,
            offset: Vector3::zeros(),
        };
        let points: Vec<_> =
            joints.iter().enumerate().map(at_joint).chain(measured.iter().cloned()).collect();
        let bones = joints.iter().enumerate().filter(|(_, joint)| joint.offset.norm() > 0.01);
        let segments = bones.filter_map(|(index, joint)| Some([joint.parent?, index])).collect();
        let parametrisation = Parametrisation::smooth(skeleton, &References::rest(skeleton))?;
        let chain = Chain::new(skeleton, parametrisation.clone(), points)?.with_segments(segments)?;
        let neutral = vec![0.0; chain.num_dofs()];
        Ok(Self {
            body: FigureChain { chain, neutral, twists: Vec::new(), width: SupportWidth::default() },
            kind: Kind::Skeleton { skeleton: skeleton.clone(), parametrisation },
            targeted: (joints.len()..joints.len() + measured.len()).collect(),
            joint_names: joints.iter().map(|joint| joint.name.clone()).collect(),
            dof_names: skeleton.dof_names(),
        })
    }

    /// A solver of its frames; `steps`: most of one solve.
    ///
    /// # Errors
    /// [`Error::NoPoints`] if nothing of it is measured, [`Error::Setting`] if there is no step.
    pub fn solver(&self, method: Method, steps: usize) -> Result<SequenceSolver> {
        if self.targeted.is_empty() {
            return Err(Error::NoPoints);
        }
        if steps == 0 {
            return Err(Error::Setting { name: "steps", value: 0.0, expected: "1 or more" });
        }
        SequenceSolver::new(self.body.clone(), &self.targeted, method, steps)
    }

    /// The targets of a frame. `measured`: metres, in the order of the points that the figure was made with; what is not finite
    /// was not measured.
    pub fn targets(&self, measured: &[Vector3<f64>]) -> Vec<Option<Vector3<f64>>> {
        let mut targets = vec![None; self.body.chain.points().len()];
        for (&point, position) in self.targeted.iter().zip(measured) {
            targets[point] = Some(*position).filter(|position| position.iter().all(|v| v.is_finite()));
        }
        targets
    }

    /// The pose of a solution: of a body as its model takes it, of a skeleton its channels, nearest to those of `previous`.
    pub fn pose(&self, solved: &Solved, previous: Option<&[f64]>) -> Vec<f64> {
        match &self.kind {
            Kind::Body { rig, dofs } => {
                let mut pose = vec![0.0; *dofs];
                rig.pose(&solved.x, &mut pose);
                pose
            }
            Kind::Skeleton { skeleton, parametrisation } => {
                let mut pose = vec![0.0; solved.x.len()];
                parametrisation.pose_from_coordinates(skeleton, &solved.x, previous, &mut pose);
                pose
            }
        }
    }

    /// Positions of all joints, metres, in the order of [`joint_names`](Self::joint_names).
    pub fn joints<'a>(&self, solved: &'a Solved) -> &'a [Vector3<f64>] {
        &solved.positions[..self.joint_names.len()]
    }

    /// Names of the joints.
    pub fn joint_names(&self) -> &[String] {
        &self.joint_names
    }

    /// Names of the numbers of a pose.
    pub fn dof_names(&self) -> &[String] {
        &self.dof_names
    }
}

/// Where a DOF of a standing body is: arms hang, elbows and knees are a little bent.
fn neutral(model: &BodyModel, dof: &Dof) -> f64 {
    let Some([low, high]) = dof.limits else { return 0.0 };
    let hinges = model.rig().dofs().iter().filter(|other| other.joint == dof.joint).count();
    if hinges == 1 { BENT.clamp(low, high) } else { 0.0f64.clamp(low, high) }
}
