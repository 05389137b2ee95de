use model::shown;

use crate::error::{Error, Result};

/// Units of length that files may have, metres.
pub const UNITS: std::ops::RangeInclusive<f64> = 1e-6..=1e3;

/// Refuses a unit of length, metres, that no file has.
pub(super) fn check_unit(field: &str, metres: Option<f64>) -> Result<()> {
    match metres.filter(|metres| !UNITS.contains(metres)) {
        Some(metres) => Err(Error::Unprocessable(format!(
            "{field} is {}, expected 0.000001 to 1000 metres",
            shown(metres)
        ))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_that_no_file_has_are_refused() {
        for metres in [None, Some(1e-6), Some(0.01), Some(1e3)] {
            check_unit("unit", metres).unwrap();
        }
        for (metres, found) in [(0.0, "0"), (-0.01, "-0.01"), (1e308, "1e308"), (1e-300, "1e-300")] {
            let error = check_unit("unit", Some(metres)).unwrap_err().to_string();
            assert_eq!(error, format!("unit is {found}, expected 0.000001 to 1000 metres"));
        }
    }
}
