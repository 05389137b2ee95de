//! Bodies by simple measurements. What is asked for gives the most probable coefficients α, whichever of the
//! measurements are known, by what [`crate::population`] tells of them; Newton steps make stature and mass exact.

use model::shown;
use nalgebra::{DMatrix, DVector, Vector3};

use crate::extremes::{heights, lowest_and_highest};
use crate::population::Feature;
use crate::{BodyModel, DENSITY_KG_M3, Error, Result, Sex};

/// Measurements that a body shall have; what is `None` is left to the population.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Wanted {
    /// metres; met exactly
    pub stature_m: Option<f64>,
    /// kilograms; met exactly
    pub mass_kg: Option<f64>,
    /// sex
    pub sex: Option<Sex>,
    /// age, years
    pub age_years: Option<f64>,
}

impl Wanted {
    /// Refuses measurements that nobody has.
    ///
    /// # Errors
    /// [`Error::Wanted`].
    pub fn check(&self) -> Result<()> {
        let ranges = [
            ("stature_m", self.stature_m, 1.0, 2.4, "m"),
            ("mass_kg", self.mass_kg, 20.0, 250.0, "kg"),
            ("age_years", self.age_years, 0.0, 120.0, "years"),
        ];
        for (name, value, low, high, unit) in ranges {
            if let Some(value) = value.filter(|value| !(low..=high).contains(value)) {
                let what = format!("{name} is {} {unit}, expected {low} to {high} {unit}", shown(value));
                return Err(Error::Wanted { what });
            }
        }
        Ok(())
    }
}

/// Most standard deviations of a coefficient from the mean.
pub const MAX_DEVIATIONS: f64 = 6.0;

const STATURE: usize = 0;
const MASS: usize = 1;

impl BodyModel {
    /// Coefficients of the most probable body with these measurements. Stature and mass are met to a tenth of a
    /// millimetre and ten grams.
    ///
    /// # Errors
    /// [`Error::Wanted`] if a measurement is beyond what people have, the model doesn't know it, or no body of the model
    /// within six standard deviations has it.
    pub fn alpha_for(&self, wanted: &Wanted) -> Result<Vec<f64>> {
        wanted.check()?;
        let sex = wanted.sex.map(|sex| if sex == Sex::Male { 1.0 } else { -1.0 });
        let asked = [wanted.stature_m, wanted.mass_kg, sex, wanted.age_years];
        let names = ["stature", "mass", "sex", "age"];
        let mut features = Vec::new();
        for (f, value) in asked.iter().enumerate().filter_map(|(f, value)| Some((f, (*value)?))) {
            let Some(feature) = &self.population.features[f] else {
                let what = format!("{} was asked for, but the model's scans don't tell it", names[f]);
                return Err(Error::Wanted { what });
            };
            features.push((f, feature, value));
        }
        let n = self.num_components();
        let (mut alpha, covariance) = condition(&features, n);
        let exact: Vec<_> = features.iter().filter(|(f, ..)| *f == STATURE || *f == MASS).collect();
        let mut shape = self.shape(&[]);
        for _ in 0..30 {
            self.shape_into(alpha.as_slice(), &mut shape);
            let [low, high] = heights(&shape.vertices);
            let volume = shape.mesh(self).volume();
            let miss = DVector::from_iterator(
                exact.len(),
                exact.iter().map(|&&(f, _, value)| {
                    value - if f == STATURE { high - low } else { volume * DENSITY_KG_M3 }
                }),
            );
            let is_met = exact
                .iter()
                .zip(&miss)
                .all(|((f, ..), miss)| miss.abs() < if *f == STATURE { 1e-4 } else { 1e-2 });
            if is_met {
                return check_found(alpha.as_slice()).map(|()| alpha.as_slice().to_vec());
            }
            let mut slopes = DMatrix::zeros(exact.len(), n);
            for (row, (f, ..)) in exact.iter().enumerate() {
                let slope = if *f == STATURE {
                    self.stature_slope(&shape.vertices)
                } else {
                    self.mass_slope(&shape.vertices)
                };
                slopes.row_mut(row).copy_from_slice(&slope);
            }
            // The likeliest change: as the population varies once what was asked for is known.
            let spread = &covariance * slopes.transpose();
            let Some(step) = (&slopes * &spread).lu().solve(&miss) else { break };
            alpha += spread * step;
            if alpha.amax() > 20.0 {
                break;
            }
        }
        Err(Error::Wanted { what: "no body of the model has that stature and mass".into() })
    }

    fn stature_slope(&self, vertices: &[Vector3<f64>]) -> Vec<f64> {
        let [low, high] = lowest_and_highest(vertices);
        let grows = |i| self.displacement(i, high).y - self.displacement(i, low).y;
        (0..self.num_components()).map(grows).collect()
    }

    fn mass_slope(&self, vertices: &[Vector3<f64>]) -> Vec<f64> {
        let mut by_vertex = vec![Vector3::zeros(); vertices.len()];
        for face in self.faces() {
            let [a, b, c] = face.map(|corner| vertices[corner as usize]);
            for (corner, normal) in face.iter().zip([b.cross(&c), c.cross(&a), a.cross(&b)]) {
                by_vertex[*corner as usize] += normal * (DENSITY_KG_M3 / 6.0);
            }
        }
        let slope = |i| {
            by_vertex.iter().enumerate().map(|(v, gradient)| gradient.dot(&self.displacement(i, v))).sum()
        };
        (0..self.num_components()).map(slope).collect()
    }
}

/// Mean and covariance of the coefficients once measurements are known.
fn condition(features: &[(usize, &Feature, f64)], n: usize) -> (DVector<f64>, DMatrix<f64>) {
    let count = features.len();
    let slopes = DMatrix::from_fn(count, n, |row, i| features[row].1.slope[i]);
    let off = DVector::from_fn(count, |row, _| features[row].2 - features[row].1.mean);
    let mut spread = &slopes * slopes.transpose();
    for (row, (_, feature, _)) in features.iter().enumerate() {
        // A measurement that coefficients tell exactly must not make the matrix singular.
        spread[(row, row)] += feature.variance + 1e-9 * (1.0 + spread[(row, row)]);
    }
    let identity = DMatrix::identity(n, n);
    match spread.cholesky() {
        Some(factor) => {
            let gain = factor.solve(&slopes).transpose();
            (&gain * off, identity - gain * slopes)
        }
        None => (DVector::zeros(n), identity),
    }
}

fn check_found(alpha: &[f64]) -> Result<()> {
    let most = alpha.iter().fold(0.0, |most: f64, a| most.max(a.abs()));
    if most <= MAX_DEVIATIONS {
        return Ok(());
    }
    let what = format!(
        "those measurements are too unusual: {most:.1} standard deviations from the mean, at most {MAX_DEVIATIONS} are possible"
    );
    Err(Error::Wanted { what })
}
