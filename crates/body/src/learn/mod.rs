//! Learning a model from registered scans of people in the base pose: check, align, unpose, principal components.

mod align;
pub(crate) mod check;
mod pca;

use nalgebra::Vector3;

pub use align::{Aligned, unpose};
pub(crate) use pca::ends;

use crate::population::{Population, Subject};
use crate::{BodyModel, Error, MAX_COMPONENTS, ModelParts, Result, Template};

/// A registered scan: a body in the template's topology and about in its pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scan<'a> {
    /// what errors call it: the file
    pub name: &'a str,
    /// metres, shape `[vertices]`
    pub vertices: &'a [Vector3<f64>],
    /// its own faces, if it came with any; they must be the template's
    pub faces: Option<&'a [[u32; 3]]>,
    /// what is known of the person
    pub subject: Subject,
}

/// What is done to scans before they are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Alignment {
    /// nothing
    AsTheyStand,
    /// turned to face as the template does, set on the floor, the pelvis over the origin
    Turned,
    /// that, and the pose that each stands in is taken out
    Unposed,
}

/// How to learn.
#[derive(Debug, Clone, PartialEq)]
pub struct LearnOptions {
    /// components to keep, at most [`MAX_COMPONENTS`] and one less than scans
    pub components: usize,
    /// what is done to the scans before they are compared
    pub alignment: Alignment,
    /// who the model is learned from and by whom
    pub description: String,
}

impl Default for LearnOptions {
    fn default() -> Self {
        Self { components: MAX_COMPONENTS, alignment: Alignment::Unposed, description: String::new() }
    }
}

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

/// Learns a model from scans: [`Aligned::new`], then [`Aligned::learn`].
///
/// # Errors
/// [`Error::Scan`] names the first scan that is not what it should be; [`Error::Template`], [`Error::TooFewScans`].
pub fn learn(scans: &[Scan<'_>], template: &Template, options: &LearnOptions) -> Result<Learned> {
    Aligned::new(scans, template, options)?.learn(template, &[], options)
}

impl Aligned {
    /// Learns from the scans except those of the indices `without`: their shapes in the template's pose stay as
    /// they were found with all scans.
    ///
    /// # Errors
    /// [`Error::TooFewScans`] if fewer than two are left.
    pub fn learn(&self, template: &Template, without: &[usize], options: &LearnOptions) -> Result<Learned> {
        let chosen: Vec<usize> = (0..self.shapes.len()).filter(|i| !without.contains(i)).collect();
        if chosen.len() < 2 {
            return Err(Error::TooFewScans { found: chosen.len() });
        }
        let shapes: Vec<_> = chosen.iter().map(|&i| self.shapes[i].as_slice()).collect();
        let mut learned = principal(&shapes, template, options.components, &options.description)?;
        let subjects: Vec<_> = chosen.iter().map(|&i| self.subjects[i]).collect();
        let population = Population::learn(&template.faces, &shapes, &subjects, &learned.alphas);
        learned.model.population = population;
        Ok(learned)
    }
}

/// Mean and principal components of shapes.
fn principal(
    shapes: &[&[Vector3<f64>]],
    template: &Template,
    components: usize,
    description: &str,
) -> Result<Learned> {
    let pca = pca::principal_components(shapes, components.min(MAX_COMPONENTS));
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
