//! Query strings: every parameter once, and refused by its name.

use std::{collections::HashMap, sync::Arc};

use axum::{
    extract::{MatchedPath, Query, Request, State},
    http::{Method, Uri},
    middleware::Next,
    response::Response,
};
use serde::{
    Deserializer,
    de::{
        DeserializeOwned, DeserializeSeed, Error as _, MapAccess, Visitor,
        value::{BorrowedStrDeserializer, StrDeserializer},
    },
    forward_to_deserialize_any,
};
use utoipa::openapi::{
    OpenApi, RefOr,
    path::{Operation, ParameterIn},
};

use crate::{
    error::{Error, Result},
    refusal::{Refusal, Step, quoted},
};

/// Names and values of a query string.
pub(crate) fn pairs(uri: &Uri) -> Result<Vec<(String, String)>> {
    Query::try_from_uri(uri)
        .map(|Query(pairs)| pairs)
        .map_err(|refusal| Error::BadRequest(refusal.body_text()))
}

/// Reads a query string.
pub(crate) fn read<T: DeserializeOwned>(uri: &Uri) -> Result<T> {
    let pairs = pairs(uri)?;
    if let Some((name, _)) = pairs.iter().find(|(name, value)| name.contains('\0') || value.contains('\0')) {
        return Err(Error::BadRequest(format!(
            "{} has a NUL character, expected text without",
            name.replace('\0', "\u{fffd}")
        )));
    }
    T::deserialize(Pairs { rest: &pairs, last: None })
        .map_err(|refusal| Error::BadRequest(refusal.to_string()))
}

/// The query parameters of every method and path of the API, as it describes itself.
#[derive(Debug)]
pub(crate) struct Known(HashMap<(Method, String), Vec<String>>);

impl Known {
    /// Those that the description has.
    pub fn from_description(api: &OpenApi) -> Self {
        let mut known = HashMap::new();
        for (path, item) in &api.paths.paths {
            let operations = [
                (Method::GET, &item.get),
                (Method::PUT, &item.put),
                (Method::POST, &item.post),
                (Method::DELETE, &item.delete),
            ];
            for (method, operation) in operations {
                let Some(operation) = operation else { continue };
                let names = query_parameters(operation);
                if method == Method::GET {
                    known.insert((Method::HEAD, path.clone()), names.clone());
                }
                known.insert((method, path.clone()), names);
            }
        }
        Self(known)
    }

    /// Refuses a parameter that the path doesn't have. Probes may ask as they like.
    fn check(&self, request: &Request) -> Result<()> {
        let Some(path) = request.extensions().get::<MatchedPath>() else { return Ok(()) };
        if request.uri().query().is_none() || !path.as_str().starts_with("/v1/") {
            return Ok(());
        }
        let key = (request.method().clone(), path.as_str().to_owned());
        let Some(known) = self.0.get(&key) else { return Ok(()) };
        match pairs(request.uri())?.iter().find(|(name, _)| !known.contains(name)) {
            None => Ok(()),
            Some((name, _)) if known.is_empty() => Err(Error::BadRequest(format!(
                "{} is not known; there are no query parameters here",
                quoted(name)
            ))),
            Some((name, _)) => Err(Error::BadRequest(format!(
                "{} is not known; there are: {}",
                quoted(name),
                known.join(", ")
            ))),
        }
    }
}

fn query_parameters(operation: &Operation) -> Vec<String> {
    let parameters = operation.parameters.iter().flatten().filter_map(|one| match one {
        RefOr::T(parameter) if parameter.parameter_in == ParameterIn::Query => Some(parameter.name.clone()),
        _ => None,
    });
    parameters.collect()
}

/// Refuses query parameters that the path doesn't have, whatever its handler looks at.
pub(crate) async fn refuse_unknown(
    State(known): State<Arc<Known>>,
    request: Request,
    next: Next,
) -> Result<Response> {
    known.check(&request)?;
    Ok(next.run(request).await)
}

