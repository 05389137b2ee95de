//! `marey live`: points as they are measured go to the server, poses come back.

mod pace;
mod rate;
mod source;

use std::{
    fs,
    io::{BufWriter, Write},
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use anyhow::{Context, anyhow, ensure};
use base64::{Engine, prelude::BASE64_STANDARD};
use serde_json::{Value, json};
use tokio::time::{Interval, MissedTickBehavior, timeout_at};
use tokio_util::sync::CancellationToken;

use client::{
    Latency, Request, Server, ServerArgs,
    live::{Connection, Lost, Sender, frame_message},
    outputs,
    parameters::values,
};

use model::counted;

use crate::{serve::runtime, words::name};
use source::{Measured, Source};

/// After a connection was lost: from the first attempt to the next one, doubled up to the longest wait.
const FIRST_WAIT: Duration = Duration::from_millis(200);
const LONGEST_WAIT: Duration = Duration::from_secs(5);
/// How long a lost connection is tried again.
const PATIENCE: Duration = Duration::from_secs(60);

/// Follow a performer live
///
/// Streams measured points to a server at 60 frames a second, as a motion capture system would, and writes the poses that
/// come back. A file (.csv, .trc, .c3d) is played in real time. With '-', lines of such a .csv are read from standard input, 60
/// a second or a multiple: each is sent as it comes in, but not before its time, so that a file may be piped in as well. A
/// lost connection is opened again, for up to a minute, and goes on from the last state.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  marey live points.csv --database walks --skeleton skeleton.asf -o poses.csv
  cat points.csv | marey live - --database walks > poses.csv
  marey live points.csv --database walks --state-file performer.state   # goes on from there")]
pub struct Args {
    /// Measured points: a .csv (time,left_wrist_x,…; seconds and metres, y up), .trc or .c3d file, or '-' for lines of a .csv
    points: PathBuf,
    /// Motion database to learn from: NAME (its latest version) or NAME@VERSION
    #[arg(long, short)]
    database: String,
    /// The performer's skeleton, .asf [default: the database's]
    #[arg(long)]
    skeleton: Option<PathBuf>,
    /// Control points to use, separated by commas [default: all in the file]
    #[arg(long = "points", visible_alias = "use", value_delimiter = ',', value_parser = name, value_name = "NAMES")]
    chosen: Vec<String>,
    /// File for the poses, as CSV: frame, then a column for each degree of freedom, metres and radians; overwritten if it exists
    /// [default: the terminal]
    #[arg(long, short, visible_alias = "output", value_name = "FILE")]
    out: Option<PathBuf>,
    /// Compute every frame, however late, instead of dropping those that can't be computed in time
    #[arg(long)]
    every: bool,
    /// Go on from the state in this file, if it exists, and keep the last state in it
    #[arg(long, value_name = "FILE")]
    state_file: Option<PathBuf>,
    /// Parameter of the method; may be given several times
    #[arg(long = "set", value_name = "NAME=VALUE")]
    parameters: Vec<String>,
    #[command(flatten)]
    server: ServerArgs,
}

/// Runs `marey live`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    check_outputs(args)?;
    let source = Source::open(&args.points, &args.chosen)?;
    let start = start(args, source.names())?;
    let server = args.server.server()?;
    runtime()?.block_on(follow(args, &server, source, &start))
}

/// That the poses and the state replace neither what is read nor each other.
fn check_outputs(args: &Args) -> anyhow::Result<()> {
    let points = Some(&args.points).filter(|path| path.as_path() != Path::new("-"));
    outputs::check(
        &[("the file of points", points), ("--skeleton", args.skeleton.as_ref())],
        &[("--out", args.out.as_ref()), ("--state-file", args.state_file.as_ref())],
    )
}

/// What the stream is to be, as options say it.
fn start(args: &Args, points: &[String]) -> anyhow::Result<Request> {
    let skeleton = args
        .skeleton
        .as_ref()
        .map(|path| fs::read_to_string(path).with_context(|| path.display().to_string()));
    let state = args.state_file.as_ref().filter(|path| path.exists()).map(|path| {
        let state = fs::read(path).with_context(|| path.display().to_string())?;
        ensure!(!state.is_empty(), "{} is empty, expected a live state", path.display());
        Ok(BASE64_STANDARD.encode(state))
    });
    Ok(Request::default()
        .with("points", "--points", Some(points))
        .with("delivery", "--every", args.every.then_some("every"))
        .with("skeleton_asf", "--skeleton", skeleton.transpose()?)
        .with("parameters", "--set", Some(values(&args.parameters)?))
        .with("state", "--state-file", state.transpose()?))
}

