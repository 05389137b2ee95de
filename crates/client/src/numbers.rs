//! Numbers of the command line. What is not finite would be null in a request, as if it had not been given.

/// Any finite number.
///
/// # Errors
/// If it is none.
pub fn finite(text: &str) -> Result<f64, String> {
    number(text, "a finite number", |_| true)
}

/// A finite number, 0 or above.
///
/// # Errors
/// If it is none.
pub fn not_negative(text: &str) -> Result<f64, String> {
    number(text, "a finite number, 0 or above", |number| number >= 0.0)
}

/// A finite number above 0.
///
/// # Errors
/// If it is none.
pub fn positive(text: &str) -> Result<f64, String> {
    number(text, "a finite number above 0", |number| number > 0.0)
}

/// A whole number, 1 or above.
///
/// # Errors
/// If it is none.
pub fn at_least_one(text: &str) -> Result<usize, String> {
    let number = text.trim().parse().ok().filter(|number| *number > 0);
    number.ok_or_else(|| format!("found {text:?}, expected a whole number, 1 or above"))
}

fn number(text: &str, expected: &str, is_expected: impl Fn(f64) -> bool) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|number: &f64| number.is_finite() && is_expected(*number));
    number.ok_or_else(|| format!("found {text:?}, expected {expected}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_finite_numbers_are_taken() {
        for text in ["nan", "NaN", "-nan", "inf", "-inf", "infinity", "1e999", "", "1,5", "1.8 m"] {
            for parse in [finite, not_negative, positive] {
                let error = parse(text).unwrap_err();
                assert!(error.starts_with(&format!("found {text:?}, expected a finite number")), "{error}");
            }
        }
        assert_eq!([finite("-1.5"), not_negative("0"), positive("1e-3")], [Ok(-1.5), Ok(0.0), Ok(0.001)]);
        assert_eq!(not_negative("-1").unwrap_err(), "found \"-1\", expected a finite number, 0 or above");
        assert_eq!(positive("0").unwrap_err(), "found \"0\", expected a finite number above 0");
        assert_eq!(at_least_one("3"), Ok(3));
        for text in ["0", "-1", "1.5", "some"] {
            let expected = format!("found {text:?}, expected a whole number, 1 or above");
            assert_eq!(at_least_one(text).unwrap_err(), expected);
        }
    }
}
