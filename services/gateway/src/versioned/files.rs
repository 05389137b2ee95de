//! The files that versions are built from.

use std::marker::PhantomData;

use axum::{
    Json,
    body::Body,
    http::{HeaderMap, StatusCode},
};
use sqlx::PgConnection;
use store::Key;
use uuid::Uuid;

use super::{
    lookup::{Latest, find, look},
    noun::Versioned,
};
use crate::{
    access::Access,
    error::{Error, Result},
    files::{self, File, Owner},
    lock::Lock,
    names,
    upload::Announced,
};

/// The files of a version.
pub(crate) async fn list_files<V: Versioned>(by: &Access, which: &str) -> Result<Json<Vec<File>>> {
    let row: V = look(by, which, Latest::Any).await?;
    let mut db = by.app.db.acquire().await?;
    Ok(Json(files::list(&mut db, row.id()).await?))
}

/// Receives a file to build a version from.
pub(crate) async fn put_file<V: Versioned>(
    by: Access,
    (which, name): (String, String),
    headers: &HeaderMap,
    body: Body,
) -> Result<(StatusCode, Json<File>)> {
    names::check_file_name(&name)?;
    if !(V::NOUN.takes)(&name) {
        return Err(Error::Unprocessable(format!(
            "{name:?} is not a file that a {} is built from: expected {}",
            V::NOUN.name,
            V::NOUN.role.endings()
        )));
    }
    let announced = Announced::read(headers)?;
    let row: V = look(&by, &which, Latest::Any).await?;
    check_collects(&row)?;
    let sources = Sources::<V>(row.id(), PhantomData);
    files::receive(by.app, by.caller.project_id, sources, (name, V::NOUN.role), announced, body).await
}

/// Removes a file of a version.
pub(crate) async fn delete_file<V: Versioned>(
    by: Access,
    (which, name): (String, String),
) -> Result<StatusCode> {
    let row: V = look(&by, &which, Latest::Any).await?;
    files::remove(by.app, by.caller.project_id, Sources::<V>(row.id(), PhantomData), name).await
}

/// A version as the owner of files, which are fixed from its build on.
struct Sources<V>(Uuid, PhantomData<fn() -> V>);

impl<V: Versioned> Owner for Sources<V> {
    const TABLE: &'static str = V::NOUN.sql.table;
    const NOUN: &'static str = V::NOUN.name;

    fn id(&self) -> Uuid {
        self.0
    }

    fn key(&self, _: Uuid, file_id: Uuid) -> Key {
        (V::NOUN.input)(self.0, file_id)
    }

    async fn lock(&self, db: &mut PgConnection, project_id: Uuid) -> Result<()> {
        let row: V = find(db, project_id, &self.0.to_string(), Latest::Any, Lock::Update).await?;
        check_collects(&row)
    }

    async fn check_removable(&self, _: &mut PgConnection, _: &str) -> Result<()> {
        Ok(())
    }
}

fn check_collects<V: Versioned>(row: &V) -> Result<()> {
    if row.version().collects() {
        return Ok(());
    }
    Err(Error::Conflict(format!(
        "{} is {}: its files are fixed; {}",
        row.title(),
        row.version().state,
        row.version().way_to_another()
    )))
}
