//! The text form of a rig: `rig.json` beside a template, and the head of a model's file.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::{Dof, DofKind, Error, JointRegressor, Result, Rig, RigJoint};

/// Longest text that is read, bytes.
const MAX_BYTES: usize = 8 << 20;

/// A rig as text: joints, degrees of freedom, and how joints are computed from vertices.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RigFile {
    joints: Vec<JointRecord>,
    /// joint name → vertices and weights; absent where the joints are to be found by other means
    #[serde(default)]
    joint_regressor: BTreeMap<String, RowRecord>,
    dofs: Vec<DofRecord>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct JointRecord {
    name: String,
    /// −1 for the root
    parent: i64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rest: Option<[f64; 3]>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct RowRecord {
    vertices: Vec<u32>,
    weights: Vec<f32>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct DofRecord {
    name: String,
    joint: String,
    kind: DofKind,
    axis: [f64; 3],
    min: Option<f64>,
    max: Option<f64>,
}

impl RigFile {
    /// Reads the JSON text of `rig.json`; fields that aren't known are skipped.
    ///
    /// # Errors
    /// [`Error::Rig`] says where the text is wrong.
    pub fn parse(text: &[u8]) -> Result<Self> {
        if text.len() > MAX_BYTES {
            return Err(Error::Rig { what: format!("{} bytes, expected at most {MAX_BYTES}", text.len()) });
        }
        serde_json::from_slice(text).map_err(|e| Error::Rig { what: e.to_string() })
    }

    /// The rig and its regressor as text.
    pub(crate) fn from_parts(rig: &Rig, regressor: &JointRegressor) -> Self {
        let name = |joint: usize| rig.joints()[joint].name.clone();
        let joint = |joint: &RigJoint| JointRecord {
            name: joint.name.clone(),
            parent: joint.parent.map_or(-1, |parent| parent as i64),
            rest: None,
        };
        let dof = |dof: &Dof| DofRecord {
            name: dof.name.clone(),
            joint: name(dof.joint),
            kind: dof.kind,
            axis: dof.axis.into(),
            min: dof.limits.map(|[low, _]| low),
            max: dof.limits.map(|[_, high]| high),
        };
        let row = |joint: usize| {
            let (vertices, weights) = regressor.row(joint).iter().copied().unzip();
            (name(joint), RowRecord { vertices, weights })
        };
        Self {
            joints: rig.joints().iter().map(joint).collect(),
            joint_regressor: (0..rig.num_joints()).map(row).collect(),
            dofs: rig.dofs().iter().map(dof).collect(),
        }
    }

    /// Joints and degrees of freedom, checked.
    ///
    /// # Errors
    /// [`Error::Rig`] names the joint or DOF that is wrong.
    pub fn rig(&self) -> Result<Rig> {
        let fail = |what: String| Err(Error::Rig { what });
        let mut joints = Vec::new();
        for joint in &self.joints {
            let parent = match joint.parent {
                -1 => None,
                parent => match usize::try_from(parent) {
                    Ok(parent) => Some(parent),
                    Err(_) => return fail(format!("joint {} has parent {parent}", joint.name)),
                },
            };
            joints.push(RigJoint { name: joint.name.clone(), parent });
        }
        let mut dofs = Vec::new();
        for dof in &self.dofs {
            let Some(joint) = joints.iter().position(|joint| joint.name == dof.joint) else {
                return fail(format!("DOF {} turns {}, which is not a joint", dof.name, dof.joint));
            };
            let limits = match (dof.min, dof.max) {
                (None, None) => None,
                (Some(low), Some(high)) => Some([low, high]),
                _ => return fail(format!("DOF {} has one limit, expected two or none", dof.name)),
            };
            let (name, kind) = (dof.name.clone(), dof.kind);
            dofs.push(Dof { name, joint, kind, axis: Vector3::from(dof.axis), limits });
        }
        Rig::new(joints, dofs)
    }

    /// How joints are computed from the vertices of a mesh of `num_vertices`; `None` if the text doesn't say.
    ///
    /// # Errors
    /// [`Error::Regressor`] names the joint that is missing or wrong.
    pub fn regressor(&self, num_vertices: usize) -> Result<Option<JointRegressor>> {
        if self.joint_regressor.is_empty() {
            return Ok(None);
        }
        let mut rows = Vec::new();
        for joint in &self.joints {
            let fail = |what: &str| Error::Regressor { what: format!("joint {} {what}", joint.name) };
            let row = self.joint_regressor.get(&joint.name).ok_or_else(|| fail("is missing"))?;
            if row.vertices.len() != row.weights.len() {
                return Err(fail("does not have as many weights as vertices"));
            }
            rows.push(row.vertices.iter().copied().zip(row.weights.iter().copied()).collect());
        }
        JointRegressor::new(rows, num_vertices).map(Some)
    }

    /// Positions of the joints in the template at rest, metres, shape `[joints]`; `None` if the text doesn't say.
    pub fn rest_joints(&self) -> Option<Vec<Vector3<f64>>> {
        self.joints.iter().map(|joint| joint.rest.map(Vector3::from)).collect()
    }
}
