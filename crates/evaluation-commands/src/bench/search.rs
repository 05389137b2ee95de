//! `marey bench search`: exact search beside fast, on motion of people that are not in the database.

mod pass;
mod questions;

use std::{collections::HashSet, fs, io::BufWriter, path::PathBuf, time::Instant};

use anyhow::{Context, bail};
use clap::ValueEnum;
use client::outputs;
use library::AllCores;
use motion_db::{Augment, Clip, IndexFile, MotionDatabase, write_index};
use serde::Serialize;

use crate::motions;
use pass::{Measured, Search, Truth, measure};
use questions::Run;

/// Time searches for the nearest windows in a database, and count what they find
///
/// The database is built from the training folders and written to an index file, which is mapped into memory and searched by
/// one thread: for every frame of the query folders' motion the nearest windows, by looking at all of them and by the fast
/// search. Performers of the query folders are left out of the database.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
exact, cold       every window considered
exact, tracking   the same, the successors of the last frame's matches first
fast, cold        windows near the query
fast, tracking    from the last frame's matches along the neighbour graph
recall            share of the exact search's windows that were found

Examples:
  marey bench search --train recordings/ --query more/
  marey bench search --train recordings/ --query more/ --augment mirror,warp --json search.json")]
pub struct Args {
    /// Folders of motion for the database: ASF+AMC or BVH, also .zst
    #[arg(long, required = true, num_args = 1.., value_name = "DIR")]
    train: Vec<PathBuf>,
    /// Folders of motion to search for; its performers are left out of the database
    #[arg(long, required = true, num_args = 1.., value_name = "DIR")]
    query: Vec<PathBuf>,
    /// More motion for the database: left and right exchanged, 0.8 and 1.25 times as fast
    #[arg(long, value_enum, value_delimiter = ',', value_name = "WHAT")]
    augment: Vec<More>,
    /// Length of the windows m, frames at 60 a second
    #[arg(long, default_value_t = 2, value_name = "FRAMES", value_parser = clap::value_parser!(u8).range(1..=16))]
    window: u8,
    /// Number of nearest windows K
    #[arg(long, default_value_t = 64, value_name = "K")]
    neighbours: usize,
    /// Frames of each trial to search for, from its middle
    #[arg(long, default_value_t = 60)]
    frames: usize,
    /// Keep the index file here; overwritten if it exists
    #[arg(long, value_name = "FILE")]
    index: Option<PathBuf>,
    /// Write the numbers to this file; overwritten if it exists
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum More {
    Mirror,
    Warp,
}

#[derive(Debug, Serialize)]
struct Report {
    windows: usize,
    poses: usize,
    window_frames: usize,
    width: usize,
    neighbours: usize,
    query_performers: Vec<String>,
    /// clips to a database in memory, seconds
    read_and_resample_s: f64,
    /// that to a whole index file, all cores, seconds
    build_s: f64,
    index_bytes: u64,
    /// mapping and opening the file, seconds
    open_s: f64,
    /// every checksum of the file, seconds
    verify_s: f64,
    /// most memory resident while it was built, bytes; 0 where the system does not tell
    build_peak_bytes: u64,
    /// most memory resident at all, bytes
    peak_bytes: u64,
    exact_cold: Measured,
    exact_tracking: Measured,
    fast_cold: Measured,
    fast_tracking: Measured,
}

/// That what is written replaces nothing that is read.
fn check(args: &Args) -> anyhow::Result<()> {
    let (train, query) = (motions::files(&args.train)?, motions::files(&args.query)?);
    let train = train.iter().map(|path| ("a file of --train", Some(path)));
    let inputs: Vec<_> = train.chain(query.iter().map(|path| ("a file of --query", Some(path)))).collect();
    outputs::check(&inputs, &[("--index", args.index.as_ref()), ("--json", args.json.as_ref())])
}

/// Runs `marey bench search`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    check(args)?;
    let queries = motions::read(&args.query)?;
    let performers: HashSet<&str> = queries.iter().map(|c| c.subject.as_str()).collect();
    let begin = Instant::now();
    let database = database(args, &performers)?;
    let read_and_resample_s = begin.elapsed().as_secs_f64();
    let poses = database.num_poses();