/// Follows the performer to the end of the frames, over as many connections as it takes.
async fn follow(args: &Args, server: &Server, source: Source, asked: &Request) -> anyhow::Result<()> {
    let mut start = asked.to_json();
    start["type"] = "start".into();
    let opened = Connection::open(server, &args.database, &start).await;
    let mut connection = opened.map_err(|error| with_state_file(args, in_options(asked, error)))?;
    // The state is of this version, whatever gets the name meanwhile.
    let database = connection.started["motion_database"].as_str().unwrap_or(&args.database).to_owned();
    let begin = Instant::now();
    let mut answers = Answers::new(args, &connection.started, begin)?;
    let mut feed = Feed::new(source, begin);
    loop {
        let Connection { sender, mut receiver, .. } = connection;
        let over = CancellationToken::new();
        let mut sending = tokio::spawn(send(feed, sender, over.clone()));
        let mut sent = None;
        let end = loop {
            tokio::select! {
                answer = receiver.next() => match answer {
                    Ok(Some(message)) => answers.take(&message)?,
                    Ok(None) => break receiver.end(),
                    Err(error) => break Err(error),
                },
                // An error of the input ends everything.
                result = &mut sending, if sent.is_none() => sent = Some(result??),
            }
        };
        over.cancel();
        feed = match sent {
            Some(feed) => feed,
            None => sending.await??,
        };
        match end {
            Ok(()) => break,
            Err(error) if error.is::<Lost>() => {
                eprintln!("marey: {error:#}; connecting again for up to {} s", PATIENCE.as_secs());
            }
            Err(error) => return Err(error.context("the server ended the stream")),
        }
        answers.forget_unanswered(feed.frame);
        if let Some(state) = &answers.state {
            start["state"] = state.as_str().into();
        }
        connection = reopen(server, &database, &start).await?;
        feed.clock.reset();
        let from = if start["state"].is_null() { "anew" } else { "from the last state" };
        eprintln!("marey: connected again; going on {from} with frame {}", feed.frame + 1);
    }
    feed.check()?;
    eprintln!("{}", Latency::from_seconds(answers.latencies, feed.frame, answers.dropped));
    Ok(())
}

/// Opens a connection in place of one that was lost.
async fn reopen(server: &Server, database: &str, start: &Value) -> anyhow::Result<Connection> {
    let deadline = Instant::now() + PATIENCE;
    let mut wait = FIRST_WAIT;
    loop {
        tokio::time::sleep(wait).await;
        let why = match timeout_at(deadline.into(), Connection::open(server, database, start)).await {
            Ok(Ok(connection)) => return Ok(connection),
            Ok(Err(error)) if error.is::<Lost>() => error,
            Ok(Err(error)) => return Err(error),
            Err(_) => anyhow!("{} does not answer", server.url),
        };
        wait = (wait * 2).min(LONGEST_WAIT);
        if Instant::now() + wait >= deadline {
            let seconds = PATIENCE.as_secs();
            return Err(why.context(format!("the connection was lost and did not come back in {seconds} s")));
        }
    }
}

/// A refusal of what was asked for, in the words of the options; a connection that was lost stays one.
fn in_options(asked: &Request, error: anyhow::Error) -> anyhow::Error {
    if error.is::<Lost>() { error } else { anyhow!(asked.in_options(&format!("{error:#}"))) }
}

/// Says which file it is, if the state in it is what the server refuses.
fn with_state_file(args: &Args, error: anyhow::Error) -> anyhow::Error {
    match &args.state_file {
        Some(path) if format!("{error:#}").contains("live state") => {
            error.context(path.display().to_string())
        }
        _ => error,
    }
}

/// What has come back.
struct Answers<'a> {
    state_file: Option<&'a Path>,
    output: BufWriter<Box<dyn Write>>,
    begin: Instant,
    /// the last state, base64
    state: Option<String>,
    /// of each pose, seconds
    latencies: Vec<f64>,
    /// frames without a pose
    dropped: u64,
    /// those of them that were sent on earlier connections
    dropped_before: u64,
}

