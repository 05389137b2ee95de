use futures::future::BoxFuture;
use sqlx::PgConnection;

use crate::JobError;

/// SQL of a handler's own, run in the transaction that completes the job. It may be run again when that
/// transaction could not be committed.
pub type OnComplete =
    dyn for<'c> Fn(&'c mut PgConnection) -> BoxFuture<'c, Result<(), JobError>> + Send + Sync;
