use body::BodyModel;
use shape_fit::{ARMS, LEGS, WHOLE, limb_dofs, set_limb};

/// About a hundred poses of people, for a prior without a motion database: how arms and legs are often held (the tables
/// that `shape_fit` starts from), both sides alike, and both sides in different ways. The root stays at zero. Shape
/// `[poses][dofs]`.
pub fn built_in_poses(model: &BodyModel) -> Vec<Vec<f64>> {
    let limbs = limb_dofs(model);
    let pose = |chosen: [usize; 4]| {
        let mut pose = vec![0.0; model.rig().num_dofs()];
        for (limb, &index) in chosen.iter().enumerate() {
            let degrees = if limb < 2 { &ARMS[index] } else { &LEGS[index] };
            set_limb(&mut pose, &limbs[limb], degrees);
        }
        model.rig().clamp(&mut pose);
        pose
    };
    let alike = WHOLE.iter().map(|&[arms, legs]| pose([arms, arms, legs, legs]));
    // strides that share no factor with the tables' lengths, so that all pairs of arms and of legs are different
    let mixed = (0..ARMS.len() * LEGS.len()).map(|i| {
        let (arm, leg) = (i % ARMS.len(), i % LEGS.len());
        pose([arm, (arm + 3 * (i / ARMS.len())) % ARMS.len(), leg, (leg + 3 * (i / LEGS.len())) % LEGS.len()])
    });
    alike.chain(mixed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_poses_are_about_a_hundred_and_within_limits() {
        let model = BodyModel::shipped();
        let poses = built_in_poses(&model);
        assert_eq!(poses.len(), 98);
        assert!(poses.iter().all(|pose| crate::joint_limit_energy(&model, pose) == 0.0));
        let mut different: Vec<String> = poses.iter().map(|pose| format!("{pose:?}")).collect();
        different.sort();
        different.dedup();
        assert!(different.len() > 80, "{} of them are different", different.len());
    }
}
