use body::{BodyModel, ROOT_DOFS};

use crate::{Error, Result};

/// The second part of E_P: −log of a Parzen density of training poses (docs/papers.md#particle-search, eq. 15 and
/// 16). The kernel is a Gaussian of the squared distance over all angles; its width is the largest distance from a
/// training pose to its nearest neighbour.
#[derive(Debug, Clone, PartialEq)]
pub struct Parzen {
    /// angles of the poses, radians, shape `[poses, angles]`
    angles: Vec<f64>,
    width: usize,
    sigma: f64,
}

/// Poses that a density needs.
const LEAST: usize = 3;

impl Parzen {
    /// From poses of shape `[poses][dofs]`; of the root nothing is learned.
    ///
    /// # Errors
    /// [`Error::TrainingPoses`] if there are fewer than three, all are alike, or one does not have the rig's DOFs.
    pub fn new(model: &BodyModel, poses: &[Vec<f64>]) -> Result<Self> {
        let dofs = model.rig().num_dofs();
        let is_pose = |pose: &Vec<f64>| pose.len() == dofs && pose.iter().all(|x| x.is_finite());
        let fail = Err(Error::TrainingPoses { found: poses.len(), least: LEAST, dofs });
        if poses.len() < LEAST || !poses.iter().all(is_pose) {
            return fail;
        }
        let nearest = |i: usize| {
            let others = poses.iter().enumerate().filter(|(j, _)| *j != i);
            others
                .map(|(_, other)| squared(&poses[i][ROOT_DOFS..], &other[ROOT_DOFS..]))
                .fold(f64::INFINITY, f64::min)
        };
        let sigma = (0..poses.len()).map(nearest).fold(0.0, f64::max).sqrt();
        if sigma <= 0.0 {
            return fail;
        }
        let angles = poses.iter().flat_map(|pose| &pose[ROOT_DOFS..]).copied().collect();
        Ok(Self { angles, width: dofs - ROOT_DOFS, sigma })
    }

    /// Width of the kernel, radians.
    pub fn sigma(&self) -> f64 {
        self.sigma
    }

    /// Number of training poses.
    pub fn num_poses(&self) -> usize {
        self.angles.len() / self.width
    }

    /// −log p(pose), up to a constant that is 0 on a pose that all training poses are equal to. Takes no memory.
    pub fn energy(&self, pose: &[f64]) -> f64 {
        let angles = &pose[ROOT_DOFS..];
        let exponent = |training: &[f64]| -squared(angles, training) / (2.0 * self.sigma * self.sigma);
        let all = || self.angles.chunks_exact(self.width).map(exponent);
        let largest = all().fold(f64::NEG_INFINITY, f64::max);
        // log-sum-exp: the largest term is 1, whatever the distance
        let sum: f64 = all().map(|x| (x - largest).exp()).sum();
        (self.num_poses() as f64).ln() - largest - sum.ln()
    }
}

fn squared(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in_poses;

    #[test]
    fn far_poses_cost_their_squared_distance_and_never_infinity() {
        let model = BodyModel::shipped();
        let poses = built_in_poses(&model);
        let parzen = Parzen::new(&model, &poses).unwrap();
        assert_eq!(parzen.num_poses(), poses.len());
        let at = |turn: f64| {
            let mut pose = poses[0].clone();
            pose[ROOT_DOFS + 1] += turn;
            parzen.energy(&pose)
        };
        assert!(at(0.0) < at(1.0) && at(1.0) < at(3.0));
        assert!(at(1e4).is_finite());
        // the root doesn't count
        let mut moved = poses[3].clone();
        moved[..ROOT_DOFS].fill(2.0);
        assert_eq!(parzen.energy(&moved), parzen.energy(&poses[3]));
    }

    #[test]
    fn the_width_is_the_largest_distance_to_a_nearest_neighbour() {
        let model = BodyModel::shipped();
        let mut poses = vec![vec![0.0; model.rig().num_dofs()]; 3];
        poses[1][8] = 0.3;
        poses[2][9] = 0.7;
        assert!((Parzen::new(&model, &poses).unwrap().sigma() - 0.7).abs() < 1e-12);
        assert!(Parzen::new(&model, &poses[..2]).is_err());
        assert!(Parzen::new(&model, &vec![poses[0].clone(); 5]).is_err());
    }
}
