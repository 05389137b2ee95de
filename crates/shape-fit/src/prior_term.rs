//! What is known without images: the shapes of the population, the limits of joints, and that limbs rather hang relaxed.

use body::{BodyModel, ROOT_DOFS};

/// How far a joint may go beyond its limit, radians, one standard deviation.
const BEYOND: f64 = 0.05;
/// Standard deviation of an angle about the base pose, radians; wide, for angles that no silhouette tells.
const ANGLE: f64 = 1.2;
/// The same of twists, which straight limbs hide.
const TWIST: f64 = 0.6;

/// Adds the energy of a pose; its halved derivatives to the diagonal of the matrix and to the gradient. Shape `[dofs]` each.
pub fn add_pose(model: &BodyModel, pose: &[f64], mut add: impl FnMut(usize, f64, f64)) -> f64 {
    let mut energy = 0.0;
    for (d, dof) in model.rig().dofs().iter().enumerate().skip(ROOT_DOFS) {
        let sigma = if dof.name.ends_with("twist") { TWIST } else { ANGLE };
        let weight = sigma.powi(-2);
        energy += weight * pose[d] * pose[d];
        add(d, weight, weight * pose[d]);
    }
    energy + add_limits(model, pose, add)
}

/// Adds the energy of what is beyond the limits of joints, as one signed excess a limit
/// (docs/papers.md#particle-search, eq. 14), `Σ (excess / 3°)²`; its halved derivatives as `add(dof, weight, slope)`.
pub fn add_limits(model: &BodyModel, pose: &[f64], mut add: impl FnMut(usize, f64, f64)) -> f64 {
    let mut energy = 0.0;
    for (d, dof) in model.rig().dofs().iter().enumerate().skip(ROOT_DOFS) {
        let Some([low, high]) = dof.limits else { continue };
        // signed: positive above, negative below
        let excess = (pose[d] - high).max(0.0) + (pose[d] - low).min(0.0);
        if excess != 0.0 {
            let weight = BEYOND.powi(-2);
            energy += weight * excess * excess;
            add(d, weight, weight * excess);
        }
    }
    energy
}

/// The same of a shape: Σ α².
pub fn add_shape(alpha: &[f64], mut add: impl FnMut(usize, f64, f64)) -> f64 {
    alpha.iter().enumerate().for_each(|(i, &a)| add(i, 1.0, a));
    alpha.iter().map(|a| a * a).sum()
}
