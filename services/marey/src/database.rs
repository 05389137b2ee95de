//! `marey db`.

use std::path::PathBuf;

use anyhow::{anyhow, ensure};
use client::{
    Client, MotionDatabase, Request, Run, ServerArgs, encode, numbers::positive, parameters::values,
};
use jobs::motion_database::{Augment, Error};
use model::{counted, shown};

use crate::{
    database_show, pack, watch,
    words::{name, unit},
};

/// `marey db …`
#[derive(Debug, clap::Subcommand)]
pub enum Command {
    #[command(after_help = "Examples:
  marey db build walks recordings/ --watch
  marey db build more-walks recordings/ --augment mirror,warp --watch
  marey db build rig take1.bvh take2.bvh --bvh-metres-per-unit 0.0254 --watch   # in inches")]
    Build(BuildArgs),
    #[command(after_help = "Examples:
  marey db add walks more/ --watch                                 # all of walks@1, and more
  marey db add walks --without synthetic1_01,synthetic1_02 --watch    # without two clips")]
    Add(AddArgs),
    /// List all motion databases and their versions
    #[command(after_help = "Examples:
  marey db list")]
    List(ServerArgs),
    #[command(after_help = "Examples:
  marey db show walks
  marey db show walks@1 --clips")]
    Show(ShowArgs),
    #[command(after_help = "Examples:
  marey db train walks --watch
  marey run \"take 3\" --database walks --method gplvm --watch")]
    Train(TrainArgs),
    #[command(after_help = "Examples:
  marey db delete walks@1")]
    Delete(DeleteArgs),
}

/// Build a motion database from recordings
///
/// If the name exists, it gets a new version. Folders are searched for ASF, AMC and BVH files, also compressed ones (.zst, .gz);
/// each AMC must lie beside the ASF of its performer. Archives are taken as they are.
#[derive(Debug, clap::Args)]
pub struct BuildArgs {
    /// Name of the database: letters, digits, '.', '_' and '-'
    name: String,
    /// Archives (zip, tar, tar.gz, tar.zst), folders, or ASF, AMC and BVH files
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// More motion to make from the recordings: mirror (left and right exchanged), warp (at 0.8 and 1.25 times the speed) or
    /// warp=SPEED; mirror,warp makes about six times as much
    #[arg(long, value_delimiter = ',', value_name = "WAYS")]
    augment: Vec<Augmentation>,
    #[command(flatten)]
    options: BuildOptions,
}

/// Make a new version of a motion database: with more recordings, or without some clips
///
/// The version before stays as it is, and can be deleted. New recordings are mirrored and warped as those
/// of that version were (see `marey db build --augment`).
#[derive(Debug, clap::Args)]
pub struct AddArgs {
    /// The database to add to: NAME (its latest version that is ready), NAME@VERSION, or its id
    #[arg(value_name = "DATABASE")]
    which: String,
    /// Archives (zip, tar, tar.gz, tar.zst), folders, or ASF, AMC and BVH files
    #[arg(required_unless_present = "without")]
    files: Vec<PathBuf>,
    /// Clips to leave out, by name (see `marey db show NAME --clips`), with everything made from them
    #[arg(long, value_delimiter = ',', value_parser = name, value_name = "CLIPS")]
    without: Vec<String>,
    #[command(flatten)]
    options: BuildOptions,
}

#[derive(Debug, clap::Args)]
struct BuildOptions {
    /// Number of index files to divide it into, which replicas of motion-index share
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=64))]
    shards: Option<u8>,
    /// Length of one unit of BVH files, in metres; the files don't say it [default: 0.01, centimetres]
    #[arg(long, value_name = "METRES", value_parser = unit)]
    bvh_metres_per_unit: Option<f64>,
    /// Show the progress and wait until it is built
    #[arg(long, short)]
    watch: bool,
    #[command(flatten)]
    server: ServerArgs,
}

