use model::Skeleton;
use nalgebra::Vector3;

use crate::{Error, Kinematics, Result, State};

/// A point rigidly fixed to a joint.
#[derive(Debug, Clone, PartialEq)]
pub struct ControlPoint {
    /// name, as in the trajectories
    pub name: String,
    /// index of the joint
    pub joint: usize,
    /// position in the joint's frame, metres
    pub offset: Vector3<f64>,
}

/// The papers' control points and the joints that may stand for each, with `true` where the far end of the
/// joint's bone is meant: names of the CMU skeleton first, then those of common BVH rigs and of
/// morphable bodies.
const STANDARD: [(&str, &[(&str, bool)]); 6] = [
    (
        "left_wrist",
        &[
            ("lhand", false),
            ("LeftHand", false),
            ("mixamorig:LeftHand", false),
            ("LeftWrist", false),
            ("l_wrist", false),
        ],
    ),
    (
        "right_wrist",
        &[
            ("rhand", false),
            ("RightHand", false),
            ("mixamorig:RightHand", false),
            ("RightWrist", false),
            ("r_wrist", false),
        ],
    ),
    (
        "left_ankle",
        &[
            ("lfoot", false),
            ("LeftFoot", false),
            ("mixamorig:LeftFoot", false),
            ("LeftAnkle", false),
            ("l_ankle", false),
        ],
    ),
    (
        "right_ankle",
        &[
            ("rfoot", false),
            ("RightFoot", false),
            ("mixamorig:RightFoot", false),
            ("RightAnkle", false),
            ("r_ankle", false),
        ],
    ),
    ("root", &[("root", false), ("Hips", false), ("hip", false), ("mixamorig:Hips", false)]),
    ("head", &[("head", true), ("Head", true), ("mixamorig:Head", true)]),
];

/// Finds control points by name: one of the papers' six (`left_wrist right_wrist left_ankle right_ankle root head`), the
/// name of a joint (the point is the joint), or `joint.tip` (the far end of its bone).
///
/// # Errors
/// [`Error::UnknownPoint`] if a name is none of these.
pub fn control_points<S: AsRef<str>>(skeleton: &Skeleton, names: &[S]) -> Result<Vec<ControlPoint>> {
    names.iter().map(|name| control_point(skeleton, name.as_ref())).collect()
}

fn control_point(skeleton: &Skeleton, name: &str) -> Result<ControlPoint> {
    let at = |joint: usize, tip: bool| ControlPoint {
        name: name.to_owned(),
        joint,
        offset: if tip { skeleton.joints()[joint].tip } else { Vector3::zeros() },
    };
    if let Some((_, candidates)) = STANDARD.iter().find(|(standard, _)| *standard == name) {
        let found = candidates.iter().find_map(|(joint, tip)| Some(at(skeleton.joint_index(joint)?, *tip)));
        if let Some(found) = found {
            return Ok(found);
        }
        if name == "root" {
            return Ok(at(0, false));
        }
    }
    if let Some(joint) = skeleton.joint_index(name) {
        return Ok(at(joint, false));
    }
    if let Some(joint) = name.strip_suffix(".tip").and_then(|joint| skeleton.joint_index(joint)) {
        return Ok(at(joint, true));
    }
    let standard = STANDARD.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    Err(Error::UnknownPoint {
        name: name.to_owned(),
        known: format!("{standard}, a joint's name, or joint.tip"),
    })
}

/// Points of a skeleton, with the joints and coordinates that move them worked out once.
#[derive(Debug, Clone)]
pub struct PointSet {
    pub(crate) points: Vec<ControlPoint>,
    /// joints on the way from the root to any point, parents first
    pub(crate) joints: Vec<usize>,
    /// coordinates that move each point
    pub(crate) dofs: Vec<Vec<usize>>,
}

impl PointSet {
    /// Prepares `points` for repeated evaluation on `kinematics`.
    pub fn new(kinematics: &Kinematics, points: Vec<ControlPoint>) -> Self {
        let mut needed = vec![false; kinematics.num_joints()];
        let mut dofs = Vec::with_capacity(points.len());
        for point in &points {
            let mut chain = vec![false; kinematics.num_joints()];
            let mut joint = Some(point.joint);
            while let Some(j) = joint {
                chain[j] = true;
                needed[j] = true;
                joint = kinematics.joints[j].parent;
            }
            let at_joint = point.offset == Vector3::zeros();
            // A point in the pivot of its own joint is not moved by that joint's rotations.
            let moves = |dof: &usize| {
                let d = kinematics.dofs[*dof];
                chain[d.joint] && !(at_joint && d.joint == point.joint && !d.is_translation)
            };
            dofs.push((0..kinematics.num_dofs()).filter(moves).collect());
        }
        let joints = (0..kinematics.num_joints()).filter(|&j| needed[j]).collect();
        Self { points, joints, dofs }
    }

    /// The points.
    pub fn points(&self) -> &[ControlPoint] {
        &self.points
    }

    /// Number of points P.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The coordinates that move a point, in rising order.
    pub fn moved_by(&self, point: usize) -> &[usize] {
        &self.dofs[point]
    }

    /// World positions, metres, shape `[points]`, of coordinates `x`. Fills `state` for the joints on the way.
    pub fn positions(&self, kinematics: &Kinematics, x: &[f64], state: &mut State, out: &mut [Vector3<f64>]) {
        kinematics.update_joints(&self.joints, x, state);
        for (out, point) in out.iter_mut().zip(&self.points) {
            *out = state.point(point.joint, &point.offset);
        }
    }
}
