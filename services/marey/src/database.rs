//! `marey db`.

use std::path::PathBuf;

use serde_json::json;

use crate::{
    cli::ServerArgs,
    client::{Client, MotionDatabase, Run, encode},
    pack, watch,
};

/// `marey db …`
#[derive(Debug, clap::Subcommand)]
pub enum Command {
    #[command(after_help = "Examples:
  marey db build walks recordings/walks --watch
  marey db build cmu subject-16.zip subject-35.tar.gz --watch
  marey db build mine take1.bvh take2.bvh")]
    Build(BuildArgs),
    /// List motion databases
    List(ServerArgs),
    Delete(DeleteArgs),
}

/// Build a motion database from recordings
///
/// A name that exists gets a new version. Folders are searched for ASF and AMC (put each AMC beside the ASF of its
/// performer) and BVH files, also compressed ones (.zst, .gz); archives are taken as they are.
#[derive(Debug, clap::Args)]
pub struct BuildArgs {
    /// Name of the database: letters, digits, '.', '_' and '-'
    name: String,
    /// Archives (zip, tar, tar.gz, tar.zst), folders, or ASF, AMC and BVH files
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Show the progress and wait until it is built
    #[arg(long, short)]
    watch: bool,
    #[command(flatten)]
    server: ServerArgs,
}

/// Delete a motion database
#[derive(Debug, clap::Args)]
pub struct DeleteArgs {
    /// The database: NAME@VERSION, or its id
    which: String,
    #[command(flatten)]
    server: ServerArgs,
}

/// Runs `marey db`.
pub fn run(command: &Command) -> anyhow::Result<()> {
    match command {
        Command::Build(args) => {
            let client = Client::new(args.server.server()?);
            let (database, run) = start(&client, &args.name, &args.files)?;
            println!("building motion database {}@{} in run {}", database.name, database.version, run.id);
            if args.watch {
                watch::until_end(&client, &run.id)?;
                let database: MotionDatabase =
                    client.get(&format!("/v1/motion-databases/{}", database.id))?;
                println!(
                    "ready: {} poses of {} clips",
                    database.num_poses.unwrap_or_default(),
                    database.num_clips.unwrap_or_default()
                );
            }
            Ok(())
        }
        Command::List(args) => list(&Client::new(args.server()?)),
        Command::Delete(args) => {
            let client = Client::new(args.server.server()?);
            client.delete(&format!("/v1/motion-databases/{}", encode(&args.which)))?;
            println!("deleted motion database {}", args.which);
            Ok(())
        }
    }
}

/// Makes a database, uploads its files and has it built.
pub fn start(client: &Client, name: &str, files: &[PathBuf]) -> anyhow::Result<(MotionDatabase, Run)> {
    let uploads = pack::pack(name, files)?;
    let database: MotionDatabase = client.post("/v1/motion-databases", &json!({ "name": name }))?;
    for upload in uploads {
        let packed =
            if upload.num_files > 0 { format!(" ({} files)", upload.num_files) } else { String::new() };
        println!("uploading {}{packed}", upload.name);
        let path = format!("/v1/motion-databases/{}/files/{}", database.id, encode(&upload.name));
        client.put_file(&path, upload.file)?;
    }
    let run = client.post(&format!("/v1/motion-databases/{}/build", database.id), &json!({}))?;
    Ok((database, run))
}

fn list(client: &Client) -> anyhow::Result<()> {
    let databases: Vec<MotionDatabase> = client.list_all("/v1/motion-databases")?;
    if databases.is_empty() {
        println!("no motion databases yet; build one with `marey db build NAME FILES…`");
        return Ok(());
    }
    println!("{:<32} {:<9} {:>10} {:>7} {:>10}", "NAME", "STATE", "POSES", "CLIPS", "MB");
    for database in databases {
        println!(
            "{:<32} {:<9} {:>10} {:>7} {:>10}",
            format!("{}@{}", database.name, database.version),
            database.state,
            database.num_poses.map_or_else(|| "-".into(), |n| n.to_string()),
            database.num_clips.map_or_else(|| "-".into(), |n| n.to_string()),
            database.bytes.map_or_else(|| "-".into(), |n| format!("{:.1}", n as f64 / 1e6)),
        );
    }
    Ok(())
}
