//! Recorded motion of the CMU skeleton on the morphable body.

use body::{BodyModel, Shape};
use inverse_kinematics::{Evidence, Options, Solver, rig::RigChain};
use kinematics::{Kinematics, Parametrisation, control_points};
use model::Motion;
use nalgebra::{Matrix3, Vector3};

use crate::{Error, Result};

/// Joints of the CMU skeleton that correspond to the rig's; the last of each limb stands at the end of the one before.
/// Arms, then legs; the left one first.
pub(crate) const LIMBS: [([&str; 3], [&str; 3]); 4] = [
    (["lhumerus", "lradius", "lhand"], ["l_shoulder", "l_elbow", "l_wrist"]),
    (["rhumerus", "rradius", "rhand"], ["r_shoulder", "r_elbow", "r_wrist"]),
    (["lfemur", "ltibia", "lfoot"], ["l_hip", "l_knee", "l_ankle"]),
    (["rfemur", "rtibia", "rfoot"], ["r_hip", "r_knee", "r_ankle"]),
];

/// Indices of three joints of a body's rig, by their names.
///
/// # Errors
/// [`Error::MissingJoint`] with the first that the rig has not.
pub(crate) fn rig_joints(model: &BodyModel, names: [&'static str; 3]) -> Result<[usize; 3]> {
    let mut found = [0; 3];
    for (found, name) in found.iter_mut().zip(names) {
        *found = model.rig().joint_index(name).ok_or(Error::MissingJoint { name })?;
    }
    Ok(found)
}

/// Recorded motion on the morphable body.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// poses of the rig, shape `[frames][dofs]`
    pub poses: Vec<Vec<f64>>,
}

impl Recording {
    /// Brings every `step`th frame of a motion of the CMU skeleton to a body: root and trunk by shoulders and hips, limbs by
    /// the directions of their bones, within the rig's limits. The path is centred on the origin of the floor.
    ///
    /// # Errors
    /// [`Error::MissingJoint`] if the skeleton is another.
    pub fn new(model: &BodyModel, shape: &Shape, motion: &Motion, step: usize) -> Result<Self> {
        let skeleton = motion.skeleton();
        let names: Vec<_> = LIMBS.iter().flat_map(|(recorded, _)| *recorded).collect();
        if let Some(&name) = names.iter().find(|&&name| skeleton.joint_index(name).is_none()) {
            return Err(Error::MissingJoint { name });
        }
        let points = control_points(skeleton, &names).map_err(inverse_kinematics::Error::from)?;
        let recorded = Kinematics::new(skeleton, Parametrisation::channels(skeleton));
        let mut state = recorded.state();
        let frames: Vec<Vec<Vector3<f64>>> = motion
            .poses()
            .step_by(step.max(1))
            .map(|pose| {
                recorded.update(pose, &mut state);
                points.iter().map(|point| state.point(point.joint, &point.offset)).collect()
            })
            .collect();
        let mut puppet = Puppet::new(model, shape)?;
        let middle = |points: &[Vector3<f64>]| (points[6] + points[9]) * 0.5;
        let centre =
            frames.iter().map(|points| middle(points)).sum::<Vector3<f64>>() / frames.len().max(1) as f64;
        let poses = frames.iter().map(|points| {
            let leg = (points[7] - points[6]).norm() + (points[8] - points[7]).norm();
            let scale = puppet.leg_m / leg;
            let hips = middle(points) - centre;
            let hips = Vector3::new(hips.x, middle(points).y * scale, hips.z);
            puppet.pose(points, &hips)
        });
        Ok(Self { poses: poses.collect::<Result<_>>()? })
    }
}

/// The body posed by recorded joints.
struct Puppet {
    rig: RigChain,
    solver: Solver,
    x: Vec<f64>,
    /// the rig's joints of each limb
    limbs: [[usize; 3]; 4],
    rest: Vec<Vector3<f64>>,
    leg_m: f64,
}

/// Rotation of the trunk: left along the shoulders and hips, up from hips to shoulders.
fn trunk(limb_bases: [Vector3<f64>; 4]) -> Matrix3<f64> {
    let [left_shoulder, right_shoulder, left_hip, right_hip] = limb_bases;
    let up = ((left_shoulder + right_shoulder) - (left_hip + right_hip)).normalize();
    let across = (left_shoulder - right_shoulder).normalize() + (left_hip - right_hip).normalize();
    let forward = across.cross(&up).normalize();
    Matrix3::from_columns(&[up.cross(&forward), up, forward])
}

impl Puppet {
    fn new(model: &BodyModel, shape: &Shape) -> Result<Self> {
        let mut rig = RigChain::new(model, shape)?;
        let mut limits = rig.chain.limits().to_vec();
        limits[..6].fill([0.0; 2]);
        rig.chain = rig.chain.with_limits(limits)?;
        let mut limbs = [[0; 3]; 4];
        for (limb, (_, names)) in limbs.iter_mut().zip(LIMBS) {
            *limb = rig_joints(model, names)?;
        }
        let targeted: Vec<_> = limbs.iter().flat_map(|limb| [limb[1], limb[2]]).collect();
        let options = Options { steps: 60, ..Options::reach(&targeted) };
        let solver = Solver::new(rig.chain.clone(), options)?;
        let leg = limbs[2].map(|joint| shape.joints[joint]);
        Ok(Self {
            x: vec![0.0; rig.chain.num_dofs()],
            solver,
            limbs,
            rest: shape.joints.clone(),
            leg_m: (leg[1] - leg[0]).norm() + (leg[2] - leg[1]).norm(),
            rig,
        })
    }

    /// The pose whose bones point as those between the recorded `points` do, with the hips there.
    fn pose(&mut self, points: &[Vector3<f64>], hips: &Vector3<f64>) -> Result<Vec<f64>> {
        let bases = [0, 1, 2, 3].map(|limb: usize| points[3 * limb]);
        let rest = self.limbs.map(|limb| self.rest[limb[0]]);
        let rotation = trunk(bases) * trunk(rest).transpose();
        let mut pose = vec![0.0; self.x.len()];
        self.rig.pose(&self.x, &mut pose);
        let shift = hips - rotation * ((rest[2] + rest[3]) * 0.5 - self.rest[0]) - self.rest[0];
        pose[..3].copy_from_slice(shift.as_slice());
        pose[3..6].copy_from_slice(kinematics::rotation_log(&rotation).as_slice());
        self.rig.coordinates(&pose, &mut self.x);
        let mut targets = vec![None; self.rig.chain.points().len()];
        for (index, limb) in self.limbs.iter().enumerate() {
            let mut at = self.rest[0] + shift + rotation * (self.rest[limb[0]] - self.rest[0]);
            for bone in 0..2 {
                let length = (self.rest[limb[bone + 1]] - self.rest[limb[bone]]).norm();
                at += (points[3 * index + bone + 1] - points[3 * index + bone]).normalize() * length;
                targets[limb[bone + 1]] = Some(at);
            }
        }
        let posture = self.x.clone();
        self.solver.solve(&mut self.x, &Evidence { targets: &targets, views: &[], posture: &posture })?;
        self.rig.pose(&self.x, &mut pose);
        Ok(pose)
    }
}
