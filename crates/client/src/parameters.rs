//! Options of the form `NAME=VALUE` as JSON.

use anyhow::Context;
use serde_json::{Map, Value};

/// What `NAME=VALUE` options say.
pub fn pairs(given: &[String], value: impl Fn(&str) -> Value) -> anyhow::Result<Value> {
    given
        .iter()
        .map(|pair| {
            let (name, text) =
                pair.split_once('=').with_context(|| format!("{pair:?} is not of the form NAME=VALUE"))?;
            Ok((name.trim().to_owned(), value(text.trim())))
        })
        .collect::<anyhow::Result<Map<_, _>>>()
        .map(Value::Object)
}

/// `NAME=VALUE` options as parameters: numbers and true where they read as such, else words.
pub fn values(options: &[String]) -> anyhow::Result<Value> {
    pairs(options, |v| serde_json::from_str(v).unwrap_or_else(|_| v.into()))
}
