//! What a kind of runs on sessions is, and a line of their table.

use std::borrow::Cow;

use formats::FileRole;
use futures::future::BoxFuture;
use jobs::{InputFile, SessionInputs};
use model::Axis;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use sqlx::PgConnection;
use utoipa::{
    ToSchema,
    openapi::{
        AllOfBuilder, Object, ObjectBuilder, OneOfBuilder, RefOr, Schema,
        schema::{AdditionalProperties, AnyOfBuilder, SchemaType, Type},
    },
};
use uuid::Uuid;

use super::enqueue::NewRun;
use crate::{
    error::{Error, Result},
    json,
    refusal::Refusal,
    sessions::Session,
};

/// A session that a run is started on.
#[derive(Debug)]
pub(crate) struct OnSession {
    /// the session
    pub session: Session,
    /// its files, in order of name
    pub files: Vec<InputFile>,
}

impl OnSession {
    /// Whether there is a file of that role.
    pub fn has(&self, role: FileRole) -> bool {
        self.files.iter().any(|file| file.role == role)
    }

    /// What the run's jobs are given of it.
    pub fn inputs(self, up: Option<Axis>) -> SessionInputs {
        SessionInputs { session_id: self.session.id, session_name: self.session.name, files: self.files, up }
    }
}

/// The request of one kind of runs on sessions.
pub(super) trait SessionRun: DeserializeOwned + ToSchema + Send + 'static {
    /// The kind, as requests name it.
    const KIND: &'static str;

    /// The files that make it the kind of a session's runs where none is named, and how messages call them.
    const FILES: Option<(FileRole, &'static str)> = None;

    /// The field that makes it the kind where none is named.
    const IMPLIED_BY: Option<&'static str> = None;

    /// The fields that it shares with other kinds. They are checked by themselves, as what a request is composed of is
    /// read without a trace of where.
    const SHARED: &'static [Shared] = &[];

    /// A field that is required, and what is said to whoever left it out.
    const REQUIRED: Option<(&'static str, &'static str)> = None;

    /// A request as people may send it.
    fn example() -> Value;

    /// Refuses what makes no sense on any session.
    fn check(&self) -> Result<()>;

    /// The run: everything that decides its result.
    fn plan(
        self,
        db: &mut PgConnection,
        project_id: Uuid,
        on: OnSession,
    ) -> impl Future<Output = Result<NewRun>> + Send;
}

/// A request that was read as one of its kind.
pub(super) trait Asked: Send {
    /// [`SessionRun::plan`].
    fn plan<'a>(
        self: Box<Self>,
        db: &'a mut PgConnection,
        project_id: Uuid,
        on: OnSession,
    ) -> BoxFuture<'a, Result<NewRun>>;
}

impl<R: SessionRun> Asked for R {
    fn plan<'a>(
        self: Box<Self>,
        db: &'a mut PgConnection,
        project_id: Uuid,
        on: OnSession,
    ) -> BoxFuture<'a, Result<NewRun>> {
        Box::pin(SessionRun::plan(*self, db, project_id, on))
    }
}

/// A line of the table of kinds.
#[derive(Debug)]
pub(super) struct Kind {
    /// as requests name it
    pub name: &'static str,
    /// [`SessionRun::FILES`]
    pub files: Option<(FileRole, &'static str)>,
    /// [`SessionRun::IMPLIED_BY`]
    pub implied_by: Option<&'static str>,
    /// [`SessionRun::example`]
    pub example: fn() -> Value,
    /// its fields as OpenAPI has them
    pub object: fn() -> Object,
    /// what its fields refer to, by name
    pub referred: fn(&mut Vec<(String, RefOr<Schema>)>),
    /// its name in OpenAPI
    pub schema_name: fn() -> Cow<'static, str>,
    read: Reader,
}

/// What reads a request of one kind.
type Reader = fn(Map<String, Value>) -> Result<Box<dyn Asked>>;

impl Kind {
    /// The line of a kind.
    pub const fn new<R: SessionRun>() -> Self {
        Self {
            name: R::KIND,
            files: R::FILES,
            implied_by: R::IMPLIED_BY,
            example: R::example,
            object: object::<R>,
            referred: R::schemas,
            schema_name: R::name,
            read: read::<R>,
        }
    }

