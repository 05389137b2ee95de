//! `marey status` and `marey cancel`.

use client::{Client, Page, Run, ServerArgs};
use serde_json::json;

use crate::watch;

/// Show the progress of runs
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  marey status                        # the latest runs
  marey status \"take 3\"               # the newest run of a session
  marey status \"take 3\" --watch")]
pub struct Args {
    /// The run: its id, or a session's name for its newest run [default: the latest runs are listed]
    run: Option<String>,
    /// Show the progress and wait for the end
    #[arg(long, short, requires = "run")]
    watch: bool,
    #[command(flatten)]
    server: ServerArgs,
}

/// Cancel a run
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  marey cancel \"take 3\"")]
pub struct CancelArgs {
    /// The run: its id, or a session's name for its newest run
    run: String,
    #[command(flatten)]
    server: ServerArgs,
}

/// Runs `marey status`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let client = Client::new(args.server.server()?);
    let Some(id) = &args.run else { return list(&client) };
    let run: Run = client.get(&format!("/v1/runs/{}", client.find_run(id)?))?;
    show(&run);
    if args.watch {
        watch::until_end(&client, &run.id)?;
        println!("succeeded");
    }
    Ok(())
}

/// Runs `marey cancel`.
pub fn cancel(args: &CancelArgs) -> anyhow::Result<()> {
    let client = Client::new(args.server.server()?);
    let path = format!("/v1/runs/{}", client.find_run(&args.run)?);
    let before: Run = client.get(&path)?;
    let run: Run = client.post(&format!("{path}/cancel"), &json!({}))?;
    println!("{}", cancelled(&run, &before.state));
    Ok(())
}

/// What became of a run that was to be cancelled; `before`: its state until then.
fn cancelled(run: &Run, before: &str) -> String {
    let Run { id, state, .. } = run;
    match (before, state.as_str()) {
        ("failed" | "succeeded", ended) => format!("run {id} had already {ended}; nothing to cancel"),
        ("cancelled", _) => format!("run {id} was already cancelled; nothing to cancel"),
        (_, ended @ ("failed" | "succeeded")) => format!("run {id} {ended} before it could be cancelled"),
        (_, state) => format!("run {id} is {state}"),
    }
}

fn list(client: &Client) -> anyhow::Result<()> {
    let page: Page<Run> = client.get("/v1/runs?limit=20")?;
    if page.items.is_empty() {
        println!("no runs yet");
    }
    for run in page.items {
        let about = subject(&run);
        println!("{}  {:<15} {:<9} {:>3.0} %  {about}", run.id, run.kind, run.state, run.progress * 100.0);
    }
    Ok(())
}

/// What the run is about: a session, a motion database or a body model.
fn subject(run: &Run) -> String {
    match run.parameters["session_name"].as_str() {
        Some(name) => name.to_owned(),
        None => {
            let asked = &run.parameters;
            let key = if asked["body_model"].is_object() { "body_model" } else { "motion_database" };
            let built = &asked[key];
            format!("{}@{}", built["name"].as_str().unwrap_or("?"), built["version"])
        }
    }
}

/// Its state, and while it goes on how far it is.
fn state(run: &Run) -> String {
    match (run.state.as_str(), run.phrase.as_str()) {
        ("running", "") => format!("running, {:.0} %", run.progress * 100.0),
        ("running", phrase) => format!("running, {:.0} %: {phrase}", run.progress * 100.0),
        (state, _) => state.to_owned(),
    }
}

fn show(run: &Run) {
    println!("run      {}", run.id);
    println!("run of   {}: {}", run.kind, subject(run));
    println!("created  {}", run.created_at);
    println!("state    {}", state(run));
    if let Some(error) = &run.error {
        println!("error    {error}");
    }
    for jobs in &run.jobs {
        let workers =
            if jobs.workers.is_empty() { String::new() } else { format!("  by {}", jobs.workers.join(", ")) };
        println!("jobs     {:>4} {:<24} {}{workers}", jobs.count, jobs.kind, jobs.state);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_state_says_how_far_only_what_is_going_on() {
        let run = |state: &str, phrase: &str| {
            let run = json!({
                "id": "1", "kind": "multi-view", "state": state, "progress": 0.4, "phrase": phrase,
                "error": null, "created_at": "2025-01-01T00:00:00Z",
            });
            super::state(&serde_json::from_value::<Run>(run).unwrap())
        };
        assert_eq!(run("running", "reading the files"), "running, 40 %: reading the files");
        assert_eq!(run("running", ""), "running, 40 %");
        assert_eq!(run("succeeded", ""), "succeeded");
    }

    #[test]
    fn a_run_that_has_ended_is_not_said_to_be_cancelled() {
        let cancelled = |before: &str, state: &str| {
            let run = json!({
                "id": "1", "kind": "multi-view", "state": state, "progress": 0.4, "phrase": "", "error": null,
                "created_at": "2025-01-01T00:00:00Z",
            });
            super::cancelled(&serde_json::from_value::<Run>(run).unwrap(), before)
        };
        assert_eq!(cancelled("queued", "cancelled"), "run 1 is cancelled");
        assert_eq!(cancelled("failed", "failed"), "run 1 had already failed; nothing to cancel");
        assert_eq!(cancelled("running", "succeeded"), "run 1 succeeded before it could be cancelled");
    }
}
