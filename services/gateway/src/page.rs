//! Lists are paged by cursor: newest first, so many at a time, and where the next part begins.

use axum::Json;
use serde::{Deserialize, Serialize};
use sqlx::{FromRow, PgPool, postgres::PgRow};
use utoipa::{IntoParams, ToSchema};
use uuid::Uuid;

use crate::error::{Error, Result};

const DEFAULT_LIMIT: u32 = 50;
const MAX_LIMIT: u32 = 200;

/// Which part of a list is wanted.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct PageQuery {
    /// maximum number of items, 1 to 200; 50 when left out
    #[param(minimum = 1, maximum = 200)]
    limit: Option<u32>,
    /// `next` of the page before; the first page when left out
    cursor: Option<String>,
}

/// What lists are made of: its id is its place in them, as ids rise in time.
pub(crate) trait Item: for<'r> FromRow<'r, PgRow> + Send + Unpin {
    /// The id.
    fn id(&self) -> Uuid;
}

impl PageQuery {
    /// The part of a list. `query`: rows of owner `$1` with an id below `$2`, newest first, at most `$3`.
    pub async fn select<T: Item>(
        &self,
        db: &PgPool,
        query: &'static str,
        owner: Uuid,
    ) -> Result<Json<Page<T>>> {
        self.select_ending_with(db, query, owner, None).await
    }

    /// The same of a list that ends with one more item, older than all.
    pub async fn select_ending_with<T: Item>(
        &self,
        db: &PgPool,
        query: &'static str,
        owner: Uuid,
        oldest: Option<T>,
    ) -> Result<Json<Page<T>>> {
        let limit = self.limit()?;
        // One more than is given, to see whether there is another page.
        let rows = sqlx::query_as(query).bind(owner).bind(self.before()?).bind(i64::from(limit) + 1);
        let mut items: Vec<T> = rows.fetch_all(db).await?;
        let before = self.before()?;
        items.extend(oldest.filter(|oldest| items.len() <= limit as usize && oldest.id() < before));
        let more = items.len() > limit as usize;
        items.truncate(limit as usize);
        let next = if more { items.last().map(|item| item.id().simple().to_string()) } else { None };
        Ok(Json(Page { items, next }))
    }

    fn before(&self) -> Result<Uuid> {
        match &self.cursor {
            None => Ok(Uuid::max()),
            Some(cursor) => Uuid::try_parse(cursor)
                .map_err(|_| Error::BadRequest("cursor is not the \"next\" of an earlier page".into())),
        }
    }

    fn limit(&self) -> Result<u32> {
        match self.limit.unwrap_or(DEFAULT_LIMIT) {
            limit @ 1..=MAX_LIMIT => Ok(limit),
            limit => Err(Error::BadRequest(format!("limit is {limit}, expected 1 to {MAX_LIMIT}"))),
        }
    }
}

/// A part of a list.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Page<T> {
    /// the items, newest first
    items: Vec<T>,
    /// give it as `cursor` to get the items after these; null when there are none
    next: Option<String>,
}
