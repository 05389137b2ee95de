use crate::error::{Error, Result};

/// Units of length that files may have, metres.
const UNITS: std::ops::RangeInclusive<f64> = 1e-6..=1e3;

/// Refuses a unit of length, metres, that no file has.
pub(super) fn check_unit(field: &str, metres: Option<f64>) -> Result<()> {
    match metres.filter(|metres| !UNITS.contains(metres)) {
        Some(metres) => Err(Error::Unprocessable(format!("{field} is {metres}, expected 0.000001 to 1000"))),
        None => Ok(()),
    }
}
