use body::{BodyModel, Posed, Shape};
use model::Mesh;
use nalgebra::Vector3;
use tracking::{Error, ObservedFrame, RandomStream, Result};
use vision::scene::{SilhouetteNoise, silhouettes};

use super::Setting;

/// What the first of a start's random numbers is for.
const SHAPE: usize = 0;
const TURNS: usize = 1;

/// A body that is seen, and the pose it is to be found from.
pub struct Start {
    /// its shape
    pub alpha: Vec<f64>,
    shape: Shape,
    /// its joints, metres
    pub joints: Vec<Vector3<f64>>,
    /// what the cameras see
    pub frame: ObservedFrame,
    /// its pose with limbs turned, shape `[dofs]`
    pub disturbed: Vec<f64>,
}

impl Start {
    pub fn new(setting: &Setting<'_>, index: usize) -> Result<Self> {
        let Setting { model, cameras, seed, .. } = *setting;
        let mut truth = setting.poses[index].clone();
        if truth.len() != model.rig().num_dofs() || truth.iter().any(|x| !x.is_finite()) {
            return Err(Error::Pose { found: truth.len(), expected: model.rig().num_dofs() });
        }
        // over the origin, where the cameras look
        (truth[0], truth[2]) = (0.0, 0.0);
        let mut random = RandomStream::new(seed, index, 0, SHAPE);
        let alpha: Vec<f64> = (0..model.num_components()).map(|_| 2.0 * random.uniform() - 1.0).collect();
        let shape = model.shape(&alpha);
        let mut posed = Posed::default();
        shape.pose(model, &truth, &mut posed);
        let joints = posed.joints;
        let mesh = Mesh { vertices: posed.vertices, faces: model.faces().to_vec() };
        let mut seen = silhouettes(&mesh, cameras);
        if setting.is_noisy {
            for (view, silhouette) in seen.iter_mut().enumerate() {
                SilhouetteNoise::default().add_to(silhouette, seed.wrapping_add(index as u64), view as u64);
            }
        }
        let views: Vec<_> = cameras.iter().cloned().zip(seen).collect();
        let frame = ObservedFrame::new(index, &views)?;
        let disturbed = disturbed(setting, &truth, &mut RandomStream::new(seed, index, 0, TURNS));
        Ok(Self { alpha, shape, joints, frame, disturbed })
    }

    /// Joints of the body in a pose, metres.
    pub fn joints_at(&self, model: &BodyModel, pose: &[f64]) -> Vec<Vector3<f64>> {
        let mut posed = Posed::default();
        self.shape.pose_joints(model, pose, &mut posed);
        posed.joints
    }
}

/// Every angle of the limbs turned one way or the other; the other way where limits leave more room there.
fn disturbed(setting: &Setting<'_>, truth: &[f64], random: &mut RandomStream) -> Vec<f64> {
    let mut pose = truth.to_vec();
    for dof in setting.limbs.dofs(setting.model) {
        let turn = if random.uniform() < 0.5 { -setting.turned_rad } else { setting.turned_rad };
        let within = |angle: f64| {
            let limits = setting.model.rig().dofs()[dof].limits;
            limits.map_or(angle, |[low, high]| angle.clamp(low, high))
        };
        let [one, other] = [truth[dof] + turn, truth[dof] - turn].map(within);
        let is_farther = (other - truth[dof]).abs() > (one - truth[dof]).abs() + 1e-9;
        pose[dof] = if is_farther { other } else { one };
    }
    pose
}
