use nalgebra::Vector3;

use super::pca::principal_components;
use crate::{BodyModel, MAX_COMPONENTS, ModelParts, Result, Template};

/// A model and what was found on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct Learned {
    /// the model
    pub model: BodyModel,
    /// coefficients of every scan that was learned from, shape `[scans, components]`
    pub alphas: Vec<Vec<f64>>,
    /// share of the variance kept by the first 1, 2, … components
    pub variance_kept: Vec<f64>,
    /// variance of all coordinates together, square metres
    pub variance_m2: f64,
}

/// Mean and principal components of shapes.
pub(super) fn principal(
    shapes: &[&[Vector3<f64>]],
    template: &Template,
    components: usize,
    description: &str,
) -> Result<Learned> {
    let pca = principal_components(shapes, components.min(MAX_COMPONENTS));
    let model = BodyModel::new(ModelParts {
        description: description.to_owned(),
        faces: template.faces.clone(),
        mean: pca.mean,
        components: pca.components,
        variance_kept: pca.variance_kept.clone(),
        rig: template.rig.clone(),
        regressor: template.regressor.clone(),
        skin: template.skin.clone(),
    })?;
    Ok(Learned { model, alphas: pca.scores, variance_kept: pca.variance_kept, variance_m2: pca.variance_m2 })
}
