//! Watching a run: a progress bar on a terminal, a line now and then elsewhere.

use std::{
    io::{BufRead, BufReader, IsTerminal},
    time::Duration,
};

use anyhow::bail;
use client::Client;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Deserialize;

/// Between two tries to connect.
const RETRY: Duration = Duration::from_secs(1);
/// Tries before giving up, when not even the first word comes.
const MAX_TRIES: u32 = 30;

/// How far a run is, as `/events` tells it.
#[derive(Debug, Clone, Deserialize)]
pub struct Progress {
    /// queued, running, succeeded, failed, cancelled
    pub state: String,
    /// 0 to 1
    pub progress: f64,
    /// what is being done
    pub phrase: String,
    /// why it failed
    pub error: Option<String>,
}

/// Shows a run's progress until it ends.
///
/// # Errors
/// If it fails or is cancelled, or the server can't be reached any more.
pub fn until_end(client: &Client, run_id: &str) -> anyhow::Result<()> {
    let mut display = Display::new();
    let end = until_end_with(client, run_id, |progress| {
        let phrase = if progress.phrase.is_empty() { &progress.state } else { &progress.phrase };
        display.show(progress.progress, phrase);
    });
    display.close();
    end
}

/// Waits for the end of a run and tells how far it is.
///
/// # Errors
/// As [`until_end`].
pub fn until_end_with(client: &Client, run_id: &str, show: impl FnMut(&Progress)) -> anyhow::Result<()> {
    let end = follow(client, run_id, show)?;
    not_in_vain(&end.state, end.error.as_deref())
}

/// That a run has succeeded, or may yet.
///
/// # Errors
/// If it has failed or was cancelled.
pub fn not_in_vain(state: &str, error: Option<&str>) -> anyhow::Result<()> {
    match state {
        "failed" => bail!("the run failed: {}", error.unwrap_or("no reason given")),
        "cancelled" => bail!("the run was cancelled"),
        _ => Ok(()),
    }
}

/// Follows a run's events until it ends, connecting again when the connection breaks.
fn follow(client: &Client, run_id: &str, mut show: impl FnMut(&Progress)) -> anyhow::Result<Progress> {
    let path = format!("/v1/runs/{run_id}/events");
    let mut failures = 0;
    loop {
        match client.open(&path) {
            Ok(response) => {
                failures = 0;
                let mut lines = BufReader::new(response.into_body().into_reader()).lines();
                // a stream that breaks off is as good as one that ends: connect again
                while let Some(Ok(line)) = lines.next() {
                    let Some(data) = line.strip_prefix("data:") else { continue };
                    let progress: Progress = serde_json::from_str(data)?;
                    show(&progress);
                    if matches!(progress.state.as_str(), "succeeded" | "failed" | "cancelled") {
                        return Ok(progress);
                    }
                }
            }
            Err(error) => {
                failures += 1;
                if failures > MAX_TRIES || !error.to_string().contains("does not answer") {
                    return Err(error);
                }
            }
        }
        std::thread::sleep(RETRY);
    }
}

/// A progress bar on a terminal, a line now and then elsewhere.
pub struct Display(Kind);

enum Kind {
    Bar(ProgressBar),
    Lines { last_percent: u64, last_phrase: String },
}

impl Display {
    /// At nothing.
    pub fn new() -> Self {
        if !std::io::stderr().is_terminal() {
            return Self(Kind::Lines { last_percent: u64::MAX, last_phrase: String::new() });
        }
        let bar = ProgressBar::new(1000);
        if let Ok(style) = ProgressStyle::with_template("  {bar:32} {percent:>3} %  {elapsed:>4}  {wide_msg}")
        {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(250));
        Self(Kind::Bar(bar))
    }

    /// How much is done, 0 to 1, and what is being done.
    pub fn show(&mut self, done: f64, phrase: &str) {
        match &mut self.0 {
            Kind::Bar(bar) => {
                bar.set_position((done * 1000.0) as u64);
                bar.set_message(phrase.to_owned());
            }
            Kind::Lines { last_percent, last_phrase } => {
                let percent = (done * 100.0) as u64;
                if percent / 20 != *last_percent / 20 || (phrase != last_phrase && percent != *last_percent) {
                    eprintln!("  {percent:>3} %  {phrase}");
                    *last_percent = percent;
                    phrase.clone_into(last_phrase);
                }
            }
        }
    }

    /// Takes the bar away.
    pub fn close(self) {
        if let Kind::Bar(bar) = self.0 {
            bar.finish_and_clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::not_in_vain;

    #[test]
    fn a_run_that_gives_nothing_more_is_an_error_that_says_why() {
        let error = |state, why| not_in_vain(state, why).unwrap_err().to_string();
        assert_eq!(
            error("failed", Some("points.csv has no frame")),
            "the run failed: points.csv has no frame"
        );
        assert_eq!(error("failed", None), "the run failed: no reason given");
        assert_eq!(error("cancelled", None), "the run was cancelled");
        for state in ["queued", "running", "succeeded"] {
            assert!(not_in_vain(state, None).is_ok(), "{state}");
        }
    }
}
