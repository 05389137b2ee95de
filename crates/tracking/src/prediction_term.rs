use body::{BodyModel, ROOT_DOFS};
use nalgebra::DMatrix;

use crate::{Error, Result};

/// Directions in which poses of people differ most: the space in which E_R measures (docs/papers.md#particle-search, eq. 12).
#[derive(Debug, Clone, PartialEq)]
pub struct PoseSpace {
    /// unit vectors of angles, the widest first, shape `[dimensions, angles]`
    directions: Vec<f64>,
    width: usize,
}

/// Dimensions kept, of the rig's 16 angles.
const DIMENSIONS: usize = 6;

impl PoseSpace {
    /// Principal directions of poses of shape `[poses][dofs]`; the root isn't looked at.
    ///
    /// # Errors
    /// [`Error::TrainingPoses`] if there are fewer than three, or one does not have the rig's DOFs.
    pub fn new(model: &BodyModel, poses: &[Vec<f64>]) -> Result<Self> {
        let dofs = model.rig().num_dofs();
        let is_pose = |pose: &Vec<f64>| pose.len() == dofs && pose.iter().all(|x| x.is_finite());
        if poses.len() < 3 || !poses.iter().all(is_pose) {
            return Err(Error::TrainingPoses { found: poses.len(), least: 3, dofs });
        }
        let width = dofs - ROOT_DOFS;
        let mut centred = DMatrix::from_fn(poses.len(), width, |i, j| poses[i][ROOT_DOFS + j]);
        for mut column in centred.column_iter_mut() {
            let mean = column.mean();
            column.add_scalar_mut(-mean);
        }
        let found = centred.tr_mul(&centred).symmetric_eigen();
        let mut order: Vec<usize> = (0..width).collect();
        order.sort_by(|&a, &b| found.eigenvalues[b].total_cmp(&found.eigenvalues[a]));
        order.truncate(DIMENSIONS);
        let directions =
            order.iter().flat_map(|&i| found.eigenvectors.column(i).iter().copied().collect::<Vec<_>>());
        Ok(Self { directions: directions.collect(), width })
    }

    /// E_R: squared deviation of a pose from the predicted one within the space, square radians. Takes no memory.
    pub fn energy(&self, pose: &[f64], predicted: &[f64]) -> f64 {
        let along = |direction: &[f64]| -> f64 {
            let deviation = pose[ROOT_DOFS..].iter().zip(&predicted[ROOT_DOFS..]);
            deviation.zip(direction).map(|((a, b), direction)| (a - b) * direction).sum()
        };
        self.directions.chunks_exact(self.width).map(|direction| along(direction).powi(2)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in_poses;

    #[test]
    fn only_deviations_that_poses_of_people_have_cost() {
        let model = BodyModel::shipped();
        let mut poses = vec![vec![0.0; model.rig().num_dofs()]; 9];
        for (i, pose) in poses.iter_mut().enumerate() {
            pose[7] = i as f64 * 0.1;
        }
        let space = PoseSpace::new(&model, &poses).unwrap();
        let predicted = vec![0.0; model.rig().num_dofs()];
        assert!((space.energy(&poses[5], &predicted) - 0.25).abs() < 1e-12);
        assert_eq!(space.energy(&predicted, &predicted), 0.0);
    }

    #[test]
    fn the_energy_is_at_most_the_squared_distance() {
        let model = BodyModel::shipped();
        let poses = built_in_poses(&model);
        let space = PoseSpace::new(&model, &poses).unwrap();
        let (mut all, mut within) = (0.0, 0.0);
        for pair in poses.windows(2) {
            let squared: f64 = pair[0].iter().zip(&pair[1]).map(|(a, b)| (a - b).powi(2)).sum();
            let found = space.energy(&pair[0], &pair[1]);
            assert!(found <= squared + 1e-9, "{found} of {squared}");
            all += squared;
            within += found;
        }
        assert!(within > 0.6 * all, "{within} of {all}");
    }
}
