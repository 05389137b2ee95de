//! Where the frames of `marey live` come from.

use std::{io::BufRead, path::Path, time::Instant};

use anyhow::{Context, ensure};
use formats::session::{self, Options};
use model::{PointTrajectories, Samples, shown, shown_rate};
use nalgebra::Vector3;
use tokio::sync::mpsc;

use super::{pace::Pace, rate::Rate};

/// Lines that are read before they can be sent.
const LINES_AHEAD: usize = 4;

/// What was measured of the chosen points in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// metres, NaN where not measured
    positions: Vec<Vector3<f64>>,
    /// standard deviation of each coordinate, metres, NaN where unknown; empty where none is known
    sigmas: Vec<f64>,
}

impl Measured {
    /// Whether any of the points was measured.
    pub fn has_point(&self) -> bool {
        self.positions.iter().any(|position| position.iter().all(|coordinate| coordinate.is_finite()))
    }

    /// All of it.
    pub fn samples(&self) -> Samples<'_> {
        Samples { positions: &self.positions, sigmas: &self.sigmas }
    }
}

/// Where the numbers of a line are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Columns {
    names: Vec<String>,
    /// the column of the time, seconds, if there is one
    time: Option<usize>,
    /// the column of each point's x; y and z follow
    x: Vec<usize>,
    /// the column of each point's standard deviation, if it has one
    sigma: Vec<Option<usize>>,
    /// number of columns
    width: usize,
}

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
    /// lines of a .csv, a frame each, at the times that they say
    Lines {
        columns: Columns,
        rate: Rate,
        pace: Pace,
        /// read, but not due yet
        next: Option<(Instant, Measured)>,
        /// lines read, the header among them
        line_number: u64,
        lines: mpsc::Receiver<std::io::Result<String>>,
    },
}

impl Source {
    /// Opens a file, or standard input for `-`; `chosen`: the points to use, all if empty.
    pub fn open(path: &Path, chosen: &[String]) -> anyhow::Result<Self> {
        if path == Path::new("-") {
            return Self::from_stdin(chosen);
        }
        let name = || path.display().to_string();
        let bytes = std::fs::read(path).with_context(name)?;
        let trajectories =
            session::read_points(&name(), &bytes, &Options::default()).with_context(name)?.value;
        let ratio = trajectories.frame_rate() / motion_db::FRAME_RATE;
        let step = ratio.round();
        ensure!(
            step >= 1.0 && (ratio - step).abs() < 0.01 * step,
            "{} has {} frames a second, expected 60 or a multiple of it",
            name(),
            shown_rate(trajectories.frame_rate())
        );
        let names = if chosen.is_empty() { trajectories.names().to_vec() } else { chosen.to_vec() };
        let column = |n: &String| {
            trajectories.point_index(n).with_context(|| format!("{} has no point {n:?}", name()))
        };
        let columns = names.iter().map(column).collect::<anyhow::Result<_>>()?;
        Ok(Self::File { names, columns, trajectories, next: 0, step: step as usize })
    }

    fn from_stdin(chosen: &[String]) -> anyhow::Result<Self> {
        let mut line_number = 0;
        let mut header = String::new();
        while is_skipped(&header) {
            header.clear();
            line_number += 1;
            let read = std::io::stdin().read_line(&mut header).context("standard input")?;
            ensure!(read > 0, "standard input has no line, expected a header: time,left_wrist_x,…");
        }
        let columns = Columns::from_header(&header, chosen)?;
        let (line_read, lines) = mpsc::channel(LINES_AHEAD);
        // Reading may block for ever: the thread ends with the program.
        std::thread::spawn(move || {
            for line in std::io::stdin().lock().lines() {
                if line_read.blocking_send(line).is_err() {
                    return;
                }
            }
        });
        Ok(Self::lines(columns, line_number, lines))
    }

    fn lines(columns: Columns, line_number: u64, lines: mpsc::Receiver<std::io::Result<String>>) -> Self {
        Self::Lines { columns, rate: Rate::default(), pace: Pace::default(), next: None, line_number, lines }
    }

    /// Names of the points.
    pub fn names(&self) -> &[String] {
        match self {
            Self::File { names, .. } => names,
            Self::Lines { columns, .. } => &columns.names,
        }
    }

