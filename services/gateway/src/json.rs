//! The JSON of requests. It is read more strictly than JSON asks for: a key is given once, no text has a NUL
//! (PostgreSQL's text can't hold it), an object is not written as an array. A field that is null counts as left out.

use std::{cell::RefCell, fmt};

use serde::{
    Deserializer,
    de::{
        DeserializeOwned, DeserializeSeed, Error as _, Expected, MapAccess, SeqAccess, Unexpected, Visitor,
        value::BorrowedStrDeserializer,
    },
    forward_to_deserialize_any,
};
use serde_json::{Map, Value};

use crate::{
    error::{Error, Result},
    refusal::{Refusal, Step, one_of, path},
};

/// Reads the body of a request, or a message; `what` it is, in words.
pub(crate) fn parse(what: &str, bytes: &[u8]) -> Result<Value> {
    let fault = RefCell::new(None);
    let mut reader = serde_json::Deserializer::from_slice(bytes);
    let value = Strict { place: &Place { outer: None, step: None }, fault: &fault }
        .deserialize(&mut reader)
        .and_then(|value| reader.end().map(|()| value))
        .map_err(|error| Error::BadRequest(format!("{what} is not JSON: {error}")))?;
    fault.into_inner().map_or(Ok(value), |fault| Err(Error::Unprocessable(fault)))
}

/// Reads a request, or a part of one.
pub(crate) fn read<T: DeserializeOwned>(value: &Value) -> Result<T, Refusal> {
    T::deserialize(Node(value))
}

/// Reads further parameters by name.
pub(crate) fn read_parameters<T: DeserializeOwned>(given: Map<String, Value>) -> Result<T> {
    read(&Value::Object(given)).map_err(|refusal| refusal.within(Step::Field("parameters".into())).into())
}

/// Where in a request something is.
struct Place<'a> {
    outer: Option<&'a Place<'a>>,
    step: Option<Step>,
}

impl Place<'_> {
    fn path(&self) -> String {
        let mut steps = Vec::new();
        let mut at = Some(self);
        while let Some(place) = at {
            steps.extend(&place.step);
            at = place.outer;
        }
        path(steps.into_iter().rev())
    }
}

/// Reads any JSON, and keeps the first fault of what is JSON nevertheless.
struct Strict<'a> {
    place: &'a Place<'a>,
    fault: &'a RefCell<Option<String>>,
}

impl Strict<'_> {
    fn refuse(&self, fault: impl FnOnce() -> String) {
        self.fault.borrow_mut().get_or_insert_with(fault);
    }

    fn check_text(&self, text: &str) {
        if text.contains('\0') {
            self.refuse(|| {
                let path = self.place.path();
                let path = if path.is_empty() { "the request" } else { &path };
                format!("{path} has a NUL character (\\u0000), expected text without")
            });
        }
    }
}

impl<'de> DeserializeSeed<'de> for Strict<'_> {
    type Value = Value;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Value, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Strict<'_> {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JSON")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_f64<E>(self, value: f64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_str<E>(self, text: &str) -> Result<Value, E> {
        self.check_text(text);
        Ok(text.into())
    }

    fn visit_string<E>(self, text: String) -> Result<Value, E> {
        self.check_text(&text);
        Ok(text.into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Value, A::Error> {
        let mut array = Vec::new();
        loop {
            let place = Place { outer: Some(self.place), step: Some(Step::Item(array.len())) };
            match items.next_element_seed(Strict { place: &place, fault: self.fault })? {
                Some(item) => array.push(item),
                None => return Ok(array.into()),
            }
        }
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Value, A::Error> {
        let mut object = Map::new();
        while let Some(key) = entries.next_key::<String>()? {
            let place = Place { outer: Some(self.place), step: Some(Step::Field(key.clone())) };
            let inner = Strict { place: &place, fault: self.fault };
            inner.check_text(&key);
            if object.contains_key(&key) {
                inner.refuse(|| format!("{} is given twice, expected once", place.path()));
            }
            object.insert(key, entries.next_value_seed(inner)?);
        }
        Ok(object.into())
    }
}

/// A value that a request, or a part of one, is read from.
struct Node<'de>(&'de Value);

impl Node<'_> {
    fn unexpected(&self) -> Unexpected<'_> {
        match self.0 {
            Value::Null => Unexpected::Unit,
            Value::Bool(value) => Unexpected::Bool(*value),
            Value::Number(number) => match (number.as_u64(), number.as_i64()) {
                (Some(value), _) => Unexpected::Unsigned(value),
                (None, Some(value)) => Unexpected::Signed(value),
                (None, None) => Unexpected::Float(number.as_f64().unwrap_or(f64::NAN)),
            },
            Value::String(text) => Unexpected::Str(text),
            Value::Array(_) => Unexpected::Seq,
            Value::Object(_) => Unexpected::Map,
        }
    }
}

