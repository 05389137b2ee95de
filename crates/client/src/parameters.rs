//! Options of the form `NAME=VALUE` as JSON.

use anyhow::{Context, bail};
use serde_json::{Map, Value, map::Entry};

/// What options of a form such as `NAME=VALUE` say.
///
/// # Errors
/// If one is not of the form, has nothing before or after the sign, or two have the same name.
pub fn pairs(
    given: &[String],
    form: &str,
    value: impl Fn(&str) -> Value,
) -> anyhow::Result<Map<String, Value>> {
    let mut said = Map::new();
    for pair in given {
        let (name, text) =
            pair.split_once('=').with_context(|| format!("{pair:?} is not of the form {form}"))?;
        let (name, text) = (name.trim(), text.trim());
        if name.is_empty() || text.is_empty() {
            let lacks = if name.is_empty() { "a name before" } else { "a value after" };
            bail!("{pair:?} needs {lacks} \"=\": {form}");
        }
        match said.entry(name) {
            Entry::Vacant(entry) => entry.insert(value(text)),
            Entry::Occupied(_) => bail!("{name:?} is given twice, expected one {form} for it"),
        };
    }
    Ok(said)
}

/// `NAME=VALUE` options as parameters: numbers and true where they read as such, else words.
///
/// # Errors
/// As [`pairs`].
pub fn values(options: &[String]) -> anyhow::Result<Map<String, Value>> {
    pairs(options, "NAME=VALUE", |v| serde_json::from_str(v).unwrap_or_else(|_| v.into()))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_name_has_one_value() {
        let given = |options: &[&str]| -> Vec<String> { options.iter().map(|o| (*o).to_owned()).collect() };
        let read = values(&given(&["neighbours=8", "smooth = true", "mode=a=b"])).unwrap();
        assert_eq!(Value::Object(read), json!({"neighbours": 8, "smooth": true, "mode": "a=b"}));
        let twice = values(&given(&["neighbours=8", "neighbours =9"])).unwrap_err().to_string();
        assert_eq!(twice, "\"neighbours\" is given twice, expected one NAME=VALUE for it");
        let (name, value) = ("a name before", "a value after");
        for (pair, lacks) in [("=root", name), (" = root", name), ("a=", value), ("=", name)] {
            let message = pairs(&given(&[pair]), "MARKER=POINT", |name| name.into()).unwrap_err().to_string();
            assert_eq!(message, format!("{pair:?} needs {lacks} \"=\": MARKER=POINT"));
        }
        let word = pairs(&given(&["foo"]), "FILE=CAMERA", |name| name.into()).unwrap_err().to_string();
        assert_eq!(word, "\"foo\" is not of the form FILE=CAMERA");
    }
}