    /// Whether it is a file, whose frames are there before their time.
    pub fn is_file(&self) -> bool {
        matches!(self, Self::File { .. })
    }

    /// The next frame: of a file at once, of lines when it is due; `None` at the end. Nothing is lost when the waiting for it
    /// is given up.
    pub async fn next(&mut self) -> anyhow::Result<Option<Measured>> {
        match self {
            Self::File { columns, trajectories, next, step, .. } => {
                if *next >= trajectories.num_frames() {
                    return Ok(None);
                }
                let samples = trajectories.samples(*next);
                *next += *step;
                let positions = columns.iter().map(|c| samples.positions[*c]).collect();
                let sigma = |c: &usize| samples.sigma(*c).unwrap_or(f64::NAN);
                let sigmas =
                    if samples.sigmas.is_empty() { Vec::new() } else { columns.iter().map(sigma).collect() };
                Ok(Some(Measured { positions, sigmas }))
            }
            Self::Lines { columns, rate, pace, next, line_number, lines } => {
                while next.is_none() {
                    let (line, waited) = match lines.try_recv() {
                        Ok(line) => (Some(line), false),
                        Err(_) => (lines.recv().await, true),
                    };
                    let Some(line) = line else { return Ok(None) };
                    let line = line.context("standard input")?;
                    *line_number += 1;
                    if !is_skipped(&line) {
                        let at = || format!("line {line_number} of standard input");
                        let (seconds, measured) = columns.read(&line).with_context(at)?;
                        let (takes, warning) = rate.takes(seconds);
                        if let Some(warning) = warning {
                            eprintln!("warning: {warning}");
                        }
                        if takes {
                            *next = Some((pace.due(seconds, waited, Instant::now()), measured));
                        }
                    }
                }
                if let Some((due, _)) = next {
                    tokio::time::sleep_until((*due).into()).await;
                }
                Ok(next.take().map(|(_, measured)| measured))
            }
        }
    }
}

/// Whether a line is blank or a comment.
fn is_skipped(line: &str) -> bool {
    let line = line.trim();
    line.is_empty() || line.starts_with('#')
}

impl Columns {
    /// From the first line; `chosen`: the points to use, all if empty.
    fn from_header(header: &str, chosen: &[String]) -> anyhow::Result<Self> {
        let titles: Vec<&str> = header.trim().split(',').map(str::trim).collect();
        let with_x = titles.iter().filter_map(|title| title.strip_suffix("_x"));
        let names: Vec<String> =
            if chosen.is_empty() { with_x.map(str::to_owned).collect() } else { chosen.to_vec() };
        let column = |title: String| titles.iter().position(|t| *t == title);
        let x = |name: &String| {
            let at = column(format!("{name}_x"));
            let at = at.with_context(|| format!("the first line has no {name}_x"))?;
            let follows =
                |i: usize, axis: &str| titles.get(at + i).is_some_and(|t| *t == format!("{name}_{axis}"));
            ensure!(
                follows(1, "y") && follows(2, "z"),
                "the first line has {name}_x without {name}_y,{name}_z after it"
            );
            Ok(at)
        };
        let x = names.iter().map(x).collect::<anyhow::Result<_>>()?;
        let sigma = names.iter().map(|name| column(format!("{name}_sigma"))).collect();
        let time = column("time".to_owned());
        Ok(Self { time, x, sigma, width: titles.len(), names })
    }

