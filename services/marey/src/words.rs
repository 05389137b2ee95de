//! Names and units on the command line.

use client::numbers::positive;

/// A name on the command line.
///
/// # Errors
/// If there is nothing in it but blanks.
pub fn name(text: &str) -> Result<String, String> {
    match text.trim() {
        "" => Err(format!("found {text:?}, expected a name")),
        _ => Ok(text.to_owned()),
    }
}

/// Metres of one unit of a file's lengths.
///
/// # Errors
/// If no file has such a unit.
pub fn unit(text: &str) -> Result<f64, String> {
    let metres = positive(text)?;
    if !gateway::UNITS.contains(&metres) {
        return Err(format!("found {text:?}, expected 0.000001 to 1000 metres"));
    }
    Ok(metres)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blanks_are_no_name() {
        assert_eq!(name("take 3"), Ok("take 3".to_owned()));
        for blank in ["", " ", "\t "] {
            assert_eq!(name(blank), Err(format!("found {blank:?}, expected a name")));
        }
    }

    #[test]
    fn units_are_those_that_the_server_takes() {
        assert_eq!(unit("0.01"), Ok(0.01));
        for text in ["2000", "1e-9"] {
            assert_eq!(unit(text), Err(format!("found {text:?}, expected 0.000001 to 1000 metres")));
        }
        assert_eq!(unit("0"), Err("found \"0\", expected a finite number above 0".to_owned()));
    }
}
