//! Bodies of a model, by coefficients or by measurements.

use body::{BodyModel, Sex, Shape, Wanted};
use proto::v1;

use crate::{InputError, error::CallError};

/// Largest coefficient, standard deviations.
const MOST: f64 = 6.0;

/// The body that a request describes.
///
/// # Errors
/// If it describes none, or one in two ways.
pub(crate) fn sample(model: &BodyModel, request: &v1::SampleBodyRequest) -> Result<Shape, CallError> {
    let sex = match request.sex.as_str() {
        "" => None,
        "female" => Some(Sex::Female),
        "male" => Some(Sex::Male),
        other => return Err(out_of_range("sex", other, "female or male").into()),
    };
    let wanted =
        Wanted { stature_m: request.stature_m, mass_kg: request.mass_kg, age_years: request.age_years, sex };
    if request.alpha.is_empty() {
        return Ok(model.shape(&model.alpha_for(&wanted).map_err(InputError::from)?));
    }
    if wanted != Wanted::default() {
        return Err(out_of_range("alpha", "given beside measurements", "one of the two").into());
    }
    if request.alpha.len() > model.num_components() {
        let found = format!("{} numbers", request.alpha.len());
        return Err(out_of_range("alpha", &found, "at most as many as the model has components").into());
    }
    if let Some(found) = request.alpha.iter().find(|a| a.is_nan() || a.abs() > MOST) {
        return Err(out_of_range("alpha", &found.to_string(), "-6 to 6 standard deviations").into());
    }
    Ok(model.shape(&request.alpha))
}

pub(crate) fn out_of_range(field: &'static str, found: &str, expected: &'static str) -> proto::Error {
    proto::Error::OutOfRange { field, found: found.to_owned(), expected }
}