    /// The time of a line, seconds, NaN without one, and its frame. An empty cell or a number that is not finite was not
    /// measured.
    fn read(&self, line: &str) -> anyhow::Result<(f64, Measured)> {
        let cells: Vec<&str> = line.trim().split(',').map(str::trim).collect();
        let width = self.width;
        ensure!(cells.len() == width, "{} cells, expected {width} as in the first line", cells.len());
        let number = |at: usize| match cells[at] {
            "" => Ok(f64::NAN),
            text => text.parse::<f64>().with_context(|| format!("{text:?} is not a number")),
        };
        let seconds = self.time.map_or(Ok(f64::NAN), number)?;
        let point = |at: &usize| Ok(Vector3::new(number(*at)?, number(at + 1)?, number(at + 2)?));
        let positions = self.x.iter().map(point).collect::<anyhow::Result<_>>()?;
        if self.sigma.iter().all(Option::is_none) {
            return Ok((seconds, Measured { positions, sigmas: Vec::new() }));
        }
        let sigma = |at: &Option<usize>| {
            let found = at.map_or(Ok(f64::NAN), number)?;
            let is_sensible = found.is_nan() || found > 0.0 && found.is_finite();
            ensure!(
                is_sensible,
                "a standard deviation is {}, expected one above 0 m or an empty cell",
                shown(found)
            );
            Ok(found)
        };
        let sigmas = self.sigma.iter().map(sigma).collect::<anyhow::Result<_>>()?;
        Ok((seconds, Measured { positions, sigmas }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "time,head_x,head_y,head_z,head_sigma,root_x,root_y,root_z";

    #[test]
    fn a_line_has_positions_and_standard_deviations() {
        let columns = Columns::from_header(HEADER, &[]).unwrap();
        assert_eq!(columns.names, ["head", "root"]);
        let (seconds, measured) = columns.read("0.5,1,2,3,0.01,4,,6").unwrap();
        assert_eq!(seconds, 0.5);
        assert_eq!(measured.positions[0], Vector3::new(1.0, 2.0, 3.0));
        assert!(measured.positions[1].y.is_nan());
        assert_eq!((measured.sigmas[0], measured.sigmas[1].is_nan()), (0.01, true));
        let columns = Columns::from_header(HEADER, &["root".to_owned()]).unwrap();
        assert!(columns.read("0,1,2,3,0.01,4,5,6").unwrap().1.sigmas.is_empty());
    }

    #[test]
    fn a_line_that_makes_no_sense_is_refused() {
        let columns = Columns::from_header(HEADER, &[]).unwrap();
        for (line, expected) in [
            ("0,1,2,3,0.01,4,5", "7 cells"),
            ("0,1,2,x,0.01,4,5,6", "\"x\" is not a number"),
            ("0,1,2,3,0,4,5,6", "a standard deviation is 0"),
        ] {
            let error = columns.read(line).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
        assert!(Columns::from_header("time,head_x,head_z,head_y", &[]).is_err());
    }

    #[tokio::test]
    async fn comments_are_skipped_and_errors_say_the_line() {
        let columns = Columns::from_header(HEADER, &[]).unwrap();
        let (line_read, lines) = mpsc::channel(4);
        for line in ["# metres", "", "0,1,2,3,0.01,4,5,6", "0,1"] {
            line_read.try_send(Ok(line.to_owned())).unwrap();
        }
        drop(line_read);
        let mut source = Source::lines(columns, 1, lines);
        assert!(source.next().await.unwrap().is_some());
        let error = source.next().await.unwrap_err().to_string();
        assert_eq!(error, "line 5 of standard input");
        assert!(source.next().await.unwrap().is_none());
    }

    #[tokio::test]
    async fn lines_are_paced_and_none_is_lost_by_giving_up_waiting() {
        let columns = Columns::from_header("time,head_x,head_y,head_z", &[]).unwrap();
        let (line_read, lines) = mpsc::channel(4);
        // twelve frames are missing between the last two
        for line in ["0.0000,0,0,0", "0.0167,1,0,0", "0.2167,2,0,0"] {
            line_read.try_send(Ok(line.to_owned())).unwrap();
        }
        drop(line_read);
        let mut source = Source::lines(columns, 1, lines);
        let begin = Instant::now();
        let x = |measured: Option<Measured>| measured.map(|measured| measured.positions[0].x);
        for expected in [0.0, 1.0] {
            assert_eq!(x(source.next().await.unwrap()), Some(expected));
        }
        let given_up = tokio::time::timeout(std::time::Duration::from_millis(10), source.next()).await;
        assert!(given_up.is_err(), "the third line is due after 0.2 s");
        assert_eq!(x(source.next().await.unwrap()), Some(2.0));
        assert!(begin.elapsed().as_secs_f64() >= 0.2);
        assert!(source.next().await.unwrap().is_none());
    }
}
