//! What is compared with what: every combination of the things that are varied.

use serde::{Deserialize, Serialize};
use sparse::{Method, Parameters};

use crate::{ControlSet, Error, Occlusion};

/// Parameters under a name.
#[derive(Debug, Clone, PartialEq)]
pub struct Variant {
    /// what is different, `smooth=true`; empty for the parameters that others are compared with
    pub name: String,
    /// the parameters; the method is that of the case
    pub parameters: Parameters,
}

/// The things that are varied. Every combination is evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// methods
    pub methods: Vec<Method>,
    /// numbers of control points, 2 to 6
    pub points: Vec<usize>,
    /// parameters
    pub variants: Vec<Variant>,
    /// least numbers of poses that the database has; `None` for all
    pub database_sizes: Vec<Option<usize>>,
    /// standard deviations of the noise on the control points' coordinates, metres
    pub noises_m: Vec<f64>,
    /// whether the reconstruction is told of the noise
    pub noise_is_known: bool,
    /// gaps in the measurement; `None` for none
    pub occlusions: Vec<Option<Occlusion>>,
}

impl Sweep {
    /// Methods and numbers of control points, all else as it is: the whole database, measured exactly and without gaps.
    pub fn new(methods: &[Method], points: &[usize], parameters: Parameters) -> Self {
        Self {
            methods: methods.to_vec(),
            points: points.to_vec(),
            variants: vec![Variant { name: String::new(), parameters }],
            database_sizes: vec![None],
            noises_m: vec![0.0],
            noise_is_known: false,
            occlusions: vec![None],
        }
    }

    /// Number of cases for each size of the database.
    pub fn cases_per_database(&self) -> usize {
        self.methods.len()
            * self.points.len()
            * self.variants.len()
            * self.noises_m.len()
            * self.occlusions.len()
    }

    /// The cases on a database of `database_poses` poses, with the index of their variant.
    pub(crate) fn cases(&self, database_poses: usize) -> Vec<(Case, usize)> {
        let mut cases = Vec::with_capacity(self.cases_per_database());
        for (v, variant) in self.variants.iter().enumerate() {
            for &points in &self.points {
                for &noise_m in &self.noises_m {
                    for &occlusion in &self.occlusions {
                        for &method in &self.methods {
                            let case = Case {
                                method,
                                points,
                                window: variant.parameters.window,
                                neighbours: variant.parameters.neighbours,
                                variant: variant.name.clone(),
                                database_poses,
                                noise_mm: 1e3 * noise_m,
                                occlusion,
                            };
                            cases.push((case, v));
                        }
                    }
                }
            }
        }
        cases
    }

    /// Checks everything before the work begins.
    pub(crate) fn check(&self) -> Result<(), Error> {
        if let Some(&found) = self.points.iter().find(|&&points| ControlSet::names(points).is_none()) {
            return Err(Error::Points { found });
        }
        if let Some(&found) = self.noises_m.iter().find(|noise| !(0.0..=1.0).contains(*noise)) {
            return Err(Error::Noise { found_m: found });
        }
        self.variants
            .iter()
            .try_for_each(|variant| variant.parameters.check())
            .map_err(|source| Error::Parameters { source })
    }
}

/// One combination: what a row of a table is about.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Case {
    /// method
    pub method: Method,
    /// number of control points
    pub points: usize,
    /// window length, frames
    pub window: usize,
    /// number of neighbours
    pub neighbours: usize,
    /// which parameters are different; empty: none
    pub variant: String,
    /// poses of the database at 60 a second, those left out by the protocol among them
    pub database_poses: usize,
    /// standard deviation of the noise on control points, millimetres
    pub noise_mm: f64,
    /// gap in the measurement
    pub occlusion: Option<Occlusion>,
}

impl Case {
    /// The same case without the gap.
    pub(crate) fn without_gap(&self) -> Self {
        Self { occlusion: None, ..self.clone() }
    }
}
