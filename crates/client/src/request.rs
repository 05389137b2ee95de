//! Requests that are built from options of the command line.

use serde_json::{Map, Value};

use crate::in_options::{Field, in_options};

/// The JSON of a request, and which option each of its fields is from: refusals by the server name fields, and whoever gave
/// options knows nothing of those.
#[derive(Debug, Clone, Default)]
pub struct Request {
    body: Map<String, Value>,
    fields: Vec<Field>,
}

impl Request {
    /// A field of that path, with the value of an option that may have been left out.
    #[must_use]
    pub fn with(mut self, path: &'static str, option: &'static str, value: Option<impl Into<Value>>) -> Self {
        let value = value.map(Into::into);
        let has_names = value.as_ref().is_some_and(Value::is_object);
        self.fields.push(Field { path, option, is_given: value.is_some(), has_names });
        if let Some(value) = value {
            put(&mut self.body, path, value);
        }
        self
    }

    /// The request as it is sent.
    pub fn to_json(&self) -> Value {
        Value::Object(self.body.clone())
    }

    /// What the server says of the request, with options in the place of fields.
    pub fn in_options(&self, said: &str) -> String {
        in_options(&self.fields, said)
    }
}

/// Puts a value where `path` leads, through objects that are made on the way.
fn put(object: &mut Map<String, Value>, path: &str, value: Value) {
    match path.split_once('.') {
        None => {
            object.insert(path.to_owned(), value);
        }
        Some((first, rest)) => {
            let inner = object.entry(first).or_insert_with(|| Map::new().into());
            if let Value::Object(inner) = inner {
                put(inner, rest, value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn options_that_were_given_are_fields() {
        let request = Request::default()
            .with("kind", "--kind", None::<String>)
            .with("points", "--points", Some(json!(["head"])))
            .with("inverse_kinematics.sex", "--sex", Some("male"))
            .with("inverse_kinematics.mass_kg", "--mass", None::<f64>)
            .with("inverse_kinematics.steps", "--steps", Some(3));
        let expected = json!({"points": ["head"], "inverse_kinematics": {"sex": "male", "steps": 3}});
        assert_eq!(request.to_json(), expected);
        assert_eq!(Request::default().to_json(), json!({}));
    }
}
