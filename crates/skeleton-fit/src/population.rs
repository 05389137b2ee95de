use model::Skeleton;
use motion_db::MotionDatabase;
use nalgebra::{Matrix3, Vector3};

use crate::{Limbs, Result};

/// Standard deviation of the logarithm of a person's size that is assumed whatever the database holds.
const SIZE_SIGMA: f64 = 0.06;
/// Standard deviation of the logarithm of one limb's size besides.
const LIMB_SIGMA: f64 = 0.03;
/// Performers that these count as.
const PRIOR_PERFORMERS: f64 = 5.0;

/// The skeletons of a database's clips: their mean, and how the sizes of their limbs vary together.
#[derive(Debug, Clone)]
pub struct Population {
    /// mean of all distinct skeletons
    pub mean: Skeleton,
    /// its limbs
    pub limbs: Limbs,
    /// covariance of the logarithms of the limbs' scales against the mean, in the order of [`crate::LIMBS`]
    pub covariance: Matrix3<f64>,
    /// number of distinct skeletons
    pub performers: usize,
}

impl Population {
    /// The population of a database. Clips of one skeleton count once.
    ///
    /// # Errors
    /// If the mean is not a skeleton.
    pub fn from_database(database: &MotionDatabase) -> Result<Self> {
        let mut distinct: Vec<&[f64]> = Vec::new();
        for clip in database.clips() {
            let is_same =
                |other: &&[f64]| other.iter().zip(clip.proportions()).all(|(a, b)| (a - b).abs() < 1e-5);
            if !distinct.iter().any(is_same) {
                distinct.push(clip.proportions());
            }
        }
        let template = database.skeleton();
        let count = distinct.len().max(1) as f64;
        let mut mean = vec![0.0; 6 * template.num_joints()];
        for proportions in &distinct {
            mean.iter_mut().zip(*proportions).for_each(|(m, p)| *m += p / count);
        }
        let mean = with_proportions(template, &mean)?;
        let limbs = Limbs::from_skeleton(&mean);
        let middle = limbs.lengths(&mean);
        let mut scatter = Matrix3::zeros();
        for proportions in &distinct {
            let lengths = limbs.lengths(&with_proportions(template, proportions)?);
            let log: [f64; 3] = std::array::from_fn(|i| {
                let (length, middle): (f64, f64) = (lengths[i], middle[i]);
                if middle > 0.0 && length > 0.0 { (length / middle).ln() } else { 0.0 }
            });
            let log = Vector3::from(log);
            scatter += log * log.transpose();
        }
        let prior = Matrix3::repeat(SIZE_SIGMA.powi(2)) + Matrix3::identity() * LIMB_SIGMA.powi(2);
        let covariance = (scatter + prior * PRIOR_PERFORMERS) / (distinct.len() as f64 + PRIOR_PERFORMERS);
        Ok(Self { mean, limbs, covariance, performers: distinct.len() })
    }
}

/// `template` with other offsets and tips, laid out as [`motion_db::ClipInfo::proportions`].
fn with_proportions(template: &Skeleton, proportions: &[f64]) -> Result<Skeleton> {
    let joints = template.joints().iter().zip(proportions.chunks_exact(6)).map(|(joint, numbers)| {
        let mut joint = joint.clone();
        joint.offset.copy_from_slice(&numbers[..3]);
        joint.tip.copy_from_slice(&numbers[3..]);
        joint
    });
    Ok(Skeleton::new(template.name(), joints.collect())?)
}
