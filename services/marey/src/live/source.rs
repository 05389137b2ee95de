//! Where the frames of `marey live` come from.

use std::{io::BufRead, path::Path};

use anyhow::{Context, bail, ensure};
use formats::PointsOptions;
use model::PointTrajectories;
use nalgebra::Vector3;
use tokio::sync::mpsc;

/// Frames a second that a server takes.
const FRAME_RATE: f64 = 60.0;
/// Lines that are read before they can be sent.
const LINES_AHEAD: usize = 4;

/// A file, or lines that come in.
pub enum Source {
    /// read whole, at a multiple of 60 frames a second
    File {
        names: Vec<String>,
        columns: Vec<usize>,
        trajectories: PointTrajectories,
        next: usize,
        step: usize,
    },
    /// lines of a .csv, a frame each; `columns` are those of each point's x
    Lines {
        names: Vec<String>,
        columns: Vec<usize>,
        width: usize,
        lines: mpsc::Receiver<std::io::Result<String>>,
    },
}

impl Source {
    /// Opens a file, or standard input for `-`; `chosen`: the points to use, all if empty.
    pub fn open(path: &Path, chosen: &[String]) -> anyhow::Result<Self> {
        if path == Path::new("-") {
            return Self::of_stdin(chosen);
        }
        let name = || path.display().to_string();
        let bytes = std::fs::read(path).with_context(name)?;
        let options = PointsOptions::default();
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        let read = match extension.as_str() {
            "csv" => formats::points_csv::read_with(&bytes, &options),
            "trc" => formats::trc::read(&bytes, &options),
            "c3d" => formats::c3d::read(&bytes, &options),
            _ => bail!("{} is no .csv, .trc or .c3d file", name()),
        };
        let trajectories = read.with_context(name)?.value;
        let ratio = trajectories.frame_rate() / FRAME_RATE;
        let step = ratio.round();
        ensure!(
            step >= 1.0 && (ratio - step).abs() < 0.01 * step,
            "{} has {} frames a second, expected 60 or a multiple of it",
            name(),
            trajectories.frame_rate()
        );
        let names = if chosen.is_empty() { trajectories.names().to_vec() } else { chosen.to_vec() };
        let column = |n: &String| {
            trajectories.point_index(n).with_context(|| format!("{} has no point {n:?}", name()))
        };
        let columns = names.iter().map(column).collect::<anyhow::Result<_>>()?;
        Ok(Self::File { names, columns, trajectories, next: 0, step: step as usize })
    }

    fn of_stdin(chosen: &[String]) -> anyhow::Result<Self> {
        let mut header = String::new();
        std::io::stdin().read_line(&mut header)?;
        let titles: Vec<&str> = header.trim().split(',').map(str::trim).collect();
        let points =
            titles.iter().enumerate().filter_map(|(i, t)| Some((t.strip_suffix("_x")?.to_owned(), i)));
        let points: Vec<(String, usize)> = points.collect();
        let names: Vec<String> =
            if chosen.is_empty() { points.iter().map(|(n, _)| n.clone()).collect() } else { chosen.to_vec() };
        let column = |name: &String| {
            let found = points.iter().find(|(n, _)| n == name).map(|(_, at)| *at);
            let at = found.with_context(|| format!("the first line has no {name}_x"))?;
            let follows =
                |i: usize, axis: &str| titles.get(at + i).is_some_and(|t| *t == format!("{name}_{axis}"));
            ensure!(
                follows(1, "y") && follows(2, "z"),
                "the first line has {name}_x without {name}_y,{name}_z after it"
            );
            Ok(at)
        };
        let columns = names.iter().map(column).collect::<anyhow::Result<_>>()?;
        let width = titles.len();
        let (line_read, lines) = mpsc::channel(LINES_AHEAD);
        // Reading may block for ever: the thread ends with the program.
        std::thread::spawn(move || {
            for line in std::io::stdin().lock().lines() {
                if line_read.blocking_send(line).is_err() {
                    return;
                }
            }
        });
        Ok(Self::Lines { names, columns, width, lines })
    }

    /// Names of the points.
    pub fn names(&self) -> &[String] {
        match self {
            Self::File { names, .. } | Self::Lines { names, .. } => names,
        }
    }

    /// Whether frames are there before their time.
    pub fn is_file(&self) -> bool {
        matches!(self, Self::File { .. })
    }

    /// Positions of the next frame's points, metres, NaN where not measured; `None` at the end.
    pub async fn next(&mut self) -> anyhow::Result<Option<Vec<Vector3<f64>>>> {
        match self {
            Self::File { columns, trajectories, next, step, .. } => {
                if *next >= trajectories.num_frames() {
                    return Ok(None);
                }
                let frame = trajectories.frame(*next);
                *next += *step;
                Ok(Some(columns.iter().map(|c| frame[*c]).collect()))
            }
            Self::Lines { columns, width, lines, .. } => {
                let Some(line) = lines.recv().await.transpose()? else { return Ok(None) };
                let cells: Vec<&str> = line.trim().split(',').map(str::trim).collect();
                ensure!(cells.len() == *width, "a line has {} cells, the first one has {width}", cells.len());
                let number = |at: usize| match cells[at] {
                    "" => Ok(f64::NAN),
                    text => text.parse::<f64>().with_context(|| format!("{text:?} is no number")),
                };
                let point = |at: &usize| Ok(Vector3::new(number(*at)?, number(at + 1)?, number(at + 2)?));
                Ok(Some(columns.iter().map(point).collect::<anyhow::Result<_>>()?))
            }
        }
    }
}
