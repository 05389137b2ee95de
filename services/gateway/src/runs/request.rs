//! A request for a run on a session: its kind is chosen first, then it is read as one of that kind.

use std::borrow::Cow;

use formats::FileRole;
use serde::{Deserialize, Deserializer, de};
use serde_json::{Map, Value};
use sqlx::PgConnection;
use utoipa::{
    PartialSchema, ToSchema,
    openapi::{OneOfBuilder, Ref, RefOr, Schema, example::ExampleBuilder, path::Operation},
};
use uuid::Uuid;

use super::{
    KINDS,
    enqueue::NewRun,
    session_run::{Asked, Kind, OnSession},
};
use crate::{
    error::{Error, Result},
    refusal::shortened,
};

/// Name of the request in OpenAPI.
const NAME: &str = "NewSessionRun";

/// A run on a session, as asked for.
#[derive(Debug)]
pub(crate) struct NewSessionRun {
    kind: Option<&'static Kind>,
    fields: Map<String, Value>,
}

impl<'de> Deserialize<'de> for NewSessionRun {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut fields = Map::deserialize(deserializer)?;
        let kind = match fields.remove("kind") {
            None | Some(Value::Null) => None,
            Some(found) => Some(KINDS.iter().find(|kind| found == kind.name).ok_or_else(|| {
                de::Error::custom(format_args!("kind is {found}, expected {}", words(KINDS, "or")))
            })?),
        };
        Ok(Self { kind, fields })
    }
}

impl NewSessionRun {
    /// Refuses what makes no sense on any session, where the kind is named.
    pub fn check(&self) -> Result<()> {
        self.kind.map_or(Ok(()), |kind| read(kind, self.fields.clone()).map(drop))
    }

    /// The run: everything that decides its result.
    pub async fn plan(self, db: &mut PgConnection, project_id: Uuid, on: OnSession) -> Result<NewRun> {
        let Some(kind) = self.kind else {
            let (kind, because) = implied(&self.fields, &on)?;
            let because = |error: Error| error.because(&format!("{because}, so kind is {}: ", kind.name));
            let asked = read(kind, self.fields).map_err(because)?;
            return asked.plan(db, project_id, on).await.map_err(because);
        };
        read(kind, self.fields)?.plan(db, project_id, on).await
    }
}

/// The kind where none is named, and why it is that.
fn implied(fields: &Map<String, Value>, on: &OnSession) -> Result<(&'static Kind, String)> {
    let is_given = |field: &str| fields.get(field).is_some_and(|value| !value.is_null());
    if let Some((kind, field)) = KINDS
        .iter()
        .find_map(|kind| kind.implied_by.filter(|field| is_given(field)).map(|field| (kind, field)))
    {
        return Ok((kind, format!("{field} is given")));
    }
    let with_files = KINDS.iter().filter_map(|kind| {
        let (role, files) = kind.files?;
        on.has(role).then_some((kind, files))
    });
    let with_files: Vec<(&Kind, &str)> = with_files.collect();
    match with_files[..] {
        [(kind, files)] => Ok((kind, format!("the session has {files}"))),
        // Without files, a field that only one kind requires tells what is meant.
        [] => required_by(is_given).ok_or_else(|| {
            Error::Unprocessable(format!(
                "the session has neither control points nor cameras; upload a {} file, or a calibration and what the \
                 cameras saw",
                FileRole::ControlPoints.endings()
            ))
        }),
        ref several => {
            let files: Vec<&str> = several.iter().map(|(_, files)| *files).collect();
            Err(Error::Unprocessable(format!(
                "the session has {}, so kind is required: {}",
                files.join(" and "),
                words(KINDS, "or")
            )))
        }
    }
}

/// The kind that requires a field which is given, and which field that is.
fn required_by(is_given: impl Fn(&str) -> bool) -> Option<(&'static Kind, String)> {
    KINDS.iter().find_map(|kind| {
        let field = (kind.object)().required.into_iter().find(|field| is_given(field))?;
        Some((kind, format!("{field} is given")))
    })
}

/// Reads a request as one of that kind. A field that is null counts as left out.
fn read(kind: &Kind, mut fields: Map<String, Value>) -> Result<Box<dyn Asked>> {
    let own = (kind.object)().properties;
    for (name, value) in fields.iter().filter(|(name, _)| !own.contains_key(*name)) {
        let others: Vec<&Kind> =
            KINDS.iter().filter(|other| (other.object)().properties.contains_key(name)).collect();
        if !others.is_empty() && value.is_null() {
            continue;
        }
        let belongs = match &others[..] {
            [] => String::new(),
            others => format!(", but of {} runs", words(others.iter().copied(), "and")),
        };
        let has: Vec<&str> = own.keys().map(String::as_str).collect();
        return Err(Error::Unprocessable(format!(
            "{} is not a field of {} runs{belongs}; they have: {}",
            shortened(name),
            kind.name,
            has.join(", ")
        )));
    }
    fields.retain(|_, value| !value.is_null());
    kind.read(fields)
}

/// Names of kinds, as a sentence has them.
fn words<'a>(kinds: impl IntoIterator<Item = &'a Kind>, conjunction: &str) -> String {
    let mut names: Vec<&str> = kinds.into_iter().map(|kind| kind.name).collect();
    match (names.pop(), names.is_empty()) {
        (Some(last), false) => format!("{} {conjunction} {last}", names.join(", ")),
        (last, _) => last.unwrap_or_default().to_owned(),
    }
}

/// One of the kinds' requests. There is no discriminator, as OpenAPI has it that it is never left out; the kinds' requests
/// exclude each other without one.
impl PartialSchema for NewSessionRun {
    fn schema() -> RefOr<Schema> {
        let one_of = KINDS.iter().fold(OneOfBuilder::new(), |one_of, kind| {
            one_of.item(Ref::from_schema_name((kind.schema_name)()))
        });
        let description = "A run to be started: one of its kinds. `kind` may be left out where the session's files are for one \
                           kind alone. What is left out has its default; the run shows everything resolved.";
        one_of.description(Some(description)).into()
    }
}

impl ToSchema for NewSessionRun {
    fn name() -> Cow<'static, str> {
        NAME.into()
    }

    fn schemas(schemas: &mut Vec<(String, RefOr<Schema>)>) {
        for kind in KINDS {
            (kind.referred)(schemas);
            schemas.push(((kind.schema_name)().into_owned(), RefOr::T(kind.schema())));
        }
    }
}

/// Adds an example of every kind to the operation that takes this request.
pub(crate) fn add_examples(operation: &mut Operation) {
    let Some(RefOr::T(body)) = &mut operation.request_body else { return };
    for content in body.content.values_mut() {
        let RefOr::T(content) = content else { continue };
        if content.schema != Some(RefOr::Ref(Ref::from_schema_name(NAME))) {
            continue;
        }
        for kind in KINDS {
            let example = ExampleBuilder::new().value(Some((kind.example)())).build();
            content.examples.insert(kind.name.to_owned(), RefOr::T(example));
        }
    }
}