/// Show what is in a motion database: clips and poses by action and subject
#[derive(Debug, clap::Args)]
pub struct ShowArgs {
    /// The database: NAME (its latest version), NAME@VERSION, or its id
    #[arg(value_name = "DATABASE")]
    which: String,
    /// List the clips too
    #[arg(long)]
    clips: bool,
    #[command(flatten)]
    server: ServerArgs,
}

/// Train the model that `marey run --method gplvm` needs
///
/// It is kept with this version of the database. Training takes about a minute.
#[derive(Debug, clap::Args)]
pub struct TrainArgs {
    /// The database: NAME (its latest version that is ready), NAME@VERSION, or its id
    #[arg(value_name = "DATABASE")]
    which: String,
    /// Parameter of the training: latent_dims=5, active=300 (poses that the model keeps), max_iterations=200
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// Show the progress and wait until it is trained
    #[arg(long, short)]
    watch: bool,
    #[command(flatten)]
    server: ServerArgs,
}

/// Delete a version of a motion database
///
/// Refused while it is in use. Results of finished runs, and versions made from this one, stay.
#[derive(Debug, clap::Args)]
pub struct DeleteArgs {
    /// The database: NAME@VERSION, or its id
    #[arg(value_name = "DATABASE")]
    which: String,
    #[command(flatten)]
    server: ServerArgs,
}

/// A way to make more motion of what there is.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Augmentation {
    Mirror,
    /// 0.8 and 1.25
    Warp,
    /// another speed
    WarpTo(f64),
}

impl std::str::FromStr for Augmentation {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.strip_prefix("warp=").map(positive)) {
            ("mirror", _) => Ok(Self::Mirror),
            ("warp", _) => Ok(Self::Warp),
            (_, Some(Ok(speed))) => Ok(Self::WarpTo(speed)),
            _ => Err("expected mirror, warp, or warp=SPEED such as warp=0.9".to_owned()),
        }
    }
}

/// As the server takes it.
///
/// # Errors
/// If a way is there twice, or a speed is none that the server takes.
fn augment(ways: &[Augmentation]) -> anyhow::Result<Augment> {
    let mut mirror = false;
    let mut speeds = Vec::new();
    for way in ways {
        match way {
            Augmentation::Mirror => {
                ensure!(!mirror, "--augment has mirror twice, expected each way once");
                mirror = true;
            }
            Augmentation::Warp => speeds.extend([0.8, 1.25]),
            Augmentation::WarpTo(speed) => speeds.push(*speed),
        }
    }
    let augment = Augment { mirror, speeds };
    augment.check().map_err(|error| match error {
        Error::SpeedTwice { found } => {
            anyhow!("--augment has the speed {found} twice, expected each once; warp is 0.8 and 1.25")
        }
        Error::Speed { found } => {
            anyhow!("--augment has warp={}, expected a speed of 0.25 to 4 other than 1", shown(found))
        }
        other => anyhow!("--augment: {other}"),
    })?;
    Ok(augment)
}

impl BuildOptions {
    /// As the server takes it.
    fn request(&self) -> Request {
        Request::default().with("shards", "--shards", self.shards).with(
            "bvh_metres_per_unit",
            "--bvh-metres-per-unit",
            self.bvh_metres_per_unit,
        )
    }

    fn finish(&self, client: &Client, (database, run): (MotionDatabase, Run)) -> anyhow::Result<()> {
        println!("building motion database {}@{} in run {}", database.name, database.version, run.id);
        if self.watch {
            watch::until_end(client, &run.id)?;
            let database: MotionDatabase = client.get(&format!("/v1/motion-databases/{}", database.id))?;
            println!(
                "ready: {} of {}",
                counted(database.num_poses.unwrap_or_default(), "pose"),
                counted(database.num_clips.unwrap_or_default(), "clip")
            );
        }
        Ok(())
    }
}

