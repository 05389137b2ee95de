//! Names on the command line.

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

#[cfg(test)]
mod tests {
    use super::name;

    #[test]
    fn blanks_are_no_name() {
        assert_eq!(name("take 3"), Ok("take 3".to_owned()));
        for blank in ["", " ", "\t "] {
            assert_eq!(name(blank), Err(format!("found {blank:?}, expected a name")));
        }
    }
}