impl<'de> Deserializer<'de> for Node<'de> {
    type Error = Refusal;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refusal> {
        match self.0 {
            Value::Null => visitor.visit_unit(),
            Value::Bool(value) => visitor.visit_bool(*value),
            Value::Number(number) => match (number.as_u64(), number.as_i64()) {
                (Some(value), _) => visitor.visit_u64(value),
                (None, Some(value)) => visitor.visit_i64(value),
                (None, None) => visitor.visit_f64(number.as_f64().unwrap_or(f64::NAN)),
            },
            Value::String(text) => visitor.visit_borrowed_str(text),
            Value::Array(array) => {
                // the visitor knows its length, and is gone when it turns out that there are more
                let expected = (&visitor as &dyn Expected).to_string();
                let mut items = Items { rest: array, number: 0 };
                let value = visitor.visit_seq(&mut items)?;
                match items.rest {
                    [] => Ok(value),
                    _ => Err(Refusal::invalid_length(array.len(), &expected.as_str())),
                }
            }
            Value::Object(object) => visitor.visit_map(Fields::new(object, &[])),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refusal> {
        if self.0.is_null() { visitor.visit_none() } else { visitor.visit_some(self) }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, Refusal> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        known: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Refusal> {
        match self.0 {
            Value::Object(object) => visitor.visit_map(Fields::new(object, known)),
            _ => Err(Refusal::invalid_type(self.unexpected(), &"a map")),
        }
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        known: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Refusal> {
        match self.0 {
            Value::String(word) => visitor.visit_enum(BorrowedStrDeserializer::new(word)),
            _ => Err(Refusal::invalid_type(self.unexpected(), &one_of(known).as_str())),
        }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit
        unit_struct seq tuple tuple_struct map identifier ignored_any
    }
}

struct Items<'de> {
    rest: &'de [Value],
    number: usize,
}

impl<'de> SeqAccess<'de> for &mut Items<'de> {
    type Error = Refusal;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Refusal> {
        let Some((item, rest)) = self.rest.split_first() else { return Ok(None) };
        let number = self.number;
        (self.rest, self.number) = (rest, number + 1);
        seed.deserialize(Node(item)).map(Some).map_err(|refusal| refusal.within(Step::Item(number)))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.rest.len())
    }
}

struct Fields<'de> {
    rest: serde_json::map::Iter<'de>,
    /// those that count as left out when they are null
    known: &'static [&'static str],
    last: Option<(&'de str, &'de Value)>,
}

impl<'de> Fields<'de> {
    fn new(object: &'de Map<String, Value>, known: &'static [&'static str]) -> Self {
        Self { rest: object.iter(), known, last: None }
    }
}

impl<'de> MapAccess<'de> for Fields<'de> {
    type Error = Refusal;

    fn next_key_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Refusal> {
        let known = self.known;
        let is_left_out = |(key, value): &(&String, &Value)| value.is_null() && known.contains(&key.as_str());
        let Some((key, value)) = self.rest.find(|entry| !is_left_out(entry)) else { return Ok(None) };
        self.last = Some((key, value));
        seed.deserialize(BorrowedStrDeserializer::new(key)).map(Some)
    }

    fn next_value_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<T::Value, Refusal> {
        let Some((key, value)) = self.last.take() else {
            return Err(Refusal::custom("a value without a key"));
        };
        seed.deserialize(Node(value)).map_err(|refusal| refusal.within(Step::Field(key.to_owned())))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use serde::Deserialize;
    use serde_json::json;

    use super::*;

    #[derive(Debug, Default, PartialEq, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    struct Inner {
        alpha: Vec<f64>,
        steps: u32,
        axis: Option<Axis>,
        on: bool,
    }

    #[derive(Debug, Clone, PartialEq, Deserialize)]
    #[serde(rename_all = "lowercase")]
    enum Axis {
        X,
        Y,
    }

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Outer {
        name: String,
        #[serde(default)]
        inner: Inner,
        #[serde(default)]
        map: BTreeMap<String, String>,
        place: Option<[f64; 2]>,
    }

    fn refused(request: &Value) -> String {
        read::<Outer>(request).unwrap_err().to_string()
    }

