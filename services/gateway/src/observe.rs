//! What operators see: counts of requests, the queue, and answers for probes.

use std::{
    collections::BTreeMap,
    fmt::Write,
    sync::{Arc, Mutex},
};

use axum::{
    extract::{MatchedPath, Request, State},
    middleware::Next,
    response::Response,
};
use sqlx::PgPool;

use crate::error::Result;

/// Requests answered, by method, route and status.
#[derive(Debug, Default)]
pub(crate) struct HttpCounts(Mutex<BTreeMap<(String, String, u16), u64>>);

/// Counts the request once it is answered.
pub(crate) async fn count_request(
    State(counts): State<Arc<HttpCounts>>,
    request: Request,
    next: Next,
) -> Response {
    let method = request.method().to_string();
    let route = request.extensions().get::<MatchedPath>().map_or("none", |path| path.as_str()).to_owned();
    let response = next.run(request).await;
    if let Ok(mut counts) = counts.0.lock() {
        *counts.entry((method, route, response.status().as_u16())).or_default() += 1;
    }
    response
}

#[derive(sqlx::FromRow)]
struct Count {
    kind: String,
    state: String,
    count: i64,
    oldest_secs: f64,
}

/// The metrics in Prometheus' text format.
pub(crate) async fn render(db: &PgPool, counts: &HttpCounts) -> Result<String> {
    // finished jobs are many and say nothing about now: only those that are not are counted
    let jobs: Vec<Count> = sqlx::query_as(
        "SELECT kind, state, count(*) AS count,
                coalesce(extract(epoch FROM clock_timestamp() - min(created_at)), 0)::float8 AS oldest_secs
         FROM jobs WHERE state IN ('blocked', 'available', 'running') GROUP BY kind, state ORDER BY kind, state",
    )
    .fetch_all(db)
    .await?;
    let runs: Vec<Count> = sqlx::query_as(
        "SELECT kind, state, count(*) AS count, 0::float8 AS oldest_secs
         FROM runs GROUP BY kind, state ORDER BY kind, state",
    )
    .fetch_all(db)
    .await?;
    let mut text = String::new();
    let line = |text: std::fmt::Arguments<'_>, out: &mut String| {
        // writing to a String can't fail
        let _ = out.write_fmt(text);
        out.push('\n');
    };
    line(format_args!("# HELP marey_jobs Jobs in the queue that have not ended."), &mut text);
    line(format_args!("# TYPE marey_jobs gauge"), &mut text);
    for Count { kind, state, count, .. } in &jobs {
        line(format_args!("marey_jobs{{kind=\"{kind}\",state=\"{state}\"}} {count}"), &mut text);
    }
    line(
        format_args!("# HELP marey_oldest_job_age_seconds Age of the oldest job that has not ended."),
        &mut text,
    );
    line(format_args!("# TYPE marey_oldest_job_age_seconds gauge"), &mut text);
    for Count { kind, state, oldest_secs, .. } in &jobs {
        line(
            format_args!(
                "marey_oldest_job_age_seconds{{kind=\"{kind}\",state=\"{state}\"}} {oldest_secs:.3}"
            ),
            &mut text,
        );
    }
    line(format_args!("# HELP marey_runs Runs by state."), &mut text);
    line(format_args!("# TYPE marey_runs gauge"), &mut text);
    for Count { kind, state, count, .. } in &runs {
        line(format_args!("marey_runs{{kind=\"{kind}\",state=\"{state}\"}} {count}"), &mut text);
    }
    line(format_args!("# HELP marey_http_requests_total Requests answered by this process."), &mut text);
    line(format_args!("# TYPE marey_http_requests_total counter"), &mut text);
    if let Ok(counts) = counts.0.lock() {
        for ((method, route, status), count) in counts.iter() {
            line(
                format_args!(
                    "marey_http_requests_total{{method=\"{method}\",route=\"{route}\",status=\"{status}\"}} {count}"
                ),
                &mut text,
            );
        }
    }
    Ok(text)
}
