//! What starting a run is, whatever its kind: the run, its first job and what it uses, in the transaction that answers.

use jobs::run_json::Request;
use queue::{ChildJob, Job, ProjectId};
use sqlx::{PgConnection, Postgres, Transaction};
use uuid::Uuid;

use super::run;
use crate::{answer::Answer, error::Result, idempotency::RequestKey};

/// A run to be started: what its first job is given is what the user sees as the run's parameters.
#[derive(Debug)]
pub(crate) struct NewRun {
    kind: &'static str,
    first_job: ChildJob,
    session_id: Option<Uuid>,
    motion_database_id: Option<Uuid>,
    body_model_id: Option<Uuid>,
}

impl NewRun {
    /// A run that begins with that job.
    pub fn new(first_job: &(impl Job + Request)) -> Result<Self> {
        Ok(Self {
            kind: first_job.run_kind(),
            first_job: ChildJob::new(first_job)?,
            session_id: None,
            motion_database_id: None,
            body_model_id: None,
        })
    }

    /// It reads a session, which is not deleted until it has ended.
    #[must_use]
    pub fn on_session(self, id: Uuid) -> Self {
        Self { session_id: Some(id), ..self }
    }

    /// It reads a motion database, which is not deleted until it has ended.
    #[must_use]
    pub fn with_motion_database(self, id: Option<Uuid>) -> Self {
        Self { motion_database_id: id, ..self }
    }

    /// It reads a body model, which is not deleted until it has ended; nil is the one that comes with the program.
    #[must_use]
    pub fn with_body_model(self, id: Uuid) -> Self {
        Self { body_model_id: Some(id).filter(|id| !id.is_nil()), ..self }
    }

    /// Adds the run and its first job.
    pub async fn enqueue(self, db: &mut PgConnection, project_id: Uuid) -> Result<Uuid> {
        let run = queue::NewRun {
            project_id: ProjectId(project_id),
            kind: self.kind,
            session_id: self.session_id,
            parameters: self.first_job.payload.clone(),
        };
        let run_id = queue::enqueue_run(db, &run).await?;
        queue::enqueue_many(db, run_id, &[self.first_job]).await?;
        sqlx::query("UPDATE runs SET motion_database_id = $2, body_model_id = $3 WHERE id = $1")
            .bind(run_id)
            .bind(self.motion_database_id)
            .bind(self.body_model_id)
            .execute(db)
            .await?;
        Ok(run_id.0)
    }
}

/// Commits, and answers (202) with the run.
pub(crate) async fn accept(
    mut tx: Transaction<'_, Postgres>,
    request: &RequestKey,
    project_id: Uuid,
    run_id: Uuid,
) -> Result<Answer> {
    let run = run::find(&mut tx, project_id, run_id).await?;
    let answer = Answer::accepted(format!("/v1/runs/{run_id}"), &run)?;
    request.commit(tx, project_id, answer).await
}
