use body::{BodyModel, Sex, Shape, Wanted};

/// Largest coefficient, standard deviations.
const MOST: f64 = 6.0;

/// A body as people describe it: by coefficients or by simple measurements.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Described<'a> {
    /// coefficients, standard deviations; with any, nothing else may be given
    pub alpha: &'a [f64],
    /// metres
    pub stature_m: Option<f64>,
    /// kilograms
    pub mass_kg: Option<f64>,
    /// years
    pub age_years: Option<f64>,
    /// `female` or `male`; empty: not said
    pub sex: &'a str,
}

/// Why a description is of no body.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// Something about it makes no sense.
    #[error(transparent)]
    Request(#[from] proto::Error),
    /// The model has no such body.
    #[error(transparent)]
    Body(#[from] body::Error),
}

impl Described<'_> {
    /// The body.
    ///
    /// # Errors
    /// If it describes none, or one in two ways.
    pub fn shape(&self, model: &BodyModel) -> Result<Shape, ShapeError> {
        let refuse = |field, found: String, expected| {
            Err(ShapeError::Request(proto::Error::OutOfRange { field, found, expected }))
        };
        let sex = match self.sex {
            "" => None,
            "female" => Some(Sex::Female),
            "male" => Some(Sex::Male),
            other => return refuse("sex", other.to_owned(), "female or male"),
        };
        let Self { stature_m, mass_kg, age_years, .. } = *self;
        let wanted = Wanted { stature_m, mass_kg, age_years, sex };
        if self.alpha.is_empty() {
            return Ok(model.shape(&model.alpha_for(&wanted)?));
        }
        if wanted != Wanted::default() {
            return refuse("alpha", "given beside measurements".to_owned(), "one of the two");
        }
        if self.alpha.len() > model.num_components() {
            let found = format!("{} numbers", self.alpha.len());
            return refuse("alpha", found, "at most as many as the model has components");
        }
        if let Some(found) = self.alpha.iter().find(|a| a.is_nan() || a.abs() > MOST) {
            return refuse("alpha", found.to_string(), "-6 to 6 standard deviations");
        }
        Ok(model.shape(self.alpha))
    }
}
