//! Lines, words, numbers and names of text formats.

use std::collections::HashMap;

/// One line without its end and without blanks around it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Line<'a> {
    /// from 1
    pub(crate) number: usize,
    pub(crate) text: &'a [u8],
}

/// The lines of a file; LF, CRLF and CR end a line, a byte order mark is skipped.
#[derive(Debug, Clone)]
pub(crate) struct Lines<'a> {
    rest: &'a [u8],
    number: usize,
}

impl<'a> Lines<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), number: 0 }
    }

    /// Number of the line read last.
    pub(crate) fn number(&self) -> usize {
        self.number
    }

    /// What follows the line read last.
    pub(crate) fn rest(&self) -> &'a [u8] {
        self.rest
    }

    /// The next line with the blanks around it.
    pub(crate) fn next_untrimmed(&mut self) -> Option<Line<'a>> {
        if self.rest.is_empty() {
            return None;
        }
        self.number += 1;
        let end = self.rest.iter().position(|b| matches!(b, b'\n' | b'\r')).unwrap_or(self.rest.len());
        let text = &self.rest[..end];
        let after = if self.rest[end..].starts_with(b"\r\n") { end + 2 } else { end + 1 };
        self.rest = self.rest.get(after..).unwrap_or_default();
        Some(Line { number: self.number, text })
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = Line<'a>;

    fn next(&mut self) -> Option<Line<'a>> {
        self.next_untrimmed().map(|line| Line { text: line.text.trim_ascii(), ..line })
    }
}

/// The words of a line: what blanks separate.
pub(crate) fn words(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(|b| b.is_ascii_whitespace()).filter(|w| !w.is_empty())
}

/// A number as C prints it; infinities and NaN are numbers here.
pub(crate) fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A number that is neither infinite nor NaN.
pub(crate) fn finite(word: &[u8]) -> Option<f64> {
    number(word).filter(|v| v.is_finite())
}

/// A name as it is stored.
pub(crate) fn name(word: &[u8]) -> String {
    String::from_utf8_lossy(word).into_owned()
}

/// Bytes of a file in a message: in quotes, not longer than a message should be.
pub(crate) fn quote(bytes: &[u8]) -> String {
    const LONGEST: usize = 40;
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(4 * LONGEST)]);
    if text.chars().count() <= LONGEST {
        format!("{:?}", text)
    } else {
        format!("{:?}…", text.chars().take(LONGEST).collect::<String>())
    }
}

/// Appends a number with at most seven decimals, without trailing zeros.
pub(crate) fn push_number(out: &mut String, value: f64) {
    use std::fmt::Write as _;
    let start = out.len();
    // writing to a String can't fail
    let _ = write!(out, "{value:.7}");
    let kept = out[start..].trim_end_matches('0').trim_end_matches('.').len();
    out.truncate(start + kept);
    if &out[start..] == "-0" {
        out.replace_range(start.., "0");
    }
}

/// Names given so far, to keep them apart.
#[derive(Debug, Default)]
pub(crate) struct Names {
    /// the number that the next of that name gets
    next: HashMap<String, usize>,
}

impl Names {
    /// Names that nothing else may have.
    pub(crate) fn reserved(names: &[&str]) -> Self {
        Self { next: names.iter().map(|n| ((*n).to_owned(), 2)).collect() }
    }

    /// `name`, or `name_2`, `name_3`, … if it is taken.
    pub(crate) fn unique(&mut self, name: &str) -> String {
        let Some(mut number) = self.next.get(name).copied() else {
            self.next.insert(name.to_owned(), 2);
            return name.to_owned();
        };
        loop {
            let candidate = format!("{name}_{number}");
            number += 1;
            if !self.next.contains_key(&candidate) {
                self.next.insert(name.to_owned(), number);
                self.next.insert(candidate.clone(), 2);
                return candidate;
            }
        }
    }

    /// As `unique`, without blanks and without the characters of `marks`, which mean something in the format.
    pub(crate) fn unique_word(&mut self, name: &str, marks: &[char]) -> String {
        let is_bad = |c: char| c.is_whitespace() || c.is_control() || marks.contains(&c);
        let word = name.replace(is_bad, "_");
        self.unique(if word.is_empty() { "joint" } else { &word })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_kinds_of_line_end_count_as_one() {
        let lines: Vec<_> =
            Lines::new(b"\xef\xbb\xbfa\r\n\nb\rc").map(|l| (l.number, l.text.to_vec())).collect();
        assert_eq!(lines, [(1, b"a".to_vec()), (2, vec![]), (3, b"b".to_vec()), (4, b"c".to_vec())]);
    }

    #[test]
    fn numbers_are_written_without_trailing_zeros() {
        let mut out = String::new();
        for value in [1.5, -0.0, 100.0, 1e-9, -2.25] {
            push_number(&mut out, value);
            out.push(' ');
        }
        assert_eq!(out, "1.5 0 100 0 -2.25 ");
    }

    #[test]
    fn names_that_are_taken_get_a_number() {
        let mut names = Names::reserved(&["root"]);
        let given = ["a", "a_2", "a", "a", "root", "b c"].map(|name| names.unique_word(name, &[]));
        assert_eq!(given, ["a", "a_2", "a_3", "a_4", "root_2", "b_c"]);
    }
}
