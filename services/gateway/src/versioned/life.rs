//! Versions are made, listed and deleted. They are filled in `files`, and built by runs.

use axum::{Json, http::StatusCode};
use queue::RunId;
use sqlx::PgConnection;
use uuid::Uuid;

use super::{
    lookup::{Latest, find},
    noun::{Added, Versioned},
    users,
};
use crate::{
    access::{Access, Caller},
    answer::Answer,
    error::{Error, Result},
    extract::Posted,
    lock::Lock,
    names,
    page::{Page, PageQuery},
    upload::uninterrupted,
};

/// Makes the next version of a name: it is open then.
pub(crate) async fn create<V: Versioned>(by: &Access, posted: Posted<V::New>) -> Result<Answer> {
    let project_id = by.caller.project_id;
    let Posted { body, request } = posted;
    let name = V::check(&body)?;
    names::check_versioned_name(V::NOUN.name, name)?;
    if V::shipped().is_some_and(|shipped| shipped.version().name == name) {
        return Err(Error::Unprocessable(format!(
            "{} {name} comes with the program; choose another name",
            V::NOUN.name
        )));
    }
    let mut tx = by.app.db.begin().await?;
    if let Some(answer) = request.replay(&mut tx, project_id).await? {
        return Ok(answer);
    }
    // versions are counted one at a time
    sqlx::query("SELECT 1 FROM projects WHERE id = $1 FOR NO KEY UPDATE")
        .bind(project_id)
        .execute(&mut *tx)
        .await?;
    let id = Uuid::now_v7();
    let version = next_version::<V>(&mut tx, project_id, name).await?;
    V::insert(&mut tx, project_id, Added { id, version }, &body).await?;
    let made: V = find(&mut tx, project_id, &id.to_string(), Latest::Any, Lock::None).await?;
    let answer = Answer::created(format!("{}/{id}", V::NOUN.path), &made)?;
    request.commit(tx, project_id, answer).await
}

/// The number of a name's next version. That of a version that was deleted is not used again.
async fn next_version<V: Versioned>(db: &mut PgConnection, project_id: Uuid, name: &str) -> Result<i32> {
    let last: Option<i32> = sqlx::query_scalar(
        "SELECT version FROM last_versions WHERE project_id = $1 AND noun = $2 AND name = $3",
    )
    .bind(project_id)
    .bind(V::NOUN.sql.table)
    .bind(name)
    .fetch_optional(db)
    .await?;
    Ok(last.unwrap_or(0) + 1)
}

/// All versions of all names, newest first; the last is the one that comes with the program, if there is one.
pub(crate) async fn list<V: Versioned>(by: &Access, page: PageQuery) -> Result<Json<Page<V>>> {
    page.select_ending_with(&by.app.db, V::NOUN.sql.list, by.caller.project_id, V::shipped()).await
}

/// Deletes a version that nobody needs, named by its id or `name@version`, with its files, its builds (failed ones included)
/// and all that they left.
pub(crate) async fn delete<V: Versioned>(by: Access, which: String) -> Result<StatusCode> {
    let Access { app, caller: Caller { project_id, .. } } = by;
    uninterrupted(async move {
        let mut tx = app.db.begin().await?;
        let row: V = find(&mut tx, project_id, &which, Latest::Any, Lock::Update).await?;
        if row.version().is_shipped() {
            return Err(Error::Conflict(format!(
                "{} {} comes with the program and can't be deleted",
                V::NOUN.name,
                row.version().name
            )));
        }
        users::check_none(&mut tx, &row).await?;
        if which == row.version().name {
            // a request that is sent again must not delete the version before
            return Err(Error::Unprocessable(format!(
                "{which:?} may have several versions; name the one to delete, such as {}",
                row.version()
            )));
        }
        sqlx::query(V::NOUN.sql.delete).bind(row.id()).execute(&mut *tx).await?;
        let runs: Vec<RunId> = sqlx::query_scalar(
            "DELETE FROM runs WHERE project_id = $1 AND kind = ANY($2) AND parameters->$3->>'id' = $4 RETURNING id",
        )
        .bind(project_id)
        .bind(V::NOUN.runs)
        .bind(V::NOUN.parameter)
        .bind(row.id().to_string())
        .fetch_all(&mut *tx)
        .await?;
        tx.commit().await?;
        // nothing names these objects any more
        app.store.remove_all(&(V::NOUN.prefix)(row.id())).await?;
        for run in runs {
            app.store.remove_all(&store::key::run_prefix(run.0)).await?;
        }
        Ok(StatusCode::NO_CONTENT)
    })
    .await
}
