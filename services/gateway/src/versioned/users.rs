//! Who needs a version now: until they are gone, it is not deleted.

use std::fmt;

use serde::Serialize;
use sqlx::PgConnection;
use utoipa::ToSchema;
use uuid::Uuid;

use super::noun::Versioned;
use crate::error::{Error, Result};

/// Most users that a refusal names.
const NAMED: usize = 5;

/// Who needs a version.
#[derive(Debug, Serialize, ToSchema, sqlx::FromRow)]
pub(crate) struct User {
    /// a run under way
    run_id: Option<Uuid>,
    /// the session that it reconstructs
    session_id: Option<Uuid>,
    /// name of that session
    session: Option<String>,
    /// version that is to be made from it
    motion_database: Option<String>,
}

impl fmt::Display for User {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.run_id, &self.session, &self.motion_database) {
            (Some(run), Some(session), _) => write!(f, "run {run} of session {session:?}"),
            (Some(run), None, _) => write!(f, "run {run}"),
            (None, _, Some(version)) => write!(f, "{version}, which is being made from it"),
            (None, _, None) => f.write_str("another version"),
        }
    }
}

/// Runs under way that need row `$1`, which stands in that column of theirs, or that build it (run `$2`).
macro_rules! runs_that_use {
    ($column:literal) => {
        concat!(
            "SELECT r.id AS run_id, r.session_id, s.name AS session, NULL AS motion_database
             FROM runs r LEFT JOIN sessions s ON s.id = r.session_id
             WHERE (r.",
            $column,
            " = $1 OR r.id = $2) AND r.finished_at IS NULL "
        )
    };
}
pub(super) use runs_that_use;

/// Who needs a version now.
pub(super) async fn list<V: Versioned>(db: &mut PgConnection, row: &V) -> Result<Vec<User>> {
    let query = sqlx::query_as(V::NOUN.sql.users).bind(row.id()).bind(row.version().build_run_id);
    Ok(query.fetch_all(db).await?)
}

/// Refuses (409) while somebody needs a version.
pub(super) async fn check_none<V: Versioned>(db: &mut PgConnection, row: &V) -> Result<()> {
    let users = list(db, row).await?;
    if users.is_empty() {
        return Ok(());
    }
    let mut named: Vec<String> = users.iter().take(NAMED).map(ToString::to_string).collect();
    if users.len() > NAMED {
        named.push(format!("{} more", users.len() - NAMED));
    }
    Err(Error::Conflict(format!(
        "{} is in use by {}; cancel or delete that first",
        row.title(),
        named.join(", ")
    )))
}
