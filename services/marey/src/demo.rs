//! `marey demo`: the whole way, once, on motion whose truth is known.

mod cameras;
mod held_out;
mod strip;
mod summary;
mod trials;

use std::{
    fs,
    path::{Path, PathBuf},
    time::Instant,
};

use anyhow::{Context, bail};
use client::{Client, MotionDatabase};
use service::config::{TelemetryConfig, Variables, environment};

use self::{held_out::HeldOut, summary::Summary};
use model::counted;

use crate::{
    database,
    folders::{new_folder, remove},
    sample::Trials,
    serve::runtime,
    take::Take,
    up::{self, Everything},
    watch,
};

/// Where the demo's server keeps its things.
const SERVER_FOLDER: &str = ".marey/demo";
/// Where the results go unless told otherwise; the next demo's into the first free of -2, -3 and so on.
const RESULTS: &str = "marey-demo";
/// Trials that are drawn when there is no data: ten of each of four actions for each of four performers.
const NUM_SAMPLES: u32 = 160;

/// Show what Marey does, on motion of its own or on yours
///
/// Starts everything, learns from recordings, and reconstructs others from 4 and from 6 of their points; then follows a
/// synthetic person through the silhouettes of six cameras. At the end it reports how far the results are from the truth,
/// beside a plain baseline, and what to look at. Without --data, all motion is synthetic. Takes about a minute; no existing
/// file is overwritten.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  marey demo
  marey demo --data recordings/ --out my-demo/")]
pub struct Args {
    /// Folder with recordings: ASF and AMC, or BVH, also .zst or .gz
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// New folder for the results [default: marey-demo, or marey-demo-2 and so on if that exists]
    #[arg(long, short, visible_alias = "output", value_name = "DIR")]
    out: Option<PathBuf>,
    /// Leave the server running at the end, until Ctrl-C
    #[arg(long)]
    keep: bool,
}

/// Runs `marey demo`.
///
/// # Errors
/// If a part of it fails or falls short of what it should show.
pub fn run(args: &Args) -> anyhow::Result<()> {
    // before anything is started or made: a folder that can't be used leaves nothing behind
    let given = args.data.as_deref().map(HeldOut::in_folder).transpose()?;
    given.as_ref().map_or(Ok(()), HeldOut::check)?;
    let mut telemetry = TelemetryConfig::from_variables(&Variables::new(&environment))?;
    telemetry.filter.get_or_insert_with(|| "error".into());
    service::telemetry::start(&telemetry)?;
    let output = new_folder(args.out.as_deref(), RESULTS)?;
    runtime()?.block_on(async {
        let shutdown = service::shutdown::on_signal()?;
        let begin = Instant::now();
        let folder = Path::new(SERVER_FOLDER);
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        println!("Starting PostgreSQL, the gateway and the four services");
        let up = up::Args { data_dir: folder.to_owned(), listen: ([127, 0, 0, 1], 0).into(), workers: None };
        let started = Everything::start(&up, shutdown.clone()).await?;
        let everything = started.context("stopped before it had begun")?;
        let client = Client::new(everything.server.clone());
        let show = tokio::task::spawn_blocking(move || {
            let summary = show(&client, given, folder, &output)?;
            summary.print(begin.elapsed(), &output)
        });
        // Ctrl-C ends the services, and so whatever waits for them
        let shown = tokio::select! {
            shown = show => shown?,
            () = shutdown.cancelled() => Err(anyhow::anyhow!("stopped before the end")),
        };
        if shown.is_ok() && args.keep {
            println!("\nStill running at {}; Ctrl-C stops it.", everything.server.url);
            shutdown.cancelled().await;
        }
        shutdown.cancel();
        everything.until_stopped(shutdown).await?;
        shown
    })
}

/// Everything that is shown, on `given` recordings or drawn ones; results go to `output`.
fn show(client: &Client, given: Option<HeldOut>, folder: &Path, output: &Path) -> anyhow::Result<Summary> {
    let is_synthetic = given.is_none();
    let HeldOut { tested, learned } = match given {
        Some(given) => given,
        None => HeldOut::in_folder(&draw_trials(&folder.join("recordings"))?)?,
    };
    println!("Learning from {}; {} are held out", counted(learned.len(), "trial"), tested.len());
    let database = build(client, &learned)?;
    let trials = trials::reconstruct(client, &database, &tested, output)?;
    let followed = cameras::show(client, folder, output)?;
    Ok(Summary { is_synthetic, num_learned: learned.len(), trials, followed })
}

