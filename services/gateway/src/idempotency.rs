//! `Idempotency-Key`: a POST sent again is answered again, not done again.
//!
//! The answer is written in the transaction that does the work. A second request with the key that comes while the
//! first is at it waits on the row until the first has committed (and gets its answer) or has failed (and is done
//! itself). Failures are not kept: the same key may be tried again.

use axum::http::{HeaderMap, Method, StatusCode};
use sqlx::{PgConnection, Postgres, Transaction};
use uuid::Uuid;

use crate::{
    answer::Answer,
    error::{Error, Result},
};

/// What a POST is known by.
#[derive(Debug)]
pub(crate) struct RequestKey(Option<Key>);

#[derive(Debug)]
struct Key {
    key: String,
    request_hash: [u8; 32],
}

#[derive(sqlx::FromRow)]
struct Row {
    request_hash: Vec<u8>,
    status: i32,
    location: Option<String>,
    response: serde_json::Value,
}

impl RequestKey {
    /// Reads the header, if the request has it.
    pub fn read(headers: &HeaderMap, method: &Method, path: &str, body: &[u8]) -> Result<Self> {
        let mut values = headers.get_all("idempotency-key").iter();
        let Some(value) = values.next() else { return Ok(Self(None)) };
        if values.next().is_some() {
            return Err(Error::BadRequest("Idempotency-Key is given twice, expected once".into()));
        }
        let key = value
            .to_str()
            .ok()
            .map(str::trim)
            .filter(|key| (1..=255).contains(&key.len()))
            .ok_or_else(|| Error::BadRequest("Idempotency-Key must be 1 to 255 visible characters".into()))?
            .to_owned();
        let mut hasher = blake3::Hasher::new();
        for part in [method.as_str().as_bytes(), path.as_bytes(), body] {
            hasher.update(&(part.len() as u64).to_le_bytes()).update(part);
        }
        Ok(Self(Some(Key { key, request_hash: *hasher.finalize().as_bytes() })))
    }

    /// The answer given before, if this request was done before. Otherwise the key is now held by this transaction.
    pub async fn replay(&self, connection: &mut PgConnection, project_id: Uuid) -> Result<Option<Answer>> {
        let Some(Key { key, request_hash }) = &self.0 else { return Ok(None) };
        let claimed = sqlx::query(
            "INSERT INTO idempotency_keys (project_id, key, request_hash, status, response)
             VALUES ($1, $2, $3, 0, 'null') ON CONFLICT DO NOTHING",
        )
        .bind(project_id)
        .bind(key)
        .bind(request_hash.as_slice())
        .execute(&mut *connection)
        .await?;
        if claimed.rows_affected() == 1 {
            return Ok(None);
        }
        let row: Row = sqlx::query_as(
            "SELECT request_hash, status, location, response FROM idempotency_keys
             WHERE project_id = $1 AND key = $2",
        )
        .bind(project_id)
        .bind(key)
        .fetch_one(connection)
        .await?;
        if row.request_hash != request_hash {
            return Err(Error::IdempotencyKeyReused);
        }
        let status = u16::try_from(row.status).ok().and_then(|s| StatusCode::from_u16(s).ok());
        Ok(Some(Answer {
            status: status.unwrap_or(StatusCode::OK),
            location: row.location,
            body: row.response,
            replayed: true,
        }))
    }

    /// Keeps the answer and commits.
    pub async fn commit(
        &self,
        mut tx: Transaction<'_, Postgres>,
        project_id: Uuid,
        answer: Answer,
    ) -> Result<Answer> {
        if let Some(Key { key, .. }) = &self.0 {
            sqlx::query(
                "UPDATE idempotency_keys SET status = $3, location = $4, response = $5
                 WHERE project_id = $1 AND key = $2",
            )
            .bind(project_id)
            .bind(key)
            .bind(i32::from(answer.status.as_u16()))
            .bind(&answer.location)
            .bind(&answer.body)
            .execute(&mut *tx)
            .await?;
        }
        tx.commit().await?;
        Ok(answer)
    }
}