/// Runs `marey db`.
pub fn run(command: &Command) -> anyhow::Result<()> {
    match command {
        Command::Build(args) => {
            let ways = (!args.augment.is_empty()).then(|| augment(&args.augment)).transpose()?;
            let ways = ways.map(serde_json::to_value).transpose()?;
            let request = args.options.request().with("augment", "--augment", ways);
            let client = Client::new(args.options.server.server()?);
            let made = Request::default().with("name", "NAME", Some(args.name.as_str()));
            args.options.finish(&client, start(&client, &args.name, &made, &args.files, &request)?)
        }
        Command::Add(args) => {
            let client = Client::new(args.options.server.server()?);
            let base = find(&client, &args.which)?;
            let made = Request::default()
                .with("name", "NAME", Some(base.name.as_str()))
                .with("base", "DATABASE", Some(args.which.as_str()))
                .with("without", "--without", Some(args.without.as_slice()));
            let request = args.options.request();
            args.options.finish(&client, start(&client, &base.name, &made, &args.files, &request)?)
        }
        Command::List(args) => list(&Client::new(args.server()?)),
        Command::Show(args) => {
            let client = Client::new(args.server.server()?);
            let path = format!("/v1/motion-databases/{}", encode(&args.which));
            print!("{}", database_show::description(&client.get(&path)?));
            if args.clips {
                print!("{}", database_show::clips(&client.get(&format!("{path}/clips"))?));
            }
            Ok(())
        }
        Command::Train(args) => train(args),
        Command::Delete(args) => {
            let client = Client::new(args.server.server()?);
            client.delete(&format!("/v1/motion-databases/{}", encode(&args.which)))?;
            println!("deleted motion database {}", args.which);
            Ok(())
        }
    }
}

fn find(client: &Client, which: &str) -> anyhow::Result<MotionDatabase> {
    client.get(&format!("/v1/motion-databases/{}", encode(which)))
}

/// Makes a database of recordings, and has it built.
pub fn build(client: &Client, name: &str, files: &[PathBuf]) -> anyhow::Result<(MotionDatabase, Run)> {
    let made = Request::default().with("name", "NAME", Some(name));
    start(client, name, &made, files, &Request::default())
}

/// Makes a database, uploads its files and has it built.
fn start(
    client: &Client,
    name: &str,
    made: &Request,
    files: &[PathBuf],
    request: &Request,
) -> anyhow::Result<(MotionDatabase, Run)> {
    let uploads = if files.is_empty() { Vec::new() } else { pack::pack(name, files)? };
    let database: MotionDatabase = client.post_request("/v1/motion-databases", made)?;
    let path = format!("/v1/motion-databases/{}", database.id);
    let called = format!("motion database {}@{}", database.name, database.version);
    let run = or_removed(client, &path, &called, || {
        send(client, &path, uploads)?;
        client.post_request(&format!("{path}/build"), request)
    })?;
    Ok((database, run))
}

/// Does what makes a new version whole. If that fails, the version is removed: nothing else would ever complete it.
pub fn or_removed<T>(
    client: &Client,
    path: &str,
    called: &str,
    complete: impl FnOnce() -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    complete().map_err(|error| match client.delete(path) {
        Ok(()) => error,
        Err(kept) => error.context(format!("{called} was left unfinished, as it can't be removed: {kept:#}")),
    })
}

fn send(client: &Client, database: &str, uploads: Vec<pack::Upload>) -> anyhow::Result<()> {
    for upload in uploads {
        let packed = if upload.num_files > 0 {
            format!(" ({})", counted(upload.num_files as u64, "file"))
        } else {
            String::new()
        };
        println!("uploading {}{packed}", upload.name);
        client.put_file(&format!("{database}/files/{}", encode(&upload.name)), upload.file)?;
    }
    Ok(())
}

fn train(args: &TrainArgs) -> anyhow::Result<()> {
    let client = Client::new(args.server.server()?);
    let parameters = values(&args.set)?;
    let path = format!("/v1/motion-databases/{}/train", encode(&args.which));
    let request = Request::default().with("method", "the method", Some("gplvm")).with(
        "parameters",
        "--set",
        Some(parameters),
    );
    let run: Run = client.post_request(&path, &request)?;
    println!("training in run {}", run.id);
    if args.watch {
        watch::until_end(&client, &run.id)?;
        println!("trained; use it by `marey run … --method gplvm`");
    }
    Ok(())
}

