//! Words that depend on numbers, and names.

/// A number with its noun: `1 trial`, `2 trials`.
pub fn counted(count: u64, noun: &str) -> String {
    match count {
        1 => format!("1 {noun}"),
        _ => format!("{count} {noun}s"),
    }
}

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
    use super::{counted, name};

    #[test]
    fn blanks_are_no_name() {
        assert_eq!(name("take 3"), Ok("take 3".to_owned()));
        for blank in ["", " ", "\t "] {
            assert_eq!(name(blank), Err(format!("found {blank:?}, expected a name")));
        }
    }

    #[test]
    fn one_is_singular() {
        assert_eq!([0, 1, 2].map(|n| counted(n, "trial")), ["0 trials", "1 trial", "2 trials"]);
    }
}
