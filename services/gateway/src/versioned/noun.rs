//! What a noun has to say to be versioned.

use std::fmt;

use chrono::{DateTime, Utc};
use formats::FileRole;
use serde::{Serialize, de::DeserializeOwned};
use sqlx::PgConnection;
use store::Key;
use utoipa::ToSchema;
use uuid::Uuid;

use super::sql::Sql;
use crate::{
    error::{Error, Result},
    names::as_id,
    page::Item,
};

/// What makes a noun of the mechanism.
#[derive(Debug)]
pub(crate) struct Noun {
    /// display name
    pub name: &'static str,
    /// path of all of them
    pub path: &'static str,
    /// the statements on its table
    pub sql: Sql,
    /// what builds of it call it, in their parameters
    pub parameter: &'static str,
    /// kinds of runs that are of no use when it is deleted
    pub runs: &'static [&'static str],
    /// role of the files that it is built from
    pub role: FileRole,
    /// whether it can be built from a file of that name
    pub takes: fn(&str) -> bool,
    /// what it is best built from
    pub sources: &'static str,
    /// where a file to build it from is stored, by its id and the file's
    pub input: fn(Uuid, Uuid) -> Key,
    /// where all that belongs to it is stored
    pub prefix: fn(Uuid) -> Key,
}

/// How far a version is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, sqlx::Type)]
#[serde(rename_all = "lowercase")]
#[sqlx(type_name = "text", rename_all = "lowercase")]
pub(crate) enum State {
    /// collects files
    Open,
    /// its build is under way
    Building,
    /// it can be used
    Ready,
    /// its build failed; collects files again
    Failed,
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Open => "open",
            Self::Building => "building",
            Self::Ready => "ready",
            Self::Failed => "failed",
        })
    }
}

/// One version of one name.
#[derive(Debug, Clone, Serialize, ToSchema, sqlx::FromRow)]
pub(crate) struct Version {
    /// id; all zeros for what comes with the program
    pub id: Uuid,
    /// name in the project
    #[schema(example = "walks")]
    pub name: String,
    /// version of that name, from 1
    #[schema(example = 1)]
    pub version: i32,
    /// `open` (collects files), `building`, `ready`, or `failed` (collects files again)
    #[schema(value_type = String, example = "ready")]
    pub state: State,
    /// the run that builds or built it
    pub build_run_id: Option<Uuid>,
    /// size of what was built, bytes
    pub bytes: Option<i64>,
    /// BLAKE3 of what was built, hexadecimal: of its file, or of the list of its shards
    pub blake3: Option<String>,
    /// when it was made; null for what comes with the program
    pub created_at: Option<DateTime<Utc>>,
    /// when it became ready
    pub ready_at: Option<DateTime<Utc>>,
    /// where its file, or the list of its shards, is in the object store
    #[serde(skip)]
    pub store_key: Option<String>,
}

impl Version {
    /// Whether files may be added to it and taken from it, and it can be built.
    pub fn collects(&self) -> bool {
        matches!(self.state, State::Open | State::Failed)
    }

    /// Whether it comes with the program.
    pub fn is_shipped(&self) -> bool {
        self.id.is_nil()
    }

    /// What to do for another one like it.
    pub fn way_to_another(&self) -> &'static str {
        if self.is_shipped() { "make one of another name" } else { "make a new version" }
    }

    /// Whether that is its id, its name or `name@version`.
    pub fn is_named(&self, which: &str) -> bool {
        which == self.name || which == self.to_string() || as_id(which) == Some(self.id)
    }
}

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{}", self.name, self.version)
    }
}

/// A version that is being made.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Added {
    pub id: Uuid,
    pub version: i32,
}

/// A row of a table of versioned things.
pub(crate) trait Versioned: Item + Serialize + Sync + 'static {
    /// What it is.
    const NOUN: Noun;

    /// A request to make one.
    type New: DeserializeOwned + Send + Sync;

    /// What all nouns have in common.
    fn version(&self) -> &Version;

    /// The one that comes with the program and has no row, if there is one.
    fn shipped() -> Option<Self> {
        None
    }

    /// The name that a request asks for; refuses a request that makes no sense, whatever there is already.
    fn check(new: &Self::New) -> Result<&str>;

    /// Adds the row of that id, that version of its name.
    fn insert(
        db: &mut PgConnection,
        project_id: Uuid,
        added: Added,
        new: &Self::New,
    ) -> impl Future<Output = Result<()>> + Send;

    /// The BLAKE3 of what was built.
    ///
    /// # Errors
    /// 409 with its state and what to do, if it is not ready.
    fn blake3(&self) -> Result<&str> {
        let version = self.version();
        version.blake3.as_deref().ok_or_else(|| {
            let what_to_do = match version.state {
                State::Open => format!("upload {} to it and build it", Self::NOUN.sources),
                State::Building => "wait for its build".to_owned(),
                State::Failed | State::Ready => "see the error of its build".to_owned(),
            };
            Error::Conflict(format!("{} is {}, expected ready: {what_to_do}", self.title(), version.state))
        })
    }

    /// What messages call it: `motion database walks@1`.
    fn title(&self) -> String {
        format!("{} {}", Self::NOUN.name, self.version())
    }
}

/// Records the run that builds it.
pub(crate) async fn set_build<V: Versioned>(db: &mut PgConnection, row: &V, run_id: Uuid) -> Result<()> {
    sqlx::query(V::NOUN.sql.set_build).bind(row.id()).bind(run_id).execute(db).await?;
    Ok(())
}
