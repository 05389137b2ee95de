//! `marey live`: points as they are measured go to the server, poses come back.

mod connection;
mod source;

use std::{
    fs,
    io::{BufWriter, Write},
    path::PathBuf,
    time::{Duration, Instant},
};

use anyhow::{Context, bail};
use base64::{Engine, prelude::BASE64_STANDARD};
use serde_json::{Value, json};
use tokio::time::MissedTickBehavior;

use crate::{cli::ServerArgs, serve::runtime};
pub use connection::{Connection, Sender, frame_message};
use source::Source;

/// Follow a performer live
///
/// Streams measured points to a server at 60 frames a second, as a motion capture system would, and writes the poses that
/// come back. A file (.csv, .trc, .c3d) is played in real time; with '-', lines of such a .csv are sent as they come in.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  marey live points.csv --database walks --skeleton performer.asf -o poses.csv
  capture-program | marey live - --database walks > poses.csv
  marey live points.csv --database walks --state-file performer.state     go on where it ended last time")]
pub struct Args {
    /// Measured points: .csv (time,left_wrist_x,…; metres, y up), .trc or .c3d; '-' reads lines of a .csv
    points: PathBuf,
    /// Motion database to learn from: NAME (its latest version) or NAME@VERSION
    #[arg(long, short)]
    database: String,
    /// The performer's skeleton, .asf [default: the database's]
    #[arg(long)]
    skeleton: Option<PathBuf>,
    /// Control points to use, separated by commas [default: all in the file]
    #[arg(long = "use", value_delimiter = ',', value_name = "POINTS")]
    chosen: Vec<String>,
    /// Where the poses go, as CSV: frame, then a column for each degree of freedom, metres and radians [default: the terminal]
    #[arg(long, short)]
    output: Option<PathBuf>,
    /// Compute every frame, however late, instead of dropping what can't be computed in time
    #[arg(long)]
    every: bool,
    /// Go on from the state in this file, if it is there, and keep the last one in it
    #[arg(long, value_name = "FILE")]
    state_file: Option<PathBuf>,
    /// Parameter of the method: NAME=VALUE; may be given often
    #[arg(long = "set", value_name = "NAME=VALUE")]
    parameters: Vec<String>,
    #[command(flatten)]
    server: ServerArgs,
}

/// Runs `marey live`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let source = Source::open(&args.points, &args.chosen)?;
    let start = start(args, source.names())?;
    let server = args.server.server()?;
    runtime()?.block_on(async {
        let connection = Connection::open(&server, &args.database, &start).await?;
        follow(args, source, connection).await
    })
}

fn start(args: &Args, points: &[String]) -> anyhow::Result<Value> {
    let mut start = json!({ "type": "start", "points": points });
    if args.every {
        start["delivery"] = "every".into();
    }
    if let Some(path) = &args.skeleton {
        start["skeleton_asf"] = fs::read_to_string(path).with_context(|| path.display().to_string())?.into();
    }
    start["parameters"] = values(&args.parameters)?;
    if let Some(path) = args.state_file.as_ref().filter(|path| path.exists()) {
        let state = fs::read(path).with_context(|| path.display().to_string())?;
        start["state"] = BASE64_STANDARD.encode(state).into();
    }
    Ok(start)
}

/// `NAME=VALUE` options as parameters: numbers and true where they read as such, else words.
pub fn values(options: &[String]) -> anyhow::Result<Value> {
    crate::run::pairs(options, |v| serde_json::from_str(v).unwrap_or_else(|_| v.into()))
}

