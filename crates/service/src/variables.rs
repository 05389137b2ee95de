//! Settings as text, by name.

use crate::Error;
use std::{fmt::Display, ops::RangeInclusive, str::FromStr};

/// Where settings come from: the environment, or a map in tests.
pub struct Variables<'a> {
    read: &'a dyn Fn(&str) -> Option<String>,
}

impl<'a> Variables<'a> {
    /// Reads through `read`; [`environment`] is the usual one. An empty value counts as not set.
    pub fn new(read: &'a dyn Fn(&str) -> Option<String>) -> Self {
        Self { read }
    }

    /// A setting, if it is there and not empty.
    pub fn get(&self, name: &str) -> Option<String> {
        (self.read)(name).filter(|value| !value.is_empty())
    }

    /// What stands between commas.
    pub fn list(&self, name: &str) -> Vec<String> {
        let text = self.get(name).unwrap_or_default();
        text.split(',').map(str::trim).filter(|part| !part.is_empty()).map(str::to_owned).collect()
    }

    pub(crate) fn required(&self, name: &'static str, expected: &'static str) -> Result<String, Error> {
        self.get(name).ok_or(Error::NotSet { name, expected })
    }

    pub(crate) fn parse<T: FromStr<Err: Display>>(&self, name: &'static str, text: &str) -> Result<T, Error> {
        text.parse().map_err(|e: T::Err| Error::BadValue {
            name,
            found: text.to_owned(),
            expected: format!("a valid value: {e}"),
        })
    }

    /// Reads a setting into `to`, which stays as it is where there is none.
    ///
    /// # Errors
    /// [`Error::BadValue`].
    pub fn set<T: FromStr<Err: Display>>(&self, name: &'static str, to: &mut T) -> Result<(), Error> {
        if let Some(text) = self.get(name) {
            *to = self.parse(name, &text)?;
        }
        Ok(())
    }

    /// [`set`](Self::set) for a number that must lie in a range.
    ///
    /// # Errors
    /// [`Error::BadValue`].
    pub fn set_within<T: FromStr<Err: Display> + PartialOrd + Display + Copy>(
        &self,
        name: &'static str,
        to: &mut T,
        range: RangeInclusive<T>,
    ) -> Result<(), Error> {
        let mut value = *to;
        self.set(name, &mut value)?;
        if !range.contains(&value) {
            return Err(Error::BadValue {
                name,
                found: value.to_string(),
                expected: format!("{} to {}", range.start(), range.end()),
            });
        }
        *to = value;
        Ok(())
    }
}

/// Reads one variable of the process environment.
pub fn environment(name: &str) -> Option<String> {
    std::env::var(name).ok()
}
