//! Why a request can't be read, in the words of those who write it: where, what was found, what was expected.

use std::fmt;

use serde::de::{self, Unexpected};

/// Most characters of a request that are repeated to its sender.
const MAX_QUOTED_CHARS: usize = 80;

/// Why a request, or a part of it, is not what it should be.
#[derive(Debug, PartialEq)]
pub(crate) struct Refusal {
    /// where, from the inside outwards
    at: Vec<Step>,
    what: What,
}

/// One step into a request.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Step {
    Field(String),
    Item(usize),
}

#[derive(Debug, PartialEq)]
enum What {
    Found { found: String, expected: String },
    Missing(&'static str),
    Unknown { field: String, known: &'static [&'static str] },
    Twice(String),
    Other(String),
}

impl Refusal {
    /// Something else was found than expected.
    pub fn found(found: impl Into<String>, expected: impl Into<String>) -> Self {
        Self::new(What::Found { found: found.into(), expected: expected.into() })
    }

    fn new(what: What) -> Self {
        Self { at: Vec::new(), what }
    }

    /// The same, seen from outside the field or item that it is in.
    #[must_use]
    pub fn within(mut self, step: Step) -> Self {
        self.at.push(step);
        self
    }

    /// Whether that field of the outermost object is missing.
    pub fn lacks(&self, field: &str) -> bool {
        self.at.is_empty() && matches!(self.what, What::Missing(missing) if missing == field)
    }

    /// Where that field of the refused object is.
    fn path_to(&self, field: &str) -> String {
        path(self.at.iter().rev().chain([&Step::Field(field.to_owned())]))
    }
}

/// A way into a request, as a sentence has it: `inverse_kinematics.alpha[2]`.
pub(crate) fn path<'a>(steps: impl IntoIterator<Item = &'a Step>) -> String {
    steps.into_iter().fold(String::new(), |path, step| match step {
        Step::Item(number) => format!("{path}[{number}]"),
        Step::Field(field) if path.is_empty() => shortened(field),
        Step::Field(field) => format!("{path}.{}", shortened(field)),
    })
}

/// Text of a request without quotes: a name, as far as it is repeated to its sender.
pub(crate) fn shortened(text: &str) -> String {
    let visible = |c: char| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c };
    text.chars().take(MAX_QUOTED_CHARS).map(visible).collect()
}

/// Text of a request, in quotes.
pub(crate) fn quoted(text: &str) -> String {
    format!("{:?}", text.chars().take(MAX_QUOTED_CHARS).collect::<String>())
}

/// Words as a sentence has them: `x, y or z`.
pub(crate) fn one_of(words: &[&str]) -> String {
    match words {
        [] => "nothing".to_owned(),
        [only] => (*only).to_owned(),
        [words @ .., last] => format!("{} or {last}", words.join(", ")),
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at = path(self.at.iter().rev());
        match &self.what {
            What::Found { found, expected } if at.is_empty() => {
                write!(f, "the request is {found}, expected {expected}")
            }
            What::Found { found, expected } => write!(f, "{at} is {found}, expected {expected}"),
            What::Missing(field) => write!(f, "{} is missing", self.path_to(field)),
            What::Unknown { field, known: [] } => {
                write!(f, "{} is not known; there are none", self.path_to(field))
            }
            What::Unknown { field, known } => {
                write!(f, "{} is not known; there are: {}", self.path_to(field), known.join(", "))
            }
            What::Twice(field) => write!(f, "{} is given twice, expected once", self.path_to(field)),
            What::Other(message) if at.is_empty() => f.write_str(message),
            What::Other(message) => write!(f, "{at}: {message}"),
        }
    }
}

impl std::error::Error for Refusal {}

impl de::Error for Refusal {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self::new(What::Other(message.to_string()))
    }

    fn invalid_type(found: Unexpected<'_>, expected: &dyn de::Expected) -> Self {
        Self::found(found_in_words(found), expected_in_words(&expected.to_string()))
    }

    fn invalid_value(found: Unexpected<'_>, expected: &dyn de::Expected) -> Self {
        let expected = expected.to_string();
        let limit = match (found, expected.as_str()) {
            (Unexpected::Unsigned(_), "u8") => Some(u64::from(u8::MAX)),
            (Unexpected::Unsigned(_), "u16") => Some(u64::from(u16::MAX)),
            (Unexpected::Unsigned(_), "u32") => Some(u64::from(u32::MAX)),
            _ => None,
        };
        let expected = limit.map_or_else(|| expected_in_words(&expected), |limit| format!("at most {limit}"));
        Self::found(found_in_words(found), expected)
    }

    fn invalid_length(found: usize, expected: &dyn de::Expected) -> Self {
        Self::found(format!("an array of {found}"), expected_in_words(&expected.to_string()))
    }

    fn unknown_variant(found: &str, known: &'static [&'static str]) -> Self {
        Self::found(quoted(found), one_of(known))
    }

    fn unknown_field(field: &str, known: &'static [&'static str]) -> Self {
        Self::new(What::Unknown { field: field.to_owned(), known })
    }

    fn missing_field(field: &'static str) -> Self {
        Self::new(What::Missing(field))
    }

    fn duplicate_field(field: &'static str) -> Self {
        Self::new(What::Twice(field.to_owned()))
    }
}

fn found_in_words(found: Unexpected<'_>) -> String {
    match found {
        Unexpected::Bool(value) => value.to_string(),
        Unexpected::Unsigned(value) => value.to_string(),
        Unexpected::Signed(value) => value.to_string(),
        Unexpected::Float(value) => format!("{value:?}"),
        Unexpected::Str(text) => quoted(text),
        Unexpected::Char(c) => quoted(&c.to_string()),
        Unexpected::Unit | Unexpected::Option => "null".to_owned(),
        Unexpected::Seq => "an array".to_owned(),
        Unexpected::Map => "an object".to_owned(),
        other => other.to_string(),
    }
}

/// Names of the program's own types are nothing to whoever writes a request.
fn expected_in_words(expected: &str) -> String {
    match expected {
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number of 0 or more",
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number",
        "f32" | "f64" => "a number",
        "a boolean" => "true or false",
        "string" | "a string" | "str" | "a borrowed string" => "text",
        "a sequence" => "an array",
        "a map" => "an object",
        other if other.starts_with("struct ") => "an object",
        other if other.starts_with("an array of length ") => {
            return other.replacen("an array of length", "one of", 1);
        }
        other if other.starts_with("tuple ") => "an array",
        other => other,
    }
    .to_owned()
}
