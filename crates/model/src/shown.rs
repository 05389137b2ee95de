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

/// A frame rate as people read it, Hz: to a thousandth, or to three digits below 1, since rates come out of rounded periods:
/// 59.999999999999986 is `60`, 60000 / 1001 is `59.94`.
pub fn shown_rate(rate: f64) -> String {
    if !(1e-6..1e9).contains(&rate) {
        return shown(rate);
    }
    let digits_after_point = 3.max(2 - rate.log10().floor() as i32) as usize;
    let rounded = format!("{rate:.digits_after_point$}");
    rounded.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_singular() {
        assert_eq!([0, 1, 2].map(|n| counted(n, "trial")), ["0 trials", "1 trial", "2 trials"]);
    }

    #[test]
    fn rates_are_short() {
        let ntsc = [24e3 / 1001.0, 30e3 / 1001.0, 60e3 / 1001.0, 120e3 / 1001.0];
        assert_eq!(ntsc.map(shown_rate), ["23.976", "29.97", "59.94", "119.88"]);
        let whole = [59.999999999999986, 60.0, 120.00000000000001, 1000.0];
        assert_eq!(whole.map(shown_rate), ["60", "60", "120", "1000"]);
        assert_eq!([12.5, 1.0 / 3.0, 0.0125, 1e-6].map(shown_rate), ["12.5", "0.333", "0.0125", "0.000001"]);
        assert_eq!([0.0, -1.0, 1e12, f64::NAN].map(shown_rate), ["0", "-1", "1000000000000", "NaN"]);
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
