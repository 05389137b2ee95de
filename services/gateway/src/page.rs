//! Lists are paged by cursor: newest first, so many at a time, and where to go on.

use serde::{Deserialize, Serialize};
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
    /// most items to give, 1 to 200; 50 when left out
    #[param(minimum = 1, maximum = 200)]
    limit: Option<u32>,
    /// `next` of the page before; the first page when left out
    cursor: Option<String>,
}

impl PageQuery {
    /// How many rows to fetch: one more than is given, to see whether there is another page.
    pub fn fetch(&self) -> Result<i64> {
        Ok(i64::from(self.limit()?) + 1)
    }

    /// Rows are wanted with an id below this one.
    pub fn before(&self) -> Result<Uuid> {
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

impl<T> Page<T> {
    /// `rows`: what [`PageQuery::fetch`] asked for, in order.
    pub fn of<R>(
        query: &PageQuery,
        mut rows: Vec<R>,
        id: impl Fn(&R) -> Uuid,
        view: impl Fn(R) -> T,
    ) -> Result<Self> {
        let limit = query.limit()? as usize;
        let more = rows.len() > limit;
        rows.truncate(limit);
        let next = if more { rows.last().map(|row| id(row).simple().to_string()) } else { None };
        Ok(Self { items: rows.into_iter().map(view).collect(), next })
    }
}