    let temporary = tempfile::tempdir()?;
    let path = args.index.clone().unwrap_or_else(|| temporary.path().join("index.mdb"));
    let begin = Instant::now();
    let file = fs::File::create(&path).with_context(|| format!("cannot write {}", path.display()))?;
    let index_bytes = write_index(&database, Some(args.window.into()), &AllCores, &mut BufWriter::new(file))?;
    let build_s = begin.elapsed().as_secs_f64();
    drop(database);
    let build_peak_bytes = peak_bytes();

    let begin = Instant::now();
    let mapped = mapped_file::map(&path).with_context(|| format!("cannot map {}", path.display()))?;
    let opened = IndexFile::open(mapped)?;
    let open_s = begin.elapsed().as_secs_f64();
    let begin = Instant::now();
    opened.verify()?;
    let verify_s = begin.elapsed().as_secs_f64();
    let Some(index) = opened.windows() else { bail!("the index file has no windows") };

    let runs = queries.iter().filter_map(|clip| Run::from_clip(clip, opened.database(), index, args.frames));
    let runs: Vec<Run> = runs.collect();
    let mut query_performers: Vec<String> = performers.iter().map(|s| (*s).to_owned()).collect();
    query_performers.sort_unstable();
    let mut truth = Truth::new();
    let mut pass = |search| measure(index, &runs, args.neighbours, search, &mut truth);
    let report = Report {
        windows: index.num_rows(),
        poses,
        window_frames: index.window(),
        width: index.width(),
        neighbours: args.neighbours,
        query_performers,
        read_and_resample_s,
        build_s,
        index_bytes,
        open_s,
        verify_s,
        build_peak_bytes,
        exact_cold: pass(Search::ExactCold),
        exact_tracking: pass(Search::ExactTracking),
        fast_cold: pass(Search::FastCold),
        fast_tracking: pass(Search::FastTracking),
        peak_bytes: peak_bytes(),
    };
    print(&report);
    if let Some(path) = &args.json {
        fs::write(path, serde_json::to_vec_pretty(&report)?)
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}

/// The database of the training folders, without the performers that ask.
fn database(args: &Args, performers: &HashSet<&str>) -> anyhow::Result<MotionDatabase> {
    let augment = Augment {
        mirror: args.augment.contains(&More::Mirror),
        speeds: if args.augment.contains(&More::Warp) { Augment::warps() } else { Vec::new() },
    };
    let mut clips: Vec<Clip> = motions::read(&args.train)?;
    clips.retain(|clip| !performers.contains(clip.subject.as_str()));
    if clips.is_empty() {
        bail!(
            "all performers of the training folders are in the query folders too, so nobody is left to learn from"
        );
    }
    let recorded = MotionDatabase::build(&clips)?;
    if augment == Augment::default() {
        return Ok(recorded);
    }
    let mut database = recorded.emptied();
    drop(recorded);
    for clip in clips {
        for variant in augment.clips(&clip)? {
            database.append(&variant)?;
        }
    }
    Ok(database)
}

/// Most memory that was resident, bytes, as Linux counts it (pages of the mapped file that were touched among them).
fn peak_bytes() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<u64>().ok());
    kilobytes.unwrap_or(0) * 1024
}

fn print(report: &Report) {
    let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    println!(
        "{} windows of {} frames, {} numbers each; {} neighbours; queries of performers {}",
        report.windows,
        report.window_frames,
        report.width,
        report.neighbours,
        report.query_performers.join(", ")
    );
    println!(
        "motion read in {:.1} s, index built in {:.1} s: {:.0} MiB; opened in {:.1} ms, verified in {:.2} s",
        report.read_and_resample_s,
        report.build_s,
        mib(report.index_bytes),
        1e3 * report.open_s,
        report.verify_s
    );
    println!(
        "most memory resident: {:.0} MiB until built, {:.0} MiB in all",
        mib(report.build_peak_bytes),
        mib(report.peak_bytes)
    );
    println!("\nsearch            queries  median ms  mean ms   p99 ms   recall  worst run  tracked");
    let rows = [
        ("exact, cold", &report.exact_cold),
        ("exact, tracking", &report.exact_tracking),
        ("fast, cold", &report.fast_cold),
        ("fast, tracking", &report.fast_tracking),
    ];
    for (name, m) in rows {
        println!(
            "{name:<16} {:>8} {:>10.3} {:>8.3} {:>8.3} {:>8.4} {:>10.4} {:>8.2}",
            m.queries, m.median_ms, m.mean_ms, m.p99_ms, m.recall, m.worst_run_recall, m.tracked
        );
    }
}
