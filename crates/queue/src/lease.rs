//! Signs of life, progress, and what comes back with them.

use sqlx::PgConnection;

use crate::{Error, JobId, LeaseNumber, UnknownState, channels};

/// A sign of life for one job.
#[derive(Debug, Clone, PartialEq)]
pub struct Beat {
    /// The job.
    pub job_id: JobId,
    /// The claim under which it is run.
    pub lease_number: LeaseNumber,
    /// How far it is, if that has changed: 0 to 1, and a phrase for the user.
    pub progress: Option<(f64, String)>,
}

/// What the queue says to a sign of life.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BeatAnswer {
    /// The lease is held.
    Held,
    /// The lease was held a moment ago and someone is changing the job: ask again at the next beat.
    Busy,
    /// The lease is held, but nobody wants the result any more.
    Cancelled,
    /// The lease is lost: another attempt may be running. Stop, and drop the result.
    Lost,
}

/// Beats for all these jobs, stores their progress and says in the same order how each stands. Never waits
/// for a lock. Commits by itself, so call it outside a transaction.
pub async fn heartbeat(connection: &mut PgConnection, beats: &[Beat]) -> Result<Vec<BeatAnswer>, Error> {
    if beats.is_empty() {
        return Ok(Vec::new());
    }
    let progress = |beat: &Beat| beat.progress.as_ref().map(|(fraction, _)| clamp(*fraction));
    let phrase = |beat: &Beat| beat.progress.as_ref().map(|(_, phrase)| without_nul(phrase));
    let answers: Vec<String> = sqlx::query_scalar(include_str!("../queries/heartbeat.sql"))
        .bind(beats.iter().map(|beat| beat.job_id).collect::<Vec<_>>())
        .bind(beats.iter().map(|beat| beat.lease_number).collect::<Vec<_>>())
        .bind(beats.iter().map(progress).collect::<Vec<_>>())
        .bind(beats.iter().map(phrase).collect::<Vec<_>>())
        .fetch_all(&mut *connection)
        .await?;
    let moved: Vec<JobId> =
        beats.iter().filter(|beat| beat.progress.is_some()).map(|beat| beat.job_id).collect();
    if !moved.is_empty() {
        update_run_progress(connection, &moved).await?;
    }
    answers.into_iter().map(|word| Ok(BeatAnswer::try_from(word)?)).collect()
}

impl TryFrom<String> for BeatAnswer {
    type Error = UnknownState;

    fn try_from(word: String) -> Result<Self, UnknownState> {
        match word.as_str() {
            "held" => Ok(Self::Held),
            "busy" => Ok(Self::Busy),
            "cancelled" => Ok(Self::Cancelled),
            "lost" => Ok(Self::Lost),
            _ => Err(UnknownState { found: word, expected: "held, busy, cancelled, lost" }),
        }
    }
}

/// Brings the runs of these jobs up to date, at most a few times a second for each run.
pub(crate) async fn update_run_progress(connection: &mut PgConnection, jobs: &[JobId]) -> Result<(), Error> {
    let moved: Vec<String> = sqlx::query_scalar(include_str!("../queries/update_run_progress.sql"))
        .bind(jobs)
        .fetch_all(&mut *connection)
        .await?;
    channels::notify(connection, channels::RUNS, moved.iter().map(String::as_str)).await
}

/// What cannot be a share becomes one.
pub(crate) fn clamp(fraction: f64) -> f64 {
    if fraction.is_nan() { 0.0 } else { fraction.clamp(0.0, 1.0) }
}

/// PostgreSQL's text holds no NUL.
pub(crate) fn without_nul(text: &str) -> String {
    text.replace('\0', "\u{fffd}")
}