/// Draws recordings; those of an earlier demo were the same.
fn draw_trials(folder: &Path) -> anyhow::Result<PathBuf> {
    println!("Making {NUM_SAMPLES} synthetic trials: walking, running, jumping and boxing");
    remove(folder)?;
    Trials { count: NUM_SAMPLES, seed: 1, action: None, frames: 240, points: None }.write(folder)?;
    Ok(folder.to_owned())
}

fn build(client: &Client, takes: &[Take]) -> anyhow::Result<MotionDatabase> {
    let files = takes.iter().flat_map(|take| take.indices.iter().chain([&take.motion]).chain(&take.skeleton));
    let mut files: Vec<PathBuf> = files.cloned().collect();
    files.sort();
    files.dedup();
    let (database, run) = database::build(client, "demo", &files)?;
    watch::until_end(client, &run.id)?;
    let database: MotionDatabase = client.get(&format!("/v1/motion-databases/{}", database.id))?;
    if database.num_poses.unwrap_or(0) == 0 {
        bail!("the motion database has no pose");
    }
    Ok(database)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is said of a folder with these files; no folder for results may be left.
    fn refused(files: &[&str]) -> anyhow::Result<String> {
        let place = tempfile::tempdir()?;
        let (data, out) = (place.path().join("data"), place.path().join("out"));
        fs::create_dir(&data)?;
        for name in files {
            fs::write(data.join(name), "x")?;
        }
        let message = refusal(data, &out);
        assert!(!out.exists(), "{files:?}");
        Ok(message)
    }

    fn refusal(data: PathBuf, out: &Path) -> String {
        let args = Args { data: Some(data), out: Some(out.to_owned()), keep: false };
        format!("{:#}", run(&args).unwrap_err())
    }

    #[test]
    fn a_folder_that_is_no_use_is_refused_before_anything_is_made() -> anyhow::Result<()> {
        for files in [&[][..], &["notes.txt"], &["16.asf"]] {
            let message = refused(files)?;
            assert!(message.contains("data: found 0 recorded trials (ASF with AMC"), "{message}");
        }
        let message = refused(&["1.bvh", "2.bvh"])?;
        assert!(message.ends_with("found 2 recorded trials (ASF with AMC, or BVH), expected at least 3"));
        let message = refused(&["16_1.amc", "16_2.amc", "16_3.amc"])?;
        let expected = "found no ASF file with the skeleton of 3 AMC files: 16_1.amc, 16_2.amc, 16_3.amc;";
        assert!(message.contains(expected), "{message}");

        for (files, named) in [
            (&["1.bvh", "2.bvh", "3.bvh"][..], "1.bvh"),
            (&["16.asf", "16_1.amc", "16_2.amc", "16_3.amc"], "16_1.amc"),
        ] {
            let message = refused(files)?;
            assert!(message.contains(named) && message.contains("can't be read: "), "{message}");
        }

        let place = tempfile::tempdir()?;
        let (data, out) = (place.path().join("gone"), place.path().join("out"));
        let message = refusal(data.clone(), &out);
        assert!(message.contains("gone: No such file"), "{message}");
        fs::write(&data, "x")?;
        let message = refusal(data, &out);
        assert!(message.ends_with("gone is a file, expected a folder of recordings"), "{message}");
        assert!(!out.exists());
        Ok(())
    }

    #[test]
    fn motions_without_a_skeleton_are_left_out_of_those_that_have_one() -> anyhow::Result<()> {
        let data = tempfile::tempdir()?;
        for name in ["1.bvh", "2.bvh", "3.bvh", "16_1.amc"] {
            fs::write(data.path().join(name), "x")?;
        }
        let HeldOut { tested, learned } = HeldOut::in_folder(data.path())?;
        assert_eq!(tested.len() + learned.len(), 3);
        Ok(())
    }
}