impl<'a> Answers<'a> {
    fn new(args: &'a Args, started: &Value, begin: Instant) -> anyhow::Result<Self> {
        let output: Box<dyn Write> = match &args.out {
            Some(path) => Box::new(fs::File::create(path).with_context(|| path.display().to_string())?),
            None => Box::new(std::io::stdout()),
        };
        let mut output = BufWriter::new(output);
        let dofs = started["dofs"].as_array().into_iter().flatten().filter_map(Value::as_str);
        writeln!(output, "frame,{}", dofs.collect::<Vec<_>>().join(","))?;
        output.flush()?;
        Ok(Self {
            state_file: args.state_file.as_deref(),
            output,
            begin,
            state: None,
            latencies: Vec::new(),
            dropped: 0,
            dropped_before: 0,
        })
    }

    /// Writes a pose, keeps a state.
    fn take(&mut self, message: &Value) -> anyhow::Result<()> {
        match message["type"].as_str() {
            Some("pose") => {
                let sent = message["time"].as_f64().unwrap_or_default();
                self.latencies.push(self.begin.elapsed().as_secs_f64() - sent);
                if let Some(dropped) = message["dropped"].as_u64() {
                    self.dropped = self.dropped_before + dropped;
                }
                let numbers = message["pose"].as_array().into_iter().flatten();
                let row: String = numbers.map(|v| format!(",{v}")).collect();
                writeln!(self.output, "{}{row}", message["frame"])?;
                self.output.flush()?;
            }
            Some("state") => {
                let text = message["state"].as_str().unwrap_or_default();
                if let Some(path) = self.state_file {
                    let state = BASE64_STANDARD.decode(text).context("the server's state is not base64")?;
                    replace_file(path, &state)?;
                }
                self.state = Some(text.to_owned());
            }
            _ => {}
        }
        Ok(())
    }

    /// The connection is gone: of `sent` frames, those without a pose get none.
    fn forget_unanswered(&mut self, sent: u64) {
        self.dropped_before = sent.saturating_sub(self.latencies.len() as u64);
        self.dropped = self.dropped_before;
    }
}

/// Writes a file beside it first, so that there always is a whole one.
fn replace_file(path: &Path, content: &[u8]) -> anyhow::Result<()> {
    let mut part = path.as_os_str().to_owned();
    part.push(".part");
    fs::write(&part, content).with_context(|| Path::new(&part).display().to_string())?;
    fs::rename(&part, path).with_context(|| path.display().to_string())
}

/// What is sent: a file's frames at 60 a second, those of standard input when they are due.
struct Feed {
    source: Source,
    clock: Interval,
    /// number of the last frame sent
    frame: u64,
    /// whether a point was measured in any of them
    has_measured: bool,
    begin: Instant,
}

impl Feed {
    fn new(source: Source, begin: Instant) -> Self {
        let mut clock = tokio::time::interval(Duration::from_secs_f64(1.0 / 60.0));
        clock.set_missed_tick_behavior(MissedTickBehavior::Burst);
        Self { source, clock, frame: 0, has_measured: false, begin }
    }

    /// That there was something to follow.
    ///
    /// # Errors
    /// If there was no frame, or no point in any.
    fn check(&self) -> anyhow::Result<()> {
        ensure!(self.frame > 0, "the points have no frame, expected at least one after the names");
        ensure!(self.has_measured, "no point was measured in any of {}", counted(self.frame, "frame"));
        Ok(())
    }

    /// The next frame, counted.
    async fn next(&mut self) -> anyhow::Result<Option<Measured>> {
        let next = self.source.next().await?;
        if let Some(measured) = &next {
            self.frame += 1;
            self.has_measured |= measured.has_point();
        }
        Ok(next)
    }

    /// Sends frames until there are no more, or nobody takes them: the other side says why.
    async fn send(&mut self, sender: &mut Sender) -> anyhow::Result<()> {
        loop {
            if self.source.is_file() {
                self.clock.tick().await;
            }
            let Some(measured) = self.next().await? else { break };
            let time = self.begin.elapsed().as_secs_f64();
            if sender.send(frame_message(self.frame, time, measured.samples())).await.is_err() {
                return Ok(());
            }
        }
        // As above.
        let _ = sender.send(json!({ "type": "end" }).to_string()).await;
        Ok(())
    }
}

