//! Learning a model from registered scans of people in the base pose: check, align, unpose, principal components.

mod align;
mod check;
mod options;
mod pca;
mod principal;

pub use align::{Aligned, unpose};
pub use options::{Alignment, LearnOptions, Scan};
pub use principal::Learned;

use crate::population::Population;
use crate::{Error, Result, Template};
use principal::principal;

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
