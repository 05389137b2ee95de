use std::fmt;

/// A count with its noun: `1 trial`, `2 trials`.
pub fn counted(count: impl fmt::Display, noun: &str) -> String {
    let count = count.to_string();
    let ending = if count == "1" { "" } else { "s" };
    format!("{count} {noun}{ending}")
}

/// A number as refusals name it: a great or a tiny one by its exponent instead of hundreds of digits.
pub fn shown(number: f64) -> String {
    let size = number.abs();
    if size < 1e15 && (size >= 1e-6 || size == 0.0) || !size.is_finite() {
        number.to_string()
    } else {
        format!("{number:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_singular() {
        assert_eq!([0, 1, 2].map(|n| counted(n, "trial")), ["0 trials", "1 trial", "2 trials"]);
    }

    #[test]
    fn no_number_has_hundreds_of_digits() {
        assert_eq!(
            [0.25, -3.0, 0.0, 1e-6, 9e14].map(shown),
            ["0.25", "-3", "0", "0.000001", "900000000000000"]
        );
        assert_eq!([1e308, -1e15, 1e-7, -2.5e-300].map(shown), ["1e308", "-1e15", "1e-7", "-2.5e-300"]);
        assert_eq!([f64::NAN, f64::NEG_INFINITY].map(shown), ["NaN", "-inf"]);
    }
}
