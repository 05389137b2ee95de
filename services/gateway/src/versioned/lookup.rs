//! Finding what a request names, in the caller's project only: other projects' items are not found.

use sqlx::PgConnection;
use uuid::Uuid;

use super::noun::Versioned;
use crate::{
    access::Access,
    error::{Error, Result},
    lock::Lock,
    names::as_id,
};

/// Which versions of a name are meant when none is named.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Latest {
    /// the newest
    Any,
    /// the newest that is ready, or else the newest
    Ready,
}

/// What `which` names: an id, `name@version`, or a name, which stands for its latest version.
pub(crate) async fn find<V: Versioned>(
    db: &mut PgConnection,
    project_id: Uuid,
    which: &str,
    latest: Latest,
    lock: Lock,
) -> Result<V> {
    if let Some(shipped) = V::shipped().filter(|shipped| shipped.version().is_named(which)) {
        return Ok(shipped);
    }
    let not_found = || Error::not_found(V::NOUN.name, which);
    let id = match (as_id(which), which.rsplit_once('@')) {
        (Some(id), _) => Some(id),
        (None, Some((name, version))) => {
            let version = as_version(version).ok_or_else(not_found)?;
            let query =
                sqlx::query_scalar(V::NOUN.sql.find_version).bind(project_id).bind(name).bind(version);
            query.fetch_optional(&mut *db).await?
        }
        (None, None) => {
            let is_ready_wanted = latest == Latest::Ready;
            let query = sqlx::query_scalar(V::NOUN.sql.find_latest);
            query.bind(project_id).bind(which).bind(is_ready_wanted).fetch_optional(&mut *db).await?
        }
    };
    let query = match lock {
        Lock::None => V::NOUN.sql.find,
        Lock::Share => V::NOUN.sql.find_for_share,
        Lock::Update => V::NOUN.sql.find_for_update,
    };
    sqlx::query_as(query).bind(id).bind(project_id).fetch_optional(db).await?.ok_or_else(not_found)
}

/// A version as it is given out: no sign, no leading zero.
fn as_version(text: &str) -> Option<i32> {
    text.parse().ok().filter(|version: &i32| version.to_string() == text)
}

/// [`find`] for a caller who only looks.
pub(crate) async fn look<V: Versioned>(by: &Access, which: &str, latest: Latest) -> Result<V> {
    let mut db = by.app.db.acquire().await?;
    find(&mut db, by.caller.project_id, which, latest, Lock::None).await
}
