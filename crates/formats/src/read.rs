use std::fmt;

use model::counted;

use crate::Place;

/// Warnings kept per file; the rest are only counted, so that a hostile file can't fill memory with them.
const KEPT: usize = 50;

/// What was read, and what was doubtful about the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Read<T> {
    /// the value
    pub value: T,
    /// what the reader accepted although the format forbids it, in the order of the file
    pub warnings: Vec<Warning>,
}

impl<T> Read<T> {
    /// The same warnings beside another value.
    pub fn map<U>(self, f: impl FnOnce(T) -> U) -> Read<U> {
        Read { value: f(self.value), warnings: self.warnings }
    }
}

/// Something that a reader accepted although it should not be so.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// where
    pub place: Place,
    /// what was found and how it was understood
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.place {
            Place::File => f.write_str(&self.message),
            place => write!(f, "{place}: {}", self.message),
        }
    }
}

/// Collects warnings while a file is read.
#[derive(Debug, Default)]
pub(crate) struct Warnings {
    kept: Vec<Warning>,
    dropped: usize,
}

impl Warnings {
    pub(crate) fn add(&mut self, place: Place, message: impl Into<String>) {
        if self.kept.len() < KEPT {
            self.kept.push(Warning { place, message: message.into() });
        } else {
            self.dropped += 1;
        }
    }

    pub(crate) fn line(&mut self, line: usize, message: impl Into<String>) {
        self.add(Place::Line(line), message);
    }

    pub(crate) fn beside<T>(mut self, value: T) -> Read<T> {
        if self.dropped > 0 {
            let message = format!("{} not shown", counted(self.dropped, "more warning"));
            self.kept.push(Warning { place: Place::File, message });
        }
        Read { value, warnings: self.kept }
    }
}