async fn follow(args: &Args, source: Source, connection: Connection) -> anyhow::Result<()> {
    let Connection { sender, mut receiver, started } = connection;
    let mut output: Box<dyn Write> = match &args.output {
        Some(path) => Box::new(fs::File::create(path).with_context(|| path.display().to_string())?),
        None => Box::new(std::io::stdout()),
    };
    let mut output = BufWriter::new(&mut output);
    let dofs = started["dofs"].as_array().into_iter().flatten().filter_map(Value::as_str);
    writeln!(output, "frame,{}", dofs.collect::<Vec<_>>().join(","))?;
    let begin = Instant::now();
    let sending = tokio::spawn(send(source, sender, begin));
    let mut latencies = Vec::new();
    let mut dropped = 0;
    let end = loop {
        let Some(message) = receiver.next().await? else { break Ok(()) };
        match message["type"].as_str() {
            Some("pose") => {
                let sent = message["time"].as_f64().unwrap_or_default();
                latencies.push(begin.elapsed().as_secs_f64() - sent);
                dropped = message["dropped"].as_u64().unwrap_or(dropped);
                let numbers = message["pose"].as_array().into_iter().flatten();
                let row: String = numbers.map(|v| format!(",{v}")).collect();
                writeln!(output, "{}{row}", message["frame"])?;
                output.flush()?;
            }
            Some("state") => keep_state(args, &message)?,
            Some("error") => break Err(message["message"].as_str().unwrap_or("an error").to_owned()),
            _ => {}
        }
    };
    output.flush()?;
    if let Err(message) = end {
        bail!("the server ended the stream: {message}");
    }
    let frames = sending.await??;
    eprintln!("{}", Latency::of(latencies, frames, dropped));
    Ok(())
}

fn keep_state(args: &Args, message: &Value) -> anyhow::Result<()> {
    let Some(path) = &args.state_file else { return Ok(()) };
    let state = message["state"].as_str().unwrap_or_default();
    let state = BASE64_STANDARD.decode(state).context("the server's state is not base64")?;
    fs::write(path, state).with_context(|| path.display().to_string())
}

/// Sends frames: a file's at 60 a second, those of standard input as they come. How many it were.
async fn send(mut source: Source, mut sender: Sender, begin: Instant) -> anyhow::Result<u64> {
    let mut clock = tokio::time::interval(Duration::from_secs_f64(1.0 / 60.0));
    clock.set_missed_tick_behavior(MissedTickBehavior::Burst);
    let mut frame = 0;
    loop {
        if source.is_file() {
            clock.tick().await;
        }
        let Some(points) = source.next().await? else { break };
        frame += 1;
        let message = frame_message(frame, begin.elapsed().as_secs_f64(), points.samples());
        if sender.send(message).await.is_err() {
            // The server has ended the stream and says why on the other side.
            return Ok(frame);
        }
    }
    sender.send(json!({ "type": "end" }).to_string()).await?;
    Ok(frame)
}

/// How long poses took, from sending the frame to having the pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Latency {
    /// frames sent
    pub frames: u64,
    /// frames without a pose, as the server counted them
    pub dropped: u64,
    /// sorted, seconds
    sorted: Vec<f64>,
}

impl Latency {
    /// Of poses that took so many seconds.
    pub fn of(mut seconds: Vec<f64>, frames: u64, dropped: u64) -> Self {
        seconds.sort_by(f64::total_cmp);
        Self { frames, dropped, sorted: seconds }
    }

    /// The time, in milliseconds, within which this share of the poses came.
    pub fn quantile_ms(&self, share: f64) -> f64 {
        let last = self.sorted.len().saturating_sub(1);
        let at = ((self.sorted.len() as f64 * share).ceil() as usize).saturating_sub(1).min(last);
        self.sorted.get(at).map_or(f64::NAN, |seconds| seconds * 1000.0)
    }
}

impl std::fmt::Display for Latency {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} frames, {} poses, {} dropped; latency p50 {:.2} ms, p95 {:.2} ms, p99 {:.2} ms, max {:.2} ms",
            self.frames,
            self.sorted.len(),
            self.dropped,
            self.quantile_ms(0.5),
            self.quantile_ms(0.95),
            self.quantile_ms(0.99),
            self.quantile_ms(1.0),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_nearest_rank() {
        let latency = Latency::of((1..=200).rev().map(|i| f64::from(i) / 1000.0).collect(), 200, 0);
        for (share, expected) in [(0.5, 100.0), (0.95, 190.0), (0.99, 198.0), (1.0, 200.0)] {
            assert!((latency.quantile_ms(share) - expected).abs() < 1e-9);
        }
        assert!(Latency::of(vec![], 0, 0).quantile_ms(0.5).is_nan());
    }
}
