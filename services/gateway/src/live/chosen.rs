use serde_json::{Map, Value};

use crate::{error::Result, runs::resolve_parameters};

/// A motion database of the caller's, which a stream learns from.
#[derive(Debug)]
pub(crate) struct Chosen {
    /// its id
    pub database_id: String,
    /// `name@version`
    pub database: String,
}

impl Chosen {
    /// All parameters as JSON, those left out with their defaults.
    ///
    /// # Errors
    /// If one is not known or out of range.
    pub fn parameters(&self, given: Map<String, Value>, has_own_skeleton: bool) -> Result<String> {
        let parameters = resolve_parameters(given, has_own_skeleton)?;
        Ok(serde_json::to_value(parameters)?.to_string())
    }
}
