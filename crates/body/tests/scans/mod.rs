//! The registered scans of the shared data, for tests and the command that learns the shipped model.

use std::{fs, path::Path};

use body::{BodyModel, JointRegressor, ModelParts, Rig, RigFile, Skin};
use nalgebra::Vector3;

/// Numbers of an NPY file: what follows its header, in pieces of `N` bytes.
fn numbers<const N: usize>(path: &Path) -> Vec<[u8; N]> {
    let bytes = fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let header = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    bytes[10 + header..].as_chunks::<N>().0.to_vec()
}

/// Scans, their topology and the rig of `bodies` in the shared data.
pub struct Scans {
    pub faces: Vec<[u32; 3]>,
    pub rig: Rig,
    pub regressor: JointRegressor,
    pub skin: Skin,
    /// metres, shape `[scans][vertices]`
    pub scans: Vec<Vec<Vector3<f64>>>,
}

impl Scans {
    pub fn read(bodies: &Path) -> Self {
        let faces: Vec<u32> =
            numbers::<4>(&bodies.join("scans/faces.npy")).into_iter().map(u32::from_le_bytes).collect();
        let steps: Vec<f64> = numbers::<2>(&bodies.join("scans/vertices.npy"))
            .into_iter()
            .map(|b| f64::from(i16::from_le_bytes(b)) * 1e-4)
            .collect();
        let points: Vec<_> = steps.as_chunks::<3>().0.iter().map(|&p| Vector3::from(p)).collect();
        let joints = numbers::<4>(&bodies.join("rig/skin_joints.npy"));
        let weights: Vec<f32> =
            numbers::<4>(&bodies.join("rig/skin_weights.npy")).into_iter().map(f32::from_le_bytes).collect();
        let text = fs::read(bodies.join("rig/rig.json")).unwrap();
        let file = RigFile::parse(&text).unwrap();
        let rig = file.rig().unwrap();
        let num_vertices = joints.len();
        Self {
            faces: faces.as_chunks::<3>().0.to_vec(),
            regressor: file.regressor(num_vertices).unwrap().unwrap(),
            skin: Skin::new(&joints, weights.as_chunks::<4>().0, rig.num_joints()).unwrap(),
            rig,
            scans: points.chunks_exact(num_vertices).map(<[_]>::to_vec).collect(),
        }
    }

    /// A model whose mean is one scan and whose components lead from it to others.
    pub fn model_of(&self, mean: usize, others: &[usize]) -> BodyModel {
        let difference = |&other: &usize| -> Vec<_> {
            self.scans[other].iter().zip(&self.scans[mean]).map(|(a, b)| a - b).collect()
        };
        BodyModel::new(ModelParts {
            description: "differences of scans".into(),
            faces: self.faces.clone(),
            mean: self.scans[mean].clone(),
            components: others.iter().map(difference).collect(),
            variance_kept: vec![0.0; others.len()],
            rig: self.rig.clone(),
            regressor: self.regressor.clone(),
            skin: self.skin.clone(),
        })
        .unwrap()
    }
}
