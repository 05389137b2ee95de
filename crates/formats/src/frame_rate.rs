//! Frame rates from rounded times.

/// Frames per second of a period in seconds that was printed with `decimals` decimals: the whole number that is
/// printed so if there is one (`0.008333` is 120 Hz), else the inverse.
pub(crate) fn from_period(seconds: f64, decimals: usize) -> f64 {
    let rate = 1.0 / seconds;
    let whole = rate.round();
    // programs round or cut off
    let tolerance = 0.1_f64.powi(decimals.min(300) as i32);
    let is_whole =
        whole >= 1.0 && (1.0 / whole - seconds).abs() <= tolerance && (whole / rate - 1.0).abs() < 0.01;
    if is_whole { whole } else { rate }
}

/// Digits after the point of a printed number; with an exponent as many as any number has.
pub(crate) fn decimals(text: &[u8]) -> usize {
    let word = text.split(|b| b.is_ascii_whitespace()).next().unwrap_or_default();
    if word.iter().any(|b| matches!(b, b'e' | b'E')) {
        return 17;
    }
    word.iter().position(|b| *b == b'.').map_or(0, |point| word.len() - point - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_period_that_was_rounded_gives_the_whole_rate() {
        for (text, rate) in [
            ("0.0083333", 120.0),
            ("0.00833333", 120.0),
            (".0333", 30.0),
            ("0.04", 25.0),
            ("0.0166667", 60.0),
        ] {
            assert_eq!(from_period(text.parse().unwrap(), decimals(text.as_bytes())), rate, "{text}");
        }
    }

    #[test]
    fn a_rate_that_is_not_whole_stays_so() {
        let rate = from_period(0.033367, 6);
        assert!((rate - 29.97).abs() < 0.001, "{rate}");
        assert_eq!(from_period(0.5, 1), 2.0);
        assert_eq!(from_period(4.0, 0), 0.25);
    }
}
