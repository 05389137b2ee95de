//! `marey results`.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;
use client::{Client, ResultFile, ServerArgs, encode};

/// Download what a run has made
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:
  marey results 0198… -o take3/        then open take3/motion.bvh in Blender: File > Import > Motion Capture (.bvh);
                                       of cameras: look at take3/overlay_CAMERA.mp4, open take3/body.glb")]
pub struct Args {
    /// The run's id
    run: String,
    /// Folder to download into; without it, the results are only listed
    #[arg(long, short)]
    output: Option<PathBuf>,
    #[command(flatten)]
    server: ServerArgs,
}

/// Runs `marey results`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let client = Client::new(args.server.server()?);
    let results = match &args.output {
        Some(folder) => download(&client, &args.run, folder)?,
        None => list(&client, &args.run)?,
    };
    if results.is_empty() {
        println!("no results (yet); see `marey status {}`", args.run);
    }
    for result in results {
        let shown =
            args.output.as_ref().map_or(result.name.clone().into(), |folder| folder.join(&result.name));
        println!("{:>12} bytes  {}", result.bytes, shown.display());
    }
    Ok(())
}

fn list(client: &Client, run: &str) -> anyhow::Result<Vec<ResultFile>> {
    client.get(&format!("/v1/runs/{}/results", encode(run)))
}

/// Downloads all results of a run into a folder.
pub fn download(client: &Client, run: &str, folder: &Path) -> anyhow::Result<Vec<ResultFile>> {
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let results = list(client, run)?;
    for result in &results {
        let name = Path::new(&result.name).file_name().context("a result without a name")?;
        let path = format!("/v1/runs/{}/results/{}", encode(run), encode(&result.name));
        client.download(&path, &result.blake3, &folder.join(name))?;
    }
    Ok(results)
}