    /// Reads a request of this kind, whose fields are known to be its.
    pub fn read(&self, fields: Map<String, Value>) -> Result<Box<dyn Asked>> {
        (self.read)(fields)
    }

    /// As OpenAPI has it: `kind` may be left out, but where only a field of its own implies it, one of the two is there.
    pub fn schema(&self) -> Schema {
        let object = (self.object)();
        let Some(field) = self.implied_by else { return object.into() };
        let values = [Type::Object, Type::Array, Type::String, Type::Number, Type::Boolean];
        // one that is null is left out
        let has = |name: &str| {
            let given = ObjectBuilder::new().schema_type(SchemaType::from_iter(values.clone()));
            ObjectBuilder::new().property(name, given).required(name)
        };
        AllOfBuilder::new()
            .description(object.description.clone())
            .examples(object.examples.clone())
            .item(object)
            .item(AnyOfBuilder::new().item(has("kind")).item(has(field)))
            .into()
    }
}

fn read<R: SessionRun>(fields: Map<String, Value>) -> Result<Box<dyn Asked>> {
    let fields = Value::Object(fields);
    R::SHARED.iter().try_for_each(|check| check(&fields))?;
    let asked: R = json::read(&fields).map_err(|refusal| match R::REQUIRED {
        Some((field, what_to_do)) if refusal.lacks(field) => {
            Error::Unprocessable(format!("{field} is missing: {what_to_do}"))
        }
        _ => refusal.into(),
    })?;
    asked.check()?;
    Ok(Box::new(asked))
}

/// Refuses fields that are not of their types.
pub(super) type Shared = fn(&Value) -> Result<(), Refusal>;

/// [`Shared`] for the fields of `F`, which overlooks all others.
pub(super) fn shared<F: DeserializeOwned>(fields: &Value) -> Result<(), Refusal> {
    json::read::<F>(fields).map(drop)
}

fn object<R: SessionRun>() -> Object {
    let mut object = merged(R::schema());
    let kind = ObjectBuilder::new()
        .schema_type(SchemaType::new(Type::String))
        .enum_values(Some([R::KIND]))
        .description(Some("what kind of run it is; what the session's files are for when left out"));
    object.properties.insert("kind".to_owned(), RefOr::T(kind.into()));
    let required = &object.required;
    for (_, schema) in object.properties.iter_mut().filter(|(name, _)| !required.contains(name)) {
        let described = std::mem::replace(schema, RefOr::T(Object::new().into()));
        *schema = or_null(described);
    }
    object.additional_properties = Some(Box::new(AdditionalProperties::FreeForm(false)));
    object.examples = vec![R::example()];
    object
}

/// A field that may be left out, which null stands for.
fn or_null(schema: RefOr<Schema>) -> RefOr<Schema> {
    let with_null = |types: &SchemaType| match types {
        SchemaType::Type(one) if *one != Type::Null => SchemaType::from_iter([one.clone(), Type::Null]),
        SchemaType::Array(several) if !several.contains(&Type::Null) => {
            SchemaType::from_iter(several.iter().cloned().chain([Type::Null]))
        }
        other => other.clone(),
    };
    match schema {
        RefOr::T(Schema::Object(mut object)) => {
            object.schema_type = with_null(&object.schema_type);
            if let Some(words) = object.enum_values.as_mut().filter(|words| !words.contains(&Value::Null)) {
                words.push(Value::Null);
            }
            RefOr::T(object.into())
        }
        RefOr::T(Schema::Array(mut array)) => {
            array.schema_type = with_null(&array.schema_type);
            RefOr::T(array.into())
        }
        other => {
            let null = ObjectBuilder::new().schema_type(Type::Null);
            RefOr::T(OneOfBuilder::new().item(null).item(other).into())
        }
    }
}

/// One object with the fields of all objects that a request is composed of.
fn merged(schema: RefOr<Schema>) -> Object {
    match schema {
        RefOr::T(Schema::Object(object)) => object,
        RefOr::T(Schema::AllOf(all)) => {
            let mut sum = Object::new();
            sum.description = all.description;
            for part in all.items.into_iter().map(merged) {
                sum.properties.extend(part.properties);
                sum.required.extend(part.required);
            }
            sum
        }
        _ => Object::default(),
    }
}
