//! Projects, API keys and what a key allows.

use std::fmt;

use axum::{extract::FromRequestParts, http::header, http::request::Parts};
use serde::Serialize;
use sqlx::{PgConnection, PgPool};
use uuid::Uuid;

use crate::{App, error::Error, names};

/// What a key may do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, utoipa::ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum Scope {
    /// look at everything of the project and download it
    Read,
    /// upload, start, cancel, delete
    Write,
    /// everything that the others allow, and what later versions add
    Admin,
}

impl Scope {
    /// All scopes.
    pub const ALL: [Self; 3] = [Self::Read, Self::Write, Self::Admin];

    /// The word used in the database and on the wire.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Read => "read",
            Self::Write => "write",
            Self::Admin => "admin",
        }
    }
}

impl fmt::Display for Scope {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl std::str::FromStr for Scope {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|scope| scope.as_str() == word)
            .ok_or_else(|| format!("unknown scope {word:?}, expected read, write or admin"))
    }
}

/// A project's name as it may be: letters, digits, `.`, `_` and `-`.
///
/// # Errors
/// A text that is none, with what is expected.
pub fn project_name(name: &str) -> Result<String, String> {
    names::check_versioned_name("project", name).map_err(|error| error.to_string())?;
    Ok(name.to_owned())
}

/// A key's label as it may be: empty, or a line of text.
///
/// # Errors
/// A text that is none, with what is expected.
pub fn key_label(label: &str) -> Result<String, String> {
    if !label.is_empty() {
        names::check_line("the label", label).map_err(|error| error.to_string())?;
    }
    Ok(label.to_owned())
}

/// Makes an API key for a project, and the project when there is none of that name. The key itself is returned
/// and nowhere kept. Names are checked by whoever takes them from people: [`project_name`], [`key_label`].
///
/// # Errors
/// If the database fails.
pub async fn create_key(
    connection: &mut PgConnection,
    project: &str,
    name: &str,
    scopes: &[Scope],
) -> sqlx::Result<String> {
    // 244 random bits
    let key = format!("mk_{}{}", Uuid::new_v4().simple(), Uuid::new_v4().simple());
    insert_key(connection, project, name, scopes, &key).await?;
    Ok(key)
}

/// Makes sure that `key`, chosen by whoever deploys, is valid with all scopes on project `default`.
///
/// # Errors
/// If the database fails.
pub async fn ensure_key(db: &PgPool, key: &str) -> sqlx::Result<()> {
    insert_key(&mut *db.acquire().await?, "default", "bootstrap", &Scope::ALL, key).await
}

/// Whether `key` is valid.
///
/// # Errors
/// If the database fails.
pub async fn is_known(connection: &mut PgConnection, key: &str) -> sqlx::Result<bool> {
    sqlx::query_scalar("SELECT EXISTS (SELECT FROM api_keys WHERE hash = $1 AND revoked_at IS NULL)")
        .bind(hash(key))
        .fetch_one(connection)
        .await
}

async fn insert_key(
    connection: &mut PgConnection,
    project: &str,
    name: &str,
    scopes: &[Scope],
    key: &str,
) -> sqlx::Result<()> {
    let mut tx = sqlx::Acquire::begin(connection).await?;
    sqlx::query("INSERT INTO projects (id, name) VALUES ($1, $2) ON CONFLICT (name) DO NOTHING")
        .bind(Uuid::now_v7())
        .bind(project)
        .execute(&mut *tx)
        .await?;
    sqlx::query(
        "INSERT INTO api_keys (id, project_id, name, hash, scopes)
         SELECT $1, id, $3, $4, $5 FROM projects WHERE name = $2
         ON CONFLICT (hash) DO NOTHING",
    )
    .bind(Uuid::now_v7())
    .bind(project)
    .bind(name)
    .bind(hash(key))
    .bind(scopes.iter().map(|scope| scope.as_str()).collect::<Vec<_>>())
    .execute(&mut *tx)
    .await?;
    tx.commit().await
}

fn hash(key: &str) -> Vec<u8> {
    blake3::hash(key.as_bytes()).as_bytes().to_vec()
}

/// Who sent the request, by the key in its `Authorization: Bearer …` header.
#[derive(Debug, Clone, sqlx::FromRow)]
pub(crate) struct Caller {
    pub project_id: Uuid,
    pub project: String,
    pub key_name: String,
    pub scopes: Vec<String>,
}

impl Caller {
    fn require(self, scope: Scope) -> Result<Self, Error> {
        if self.scopes.iter().any(|s| s == scope.as_str() || s == Scope::Admin.as_str()) {
            Ok(self)
        } else {
            Err(Error::Forbidden(scope.as_str()))
        }
    }
}

impl FromRequestParts<App> for Caller {
    type Rejection = Error;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Error> {
        let header = parts.headers.get(header::AUTHORIZATION).ok_or(Error::Unauthorized(
            "there is no Authorization header, expected \"Authorization: Bearer mk_…\"",
        ))?;
        let key = header
            .to_str()
            .ok()
            .and_then(|value| value.split_once(' '))
            .filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer"))
            .map(|(_, key)| key.trim())
            .ok_or(Error::Unauthorized("the Authorization header is not \"Bearer mk_…\""))?;
        sqlx::query_as(
            "SELECT p.id AS project_id, p.name AS project, k.name AS key_name, k.scopes
             FROM api_keys k JOIN projects p ON p.id = k.project_id
             WHERE k.hash = $1 AND k.revoked_at IS NULL",
        )
        .bind(hash(key))
        .fetch_optional(&app.db)
        .await?
        .ok_or(Error::Unauthorized("this API key is not known or was revoked"))
    }
}

/// A caller, and what every handler shares.
#[derive(Debug, Clone)]
pub(crate) struct Access {
    pub app: App,
    pub caller: Caller,
}

impl Access {
    async fn with(parts: &mut Parts, app: &App, scope: Scope) -> Result<Self, Error> {
        let caller = Caller::from_request_parts(parts, app).await?.require(scope)?;
        Ok(Self { app: app.clone(), caller })
    }
}

/// A caller who may read.
#[derive(Debug, Clone)]
pub(crate) struct Reader(pub Access);

impl FromRequestParts<App> for Reader {
    type Rejection = Error;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Error> {
        Access::with(parts, app, Scope::Read).await.map(Self)
    }
}

/// A caller who may change things.
#[derive(Debug, Clone)]
pub(crate) struct Writer(pub Access);

impl FromRequestParts<App> for Writer {
    type Rejection = Error;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Error> {
        Access::with(parts, app, Scope::Write).await.map(Self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_is_a_line_of_text_or_nothing() {
        for good in ["", "wall display", "Läufer 1", &"x".repeat(200)] {
            assert_eq!(key_label(good), Ok(good.to_owned()));
        }
        for (bad, expected) in [
            ("a\u{1b}[2J", "the label has the control character '\\u{1b}', expected a line of text"),
            ("two\nlines", "the label has the control character '\\n', expected a line of text"),
            (" ", "the label is blank, expected a line of text"),
            (&"x".repeat(400), "the label has 400 characters, expected 1 to 200"),
        ] {
            assert_eq!(key_label(bad), Err(expected.to_owned()));
        }
    }
}
