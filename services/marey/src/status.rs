//! `marey status` and `marey cancel`.

use client::{Client, Page, Run, ServerArgs, encode};
use serde_json::json;

use crate::watch;

/// Show runs and how far they are
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A run's id; without it, the latest runs are listed
    run: Option<String>,
    /// Show the progress and wait for the end
    #[arg(long, short, requires = "run")]
    watch: bool,
    #[command(flatten)]
    server: ServerArgs,
}

/// Cancel a run
#[derive(Debug, clap::Args)]
pub struct CancelArgs {
    /// The run's id
    run: String,
    #[command(flatten)]
    server: ServerArgs,
}

/// Runs `marey status`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let client = Client::new(args.server.server()?);
    let Some(id) = &args.run else { return list(&client) };
    let run: Run = client.get(&format!("/v1/runs/{}", encode(id)))?;
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
    let run: Run = client.post(&format!("/v1/runs/{}/cancel", encode(&args.run)), &json!({}))?;
    println!("run {} is {}", run.id, run.state);
    Ok(())
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

fn show(run: &Run) {
    println!("run      {}", run.id);
    println!("what     {}: {}", run.kind, subject(run));
    println!("asked    {}", run.created_at);
    println!("state    {}, {:.0} %, {}", run.state, run.progress * 100.0, run.phrase);
    if let Some(error) = &run.error {
        println!("error    {error}");
    }
    for jobs in &run.jobs {
        let workers =
            if jobs.workers.is_empty() { String::new() } else { format!("  by {}", jobs.workers.join(", ")) };
        println!("jobs     {:>4} {:<24} {}{workers}", jobs.count, jobs.kind, jobs.state);
    }
}