fn list(client: &Client) -> anyhow::Result<()> {
    let databases: Vec<MotionDatabase> = client.list_all("/v1/motion-databases")?;
    if databases.is_empty() {
        println!("no motion databases yet; build one with `marey db build NAME FILES…`");
        return Ok(());
    }
    println!("{:<32} {:<9} {:>10} {:>7} {:>10}  FROM", "NAME", "STATE", "POSES", "CLIPS", "MB");
    for database in databases {
        println!(
            "{:<32} {:<9} {:>10} {:>7} {:>10}  {}",
            format!("{}@{}", database.name, database.version),
            database.state,
            database.num_poses.map_or_else(|| "-".into(), |n| n.to_string()),
            database.num_clips.map_or_else(|| "-".into(), |n| n.to_string()),
            database.bytes.map_or_else(|| "-".into(), |n| format!("{:.1}", n as f64 / 1e6)),
            database.base.unwrap_or_default(),
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::{
        io::{BufRead, BufReader, Write},
        net::TcpListener,
    };

    use client::Server;

    use serde_json::json;

    use super::*;

    /// The first line of the one request that comes in, which is answered by `status`.
    fn answer(status: &'static str) -> (Client, std::thread::JoinHandle<String>) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let url = format!("http://{}", listener.local_addr().unwrap());
        let asked = std::thread::spawn(move || {
            let mut stream = BufReader::new(listener.accept().unwrap().0);
            let (mut first, mut line) = (String::new(), String::new());
            stream.read_line(&mut first).unwrap();
            while stream.read_line(&mut line).unwrap() > 2 {
                line.clear();
            }
            let answer = format!("HTTP/1.1 {status}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n");
            stream.get_mut().write_all(answer.as_bytes()).unwrap();
            first.trim_end().to_owned()
        });
        (Client::new(Server { url, api_key: "mk_test".into(), database_url: None }), asked)
    }

    #[test]
    fn a_version_that_is_refused_is_removed() {
        for (status, expected) in
            [("204 No Content", "refused"), ("409 Conflict", "motion database walks@2 was left unfinished, ")]
        {
            let (client, asked) = answer(status);
            let refused = || -> anyhow::Result<()> { Err(anyhow!("refused")) };
            let error = or_removed(&client, "/v1/motion-databases/7", "motion database walks@2", refused);
            let message = format!("{:#}", error.unwrap_err());
            assert!(message.starts_with(expected) && message.ends_with("refused"), "{message}");
            assert_eq!(asked.join().unwrap(), "DELETE /v1/motion-databases/7 HTTP/1.1");
        }
    }

    #[test]
    fn ways_to_make_more_motion_are_read() {
        let read = |text: &str| text.split(',').map(str::parse).collect::<Result<Vec<Augmentation>, _>>();
        let asked = |text: &str| augment(&read(text).unwrap()).map(|augment| json!(augment));
        assert_eq!(asked("mirror,warp").unwrap(), json!({"mirror": true, "warps": [0.8, 1.25]}));
        assert_eq!(asked("warp=0.9").unwrap(), json!({"mirror": false, "warps": [0.9]}));
        for bad in ["mirrors", "warp=", "warp=fast", "warp=nan", "warp=inf", "warp=0", ""] {
            assert!(read(bad).is_err(), "{bad:?}");
        }
        for (bad, expected) in [
            ("mirror,mirror", "--augment has mirror twice"),
            ("warp=0.5,warp=0.5", "--augment has the speed 0.5 twice"),
            ("warp,warp=0.8", "--augment has the speed 0.8 twice"),
            ("warp=1", "--augment has warp=1, expected a speed of 0.25 to 4"),
            ("warp=1e308", "--augment has warp=1e308, expected"),
            (
                "warp=0.3,warp=0.4,warp=0.5,warp=0.6,warp=0.7,warp,warp=2,warp=3",
                "--augment: augment.warps has 9 speeds",
            ),
        ] {
            let message = asked(bad).unwrap_err().to_string();
            assert!(message.starts_with(expected), "{message}");
        }
    }
}
