use body::{BodyModel, MAX_DEVIATIONS, Sex, Shape, Wanted};
use jobs::inverse_kinematics::BodyDescription;
use model::counted;

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

/// The sex that a call names; empty: not said.
///
/// # Errors
/// If it is another word.
pub fn sex(word: &str) -> Result<Option<Sex>, proto::Error> {
    if word.is_empty() {
        return Ok(None);
    }
    let expected = "female or male";
    let sex =
        word.parse().map_err(|_| proto::Error::OutOfRange { field: "sex", found: word.to_owned(), expected });
    sex.map(Some)
}

/// The body of a description: of coefficients, or of simple measurements.
///
/// # Errors
/// If it describes none, or one in two ways.
pub fn shape(model: &BodyModel, described: &BodyDescription) -> Result<Shape, ShapeError> {
    let refuse = |field, found: String, expected| {
        Err(ShapeError::Request(proto::Error::OutOfRange { field, found, expected }))
    };
    let BodyDescription { alpha, stature_m, mass_kg, age_years, sex } = described;
    let wanted = Wanted { stature_m: *stature_m, mass_kg: *mass_kg, age_years: *age_years, sex: *sex };
    if alpha.is_empty() {
        return Ok(model.shape(&model.alpha_for(&wanted)?));
    }
    if wanted != Wanted::default() {
        return refuse("alpha", "given beside measurements".to_owned(), "one of the two");
    }
    if alpha.len() > model.num_components() {
        let found = counted(alpha.len(), "number");
        return refuse("alpha", found, "at most as many as the model has components");
    }
    if let Some(found) = alpha.iter().find(|a| a.is_nan() || a.abs() > MAX_DEVIATIONS) {
        return refuse("alpha", found.to_string(), "-6 to 6 standard deviations");
    }
    Ok(model.shape(alpha))
}
