//! `marey results`.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;
use client::{Client, ResultFile, ServerArgs, encode};

/// List or download the results of a run
///
/// For Blender: File > Import > Motion Capture (.bvh), then motion.bvh. Of a session with cameras, look at
/// overlay_CAMERA.mp4 first; body.glb opens in Blender by File > Import > glTF 2.0.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  marey results \"take 3\"                # lists them
  marey results \"take 3\" -o take3/      # downloads them")]
pub struct Args {
    /// The run: its id, or the name of a session, whose newest run is meant
    run: String,
    /// Folder to download into [default: nothing is downloaded, the results are listed]
    #[arg(long, short)]
    output: Option<PathBuf>,
    #[command(flatten)]
    server: ServerArgs,
}

/// Runs `marey results`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let client = Client::new(args.server.server()?);
    let run = client.find_run(&args.run)?;
    let results = match &args.output {
        Some(folder) => download(&client, &run, folder)?,
        None => list(&client, &run)?,
    };
    if results.is_empty() {
        println!("no results yet; see `marey status {run}`");
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
