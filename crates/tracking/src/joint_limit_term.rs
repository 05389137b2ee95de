use body::BodyModel;

/// The first part of E_P: joints beyond their limits (docs/papers.md#particle-search, eq. 14), `Σ (excess / 3°)²`
/// with one signed excess for each limit, as `shape_fit` has it.
pub fn joint_limit_energy(model: &BodyModel, pose: &[f64]) -> f64 {
    shape_fit::add_limits(model, pose, |_, _, _| {})
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_joint_pays_for_what_is_beyond_either_limit_only() {
        let model = BodyModel::shipped();
        let knee = model.rig().dof_index("l_knee").unwrap();
        let [low, high] = model.rig().dofs()[knee].limits.unwrap();
        let energy = |angle: f64| {
            let mut pose = vec![0.0; model.rig().num_dofs()];
            pose[knee] = angle;
            joint_limit_energy(&model, &pose)
        };
        assert_eq!(energy((low + high) / 2.0), 0.0);
        assert!((energy(high + 0.1) - 4.0).abs() < 1e-9 && (energy(low - 0.1) - 4.0).abs() < 1e-9);
        assert!(energy(high + 0.2) > energy(high + 0.1));
    }
}
