//! `body_models`.

use jobs::body_model::BodyModelFile;
use queue::JobError;
use serde::Serialize;
use sqlx::{PgConnection, PgPool};
use uuid::Uuid;

use super::{
    Built,
    sql::{select, set_ready},
};

/// The body model of that id, if it is ready.
///
/// # Errors
/// If PostgreSQL fails.
pub async fn find(pool: &PgPool, id: Uuid) -> sqlx::Result<Option<BodyModelFile>> {
    let sql = select!("body_models", "", "id = $1");
    let row: Option<(Uuid, String, i32, String, String)> =
        sqlx::query_as(sql).bind(id).fetch_optional(pool).await?;
    Ok(row.map(|(id, name, version, store_key, blake3)| BodyModelFile {
        id,
        name,
        version,
        store_key: Some(store_key),
        blake3,
    }))
}

/// A body model that was just learned.
#[derive(Debug, Clone)]
pub struct BuiltBodyModel<C> {
    /// What all versions have.
    pub built: Built<C>,
    /// Vertices of a body.
    pub num_vertices: usize,
    /// Principal components of shape.
    pub num_components: usize,
}

impl<C: Serialize> BuiltBodyModel<C> {
    /// Makes its row ready. Belongs into the transaction that completes the job.
    ///
    /// # Errors
    /// Gives up if no row waits for it: it was deleted, or another run built it.
    pub async fn set_ready(&self, connection: &mut PgConnection) -> Result<(), JobError> {
        let sql = set_ready!("body_models", "num_vertices = $6, num_components = $7");
        let number = |n: usize| i32::try_from(n).unwrap_or(i32::MAX);
        let own = self.built.set_ready(connection, "body model", sql, |query| {
            query.bind(number(self.num_vertices)).bind(number(self.num_components))
        });
        own.await
    }
}