    #[test]
    fn a_request_is_read_as_it_is_meant() {
        let request =
            json!({"name": "a", "inner": {"alpha": [1, 2.5], "axis": "y", "on": true}, "map": {"k": "v"}});
        let read: Outer = read(&request).unwrap();
        let inner = Inner { alpha: vec![1.0, 2.5], steps: 0, axis: Some(Axis::Y), on: true };
        let map = BTreeMap::from([("k".to_owned(), "v".to_owned())]);
        assert_eq!(read, Outer { name: "a".into(), inner, map, place: None });
    }

    #[test]
    fn what_is_null_is_left_out() {
        let request =
            json!({"name": "a", "inner": {"alpha": null, "steps": null}, "map": null, "place": null});
        assert_eq!(read::<Outer>(&request), read(&json!({"name": "a"})));
        assert_eq!(refused(&json!({"name": null})), "name is missing");
        assert_eq!(
            refused(&json!({"name": "a", "x": null})),
            "x is not known; there are: name, inner, map, place"
        );
    }

    #[test]
    fn a_refusal_says_where_what_was_found_and_what_was_expected() {
        for (request, expected) in [
            (json!([]), "the request is an array, expected an object"),
            (json!(["a"]), "the request is an array, expected an object"),
            (json!({}), "name is missing"),
            (json!({"name": 5}), "name is 5, expected text"),
            (json!({"name": "a", "inner": [[]]}), "inner is an array, expected an object"),
            (json!({"name": "a", "inner": "x"}), "inner is \"x\", expected an object"),
            (
                json!({"name": "a", "inner": {"stps": 1}}),
                "inner.stps is not known; there are: alpha, steps, axis, on",
            ),
            (
                json!({"name": "a", "inner": {"steps": "abc"}}),
                "inner.steps is \"abc\", expected a whole number of 0 or more",
            ),
            (
                json!({"name": "a", "inner": {"steps": -1}}),
                "inner.steps is -1, expected a whole number of 0 or more",
            ),
            (
                json!({"name": "a", "inner": {"steps": 1.5}}),
                "inner.steps is 1.5, expected a whole number of 0 or more",
            ),
            (
                json!({"name": "a", "inner": {"steps": 5_000_000_000_u64}}),
                "inner.steps is 5000000000, expected at most 4294967295",
            ),
            (json!({"name": "a", "inner": {"alpha": 1}}), "inner.alpha is 1, expected an array"),
            (
                json!({"name": "a", "inner": {"alpha": [0, true]}}),
                "inner.alpha[1] is true, expected a number",
            ),
            (json!({"name": "a", "inner": {"axis": "w"}}), "inner.axis is \"w\", expected x or y"),
            (json!({"name": "a", "inner": {"axis": 1}}), "inner.axis is 1, expected x or y"),
            (json!({"name": "a", "inner": {"on": 1}}), "inner.on is 1, expected true or false"),
            (json!({"name": "a", "map": {"k": {}}}), "map.k is an object, expected text"),
            (json!({"name": "a", "map": []}), "map is an array, expected an object"),
            (json!({"name": "a", "place": [1, 2, 3]}), "place is an array of 3, expected one of 2"),
            (json!({"name": "a", "place": [1]}), "place is an array of 1, expected one of 2"),
        ] {
            assert_eq!(refused(&request), expected, "{request}");
        }
    }

    #[test]
    fn keys_are_given_once_and_no_text_has_a_nul() {
        assert_eq!(
            parse("body", b"{\"a\": [1, -2, 2.5, null, true, \"x\"]}").unwrap(),
            json!({"a": [1, -2, 2.5, null, true, "x"]})
        );
        for (body, expected) in [
            (r#"{"a": 1, "a": 1}"#, "a is given twice, expected once"),
            (r#"{"a": [0, {"b": 1, "c": 2, "b": 3}]}"#, "a[1].b is given twice, expected once"),
            (
                r#"{"a": {"b": ["x", "y\u0000z"]}}"#,
                "a.b[1] has a NUL character (\\u0000), expected text without",
            ),
            (r#""\u0000""#, "the request has a NUL character (\\u0000), expected text without"),
        ] {
            let refused = parse("body", body.as_bytes()).unwrap_err();
            assert!(matches!(&refused, Error::Unprocessable(said) if said == expected), "{body}: {refused}");
        }
        assert!(matches!(parse("body", br#"{"a\u0000": 1}"#), Err(Error::Unprocessable(_))));
        for body in ["", "{", "{} {}", r#"{"a": 1, "a": 2"#] {
            assert!(matches!(parse("body", body.as_bytes()), Err(Error::BadRequest(_))), "{body}");
        }
    }
}
