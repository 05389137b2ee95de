//! Runs that build what is versioned.

use jobs::InputFile;
use serde::de::DeserializeOwned;
use sqlx::PgConnection;
use uuid::Uuid;

use super::enqueue::{NewRun, accept};
use crate::{
    access::Access,
    answer::Answer,
    error::{Error, Result},
    extract::Posted,
    files,
    lock::Lock,
    page::Item,
    versioned::{self, Latest, Versioned},
};

/// A request to build a version.
pub(crate) trait Build: DeserializeOwned + Send {
    /// What is built.
    type Row: Versioned;

    /// Refuses what makes no sense, whatever is to be built.
    fn check(&self) -> Result<()>;

    /// The run: everything that decides what is built.
    fn plan(
        self,
        db: &mut PgConnection,
        project_id: Uuid,
        row: &Self::Row,
        files: Vec<InputFile>,
    ) -> impl Future<Output = Result<NewRun>> + Send;
}

/// Builds a version from its files, which are fixed from then on.
pub(crate) async fn build<B: Build>(by: &Access, which: &str, posted: Posted<B>) -> Result<Answer> {
    let Posted { body, request } = posted;
    let project_id = by.caller.project_id;
    body.check()?;
    let mut tx = by.app.db.begin().await?;
    if let Some(answer) = request.replay(&mut tx, project_id).await? {
        return Ok(answer);
    }
    let row: B::Row = versioned::find(&mut tx, project_id, which, Latest::Any, Lock::Update).await?;
    if !row.version().collects() {
        return Err(Error::Conflict(format!(
            "{} is {}; {} to build another",
            row.title(),
            row.version().state,
            row.version().way_to_another()
        )));
    }
    let files = files::inputs(&mut tx, row.id()).await?;
    let run = body.plan(&mut tx, project_id, &row, files).await?;
    let run_id = run.enqueue(&mut tx, project_id).await?;
    versioned::set_build(&mut tx, &row, run_id).await?;
    accept(tx, &request, project_id, run_id).await
}

/// Refuses to build a version of nothing.
pub(super) fn no_files<V: Versioned>(row: &V) -> Error {
    Error::Unprocessable(format!("{} has no files; upload {} first", row.title(), V::NOUN.sources))
}
