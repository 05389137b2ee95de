//! `marey results`.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;
use client::{Client, ResultFile, Run, ServerArgs, encode};

use crate::watch;

/// List or download the results of a run
///
/// For Blender: File > Import > Motion Capture (.bvh), Scale 0.01 (the file is in centimetres), then motion.bvh. Of a session
/// with cameras, look at overlay_CAMERA.mp4 first; body.glb opens in Blender by File > Import > glTF 2.0. If the run failed or
/// was cancelled, this reports it and exits with an error, after listing what exists.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  marey results \"take 3\"                # lists them
  marey results \"take 3\" -o take3/      # downloads them")]
pub struct Args {
    /// The run: its id, or a session's name for its newest run
    run: String,
    /// Folder to download into [default: nothing is downloaded, the results are listed]
    #[arg(long, short, visible_alias = "output", value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    server: ServerArgs,
}

/// Runs `marey results`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let client = Client::new(args.server.server()?);
    let id = client.find_run(&args.run)?;
    // asked first: if it ends meanwhile, its results are there
    let run: Run = client.get(&format!("/v1/runs/{}", encode(&id)))?;
    let results = match &args.out {
        Some(folder) => download(&client, &id, folder)?,
        None => list(&client, &id)?,
    };
    for result in &results {
        let shown = args.out.as_ref().map_or(result.name.clone().into(), |folder| folder.join(&result.name));
        println!("{:>12} bytes  {}", result.bytes, shown.display());
    }
    watch::not_in_vain(&run.state, run.error.as_deref())?;
    if results.is_empty() {
        println!("no results yet; see `marey status {id}`");
    }
    Ok(())
}

fn list(client: &Client, run: &str) -> anyhow::Result<Vec<ResultFile>> {
    client.get(&format!("/v1/runs/{}/results", encode(run)))
}

/// Downloads all results of a run into a folder.
pub fn download(client: &Client, run: &str, folder: &Path) -> anyhow::Result<Vec<ResultFile>> {
    let results = list(client, run)?;
    if !results.is_empty() {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    for result in &results {
        let name = Path::new(&result.name).file_name().context("a result without a name")?;
        let path = format!("/v1/runs/{}/results/{}", encode(run), encode(&result.name));
        client.download(&path, &result.blake3, &folder.join(name))?;
    }
    Ok(results)
}