/// Sends frames until the stream is `over`; what is left is for the next one.
async fn send(mut feed: Feed, mut sender: Sender, over: CancellationToken) -> anyhow::Result<Feed> {
    tokio::select! {
        () = over.cancelled() => {}
        sent = feed.send(&mut sender) => sent?,
    }
    Ok(feed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::alone::Alone;
    use clap::Parser;
    use futures::{SinkExt, StreamExt};
    use tokio_tungstenite::tungstenite::{
        Message,
        protocol::{CloseFrame, frame::coding::CloseCode},
    };

    #[test]
    fn what_is_written_replaces_nothing_that_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).display().to_string();
        for name in ["p.csv", "sk.asf"] {
            fs::write(folder.path().join(name), "x").unwrap();
        }
        let check = |output: &str, state: &str| {
            let (points, skeleton) = (path("p.csv"), path("sk.asf"));
            let (output, state) = (path(output), path(state));
            let words = ["live", &points, "-d", "walks", "--skeleton", &skeleton];
            let words = words.into_iter().chain(["-o", &output, "--state-file", &state]);
            check_outputs(&Alone::<Args>::parse_from(words).args).map_err(|error| error.to_string())
        };
        assert_eq!(check("poses.csv", "p.state"), Ok(()));
        for (output, state, expected) in [
            ("p.csv", "p.state", "the file of points and --out are both"),
            ("sk.asf", "p.state", "--skeleton and --out are both"),
            ("poses.csv", "sk.asf", "--skeleton and --state-file are both"),
            ("new", "new", "--out and --state-file are both"),
        ] {
            let message = check(output, state).unwrap_err();
            assert!(message.starts_with(expected), "{message}");
        }
    }

    #[test]
    fn a_state_file_is_replaced_as_a_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("performer.state");
        for content in [&b"first"[..], b"2nd"] {
            replace_file(&path, content).unwrap();
            assert_eq!(fs::read(&path).unwrap(), content);
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        let missing = replace_file(&folder.path().join("none/performer.state"), b"").unwrap_err();
        assert!(format!("{missing:#}").contains("performer.state"));
    }

    #[tokio::test]
    async fn frames_without_a_point_are_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("points.csv");
        let rows = |x: &str| format!("time,head_x,head_y,head_z\n0.0,{x},1,0\n0.016666667,{x},1,0\n");
        for (x, expected) in [("1", ""), ("", "no point was measured in any of 2 frames")] {
            fs::write(&path, rows(x)).unwrap();
            let mut feed = Feed::new(Source::open(&path, &[]).unwrap(), Instant::now());
            assert!(feed.check().unwrap_err().to_string().contains("no frame"));
            while let Some(measured) = feed.next().await.unwrap() {
                assert_eq!(measured.has_point(), x == "1");
            }
            assert_eq!(feed.check().map_or_else(|error| error.to_string(), |()| String::new()), expected);
        }
    }

    #[tokio::test]
    async fn a_lost_connection_is_opened_again() {
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
        let url = format!("http://{}", listener.local_addr().unwrap());
        let serving = tokio::spawn(async move {
            // First it hangs up, then it has no room.
            drop(listener.accept().await.unwrap());
            let mut full = tokio_tungstenite::accept_async(listener.accept().await.unwrap().0).await.unwrap();
            full.next().await.unwrap().unwrap();
            full.close(Some(CloseFrame { code: CloseCode::Again, reason: "full".into() })).await.unwrap();
            let mut socket =
                tokio_tungstenite::accept_async(listener.accept().await.unwrap().0).await.unwrap();
            let start = socket.next().await.unwrap().unwrap().into_text().unwrap().as_str().to_owned();
            socket.send(Message::text(r#"{"type": "started"}"#)).await.unwrap();
            start
        });
        let server = Server { url, api_key: "mk_test".to_owned(), database_url: None };
        let start = json!({ "type": "start", "state": "TUFSRVlMVjE" });
        let connection = reopen(&server, "walks@2", &start).await.unwrap();
        assert_eq!(connection.started["type"], "started");
        assert_eq!(serving.await.unwrap(), start.to_string());
    }
}