/// All parameters.
struct Pairs<'de> {
    rest: &'de [(String, String)],
    last: Option<&'de (String, String)>,
}

impl<'de> Deserializer<'de> for Pairs<'de> {
    type Error = Refusal;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refusal> {
        visitor.visit_map(self)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option
        unit unit_struct newtype_struct seq tuple tuple_struct map struct enum identifier
        ignored_any
    }
}

impl<'de> MapAccess<'de> for Pairs<'de> {
    type Error = Refusal;

    fn next_key_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Refusal> {
        let Some((pair, rest)) = self.rest.split_first() else { return Ok(None) };
        (self.rest, self.last) = (rest, Some(pair));
        seed.deserialize(BorrowedStrDeserializer::new(&pair.0)).map(Some)
    }

    fn next_value_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<T::Value, Refusal> {
        let Some((name, value)) = self.last.take() else {
            return Err(Refusal::custom("a value without a name"));
        };
        seed.deserialize(Parameter(value)).map_err(|refusal| refusal.within(Step::Field(name.clone())))
    }
}

/// The value of one parameter.
struct Parameter<'de>(&'de str);

/// Numbers are written as text in a query.
macro_rules! deserialize_numbers {
    ($($deserialize:ident as $number:ty: $visit:ident, expected $expected:literal;)*) => {
        $(fn $deserialize<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refusal> {
            match self.0.parse::<$number>() {
                Ok(number) => visitor.$visit(number),
                Err(_) => Err(Refusal::found(quoted(self.0), $expected)),
            }
        })*
    };
}

impl<'de> Deserializer<'de> for Parameter<'de> {
    type Error = Refusal;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refusal> {
        visitor.visit_borrowed_str(self.0)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refusal> {
        visitor.visit_some(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Refusal> {
        visitor.visit_enum(StrDeserializer::new(self.0))
    }

    deserialize_numbers! {
        deserialize_u32 as u64: visit_u64, expected "a whole number of 0 or more";
        deserialize_u64 as u64: visit_u64, expected "a whole number of 0 or more";
        deserialize_i64 as i64: visit_i64, expected "a whole number";
        deserialize_f64 as f64: visit_f64, expected "a number";
        deserialize_bool as bool: visit_bool, expected "true or false";
    }

    forward_to_deserialize_any! {
        i8 i16 i32 i128 u8 u16 u128 f32 char str string bytes byte_buf unit unit_struct
        newtype_struct seq tuple tuple_struct map struct identifier ignored_any
    }
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;

    use super::*;

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Wanted {
        limit: Option<u32>,
        stature_m: Option<f64>,
        name: Option<String>,
    }

    fn asked(query: &str) -> Result<Wanted> {
        read(&format!("/v1/x{query}").parse().unwrap())
    }

    #[test]
    fn a_query_is_read_or_refused_by_the_name_of_the_parameter() {
        let wanted = Wanted { limit: Some(3), stature_m: Some(1.8), name: Some("a b".into()) };
        assert_eq!(asked("?limit=3&stature_m=1.8&name=a%20b").unwrap(), wanted);
        assert_eq!(asked("").unwrap(), Wanted { limit: None, stature_m: None, name: None });
        for (query, expected) in [
            ("?limit=x", "limit is \"x\", expected a whole number of 0 or more"),
            ("?limit=-1", "limit is \"-1\", expected a whole number of 0 or more"),
            ("?stature_m=tall", "stature_m is \"tall\", expected a number"),
            ("?limit=1&limit=2", "limit is given twice, expected once"),
            ("?x=1", "x is not known; there are: limit, stature_m, name"),
            ("?name=a%00", "name has a NUL character, expected text without"),
        ] {
            let refused = asked(query).unwrap_err();
            assert!(matches!(&refused, Error::BadRequest(said) if said == expected), "{query}: {refused}");
        }
    }
}
