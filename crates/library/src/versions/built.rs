use queue::JobError;
use serde::Serialize;
use sqlx::{PgConnection, Postgres, postgres::PgArguments, query::Query, types::Json};
use store::Stored;
use uuid::Uuid;

/// A version that was just built: what its row gets, whatever its kind.
#[derive(Debug, Clone)]
pub struct Built<C> {
    /// The row.
    pub id: Uuid,
    /// Its file, or the list of its files.
    pub stored: Stored,
    /// Of all its files, bytes.
    pub bytes: u64,
    /// What is in it, for people.
    pub contents: C,
}

impl<C: Serialize> Built<C> {
    /// Makes the row ready by the statement `sql`, in whose places from `$6` on `own` puts what is a kind's own.
    ///
    /// # Errors
    /// Gives up if no row waits for it: it was deleted, or another run built it.
    pub(super) async fn set_ready<'a>(
        &'a self,
        connection: &mut PgConnection,
        noun: &str,
        sql: &'static str,
        own: impl FnOnce(Query<'a, Postgres, PgArguments>) -> Query<'a, Postgres, PgArguments>,
    ) -> Result<(), JobError> {
        let common = sqlx::query(sql)
            .bind(self.id)
            .bind(self.stored.key.as_str())
            .bind(&self.stored.blake3)
            .bind(i64::try_from(self.bytes).unwrap_or(i64::MAX))
            .bind(Json(&self.contents));
        if own(common).execute(connection).await?.rows_affected() == 1 {
            return Ok(());
        }
        let message = format!("the {noun} was deleted or built by another run meanwhile");
        Err(JobError::give_up(message, format!("no {noun} of id {} waits for its build", self.id)))
    }
}
