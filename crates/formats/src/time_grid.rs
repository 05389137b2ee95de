//! From the times of rows to frames of a constant rate.

use model::{counted, shown, shown_rate};

use crate::{
    Error, Result,
    frame_rate::{decimals, from_period},
    read::Warnings,
    text::{finite, quote},
};

/// Times as they stand in a file.
#[derive(Debug, Default)]
pub(crate) struct Times {
    /// line and time in seconds of each row
    rows: Vec<(usize, f64)>,
    decimals: usize,
}

/// Which frame each row is.
#[derive(Debug)]
pub(crate) struct Grid {
    /// frames per second
    pub(crate) rate: f64,
    /// frame of each row, from 0, rising
    pub(crate) frames: Vec<usize>,
}

impl Grid {
    /// Frames from the first row to the last; frames without a row are missing.
    pub(crate) fn num_frames(&self) -> usize {
        self.frames.last().map_or(0, |last| last + 1)
    }
}

impl Times {
    pub(crate) fn push(&mut self, line: usize, cell: &[u8]) -> Result<()> {
        let time = finite(cell).filter(|t| t.abs() < 1e9);
        let time = time.ok_or_else(|| Error::at_line(line, quote(cell), "a time in seconds"))?;
        if let Some((_, before)) = self.rows.last().filter(|(_, before)| time <= *before) {
            let found = format!("time {time} s after {before} s");
            return Err(Error::at_line(line, found, "times that rise from row to row"));
        }
        self.decimals = self.decimals.max(decimals(cell));
        self.rows.push((line, time));
        Ok(())
    }

    /// `stated`: the rate of the header; it holds where the times agree with it. There are at most `max_frames`.
    pub(crate) fn grid(
        self,
        stated: Option<f64>,
        max_frames: usize,
        warnings: &mut Warnings,
    ) -> Result<Grid> {
        let Some((first_line, first)) = self.rows.first().copied() else {
            return Ok(Grid { rate: stated.unwrap_or(1.0), frames: Vec::new() });
        };
        let period = self.period(first_line, stated)?;
        let rate = match stated {
            Some(rate) if self.agrees(rate) => rate,
            Some(stated) => {
                let rate = period.ok_or_else(|| {
                    Error::at_line(first_line, "times that don't rise", "times that rise from row to row")
                })?;
                let (in_header, in_times) = (shown_rate(stated), shown_rate(rate));
                warnings.line(
                    first_line,
                    format!(
                        "the header says {in_header} Hz, the times say {in_times} Hz; the times are taken"
                    ),
                );
                rate
            }
            None => period.ok_or_else(|| {
                Error::at_line(first_line, "only one row", "at least two, for the frame rate")
            })?,
        };
        let mut frames = Vec::with_capacity(self.rows.len());
        let (mut missing, mut uneven) = (0, 0);
        for (line, time) in &self.rows {
            let place = (time - first) * rate;
            let frame = place.round();
            let expected = frames.last().map_or(0, |last: &usize| last + 1);
            if frame < expected as f64 {
                let found = format!("time {} s, less than half a frame after the row before", shown(*time));
                return Err(Error::at_line(*line, found, "times that rise from row to row"));
            }
            if frame >= max_frames as f64 {
                let found =
                    format!("time {} s, frame {} at {} Hz", shown(*time), shown(frame), shown_rate(rate));
                return Err(Error::at_line(
                    *line,
                    found,
                    format!("at most {max_frames} frames in such a file"),
                ));
            }
            uneven += usize::from((place - frame).abs() > 0.1 + 2.0 * rate * self.rounding());
            // it was checked to be small and not negative
            let frame = frame as usize;
            missing += frame - expected;
            frames.push(frame);
        }
        if missing > 0 {
            warnings.line(first_line, format!("{} missing between the rows", counted(missing, "frame")));
        }
        if uneven > 0 {
            warnings.line(
                first_line,
                format!("the times of {} are off the {} Hz grid", counted(uneven, "row"), shown_rate(rate)),
            );
        }
        Ok(Grid { rate, frames })
    }

    /// Half a unit of the last decimal, seconds.
    fn rounding(&self) -> f64 {
        0.5 * 0.1_f64.powi(self.decimals.min(300) as i32)
    }

    fn agrees(&self, rate: f64) -> bool {
        let first = self.rows[0].1;
        let mut places = self.rows.iter().enumerate();
        places.all(|(row, (_, time))| ((time - first) * rate - row as f64).abs() < 0.5)
    }

    /// Rate from the median step over half the rows: rounding averages out, and a few odd rows don't matter.
    fn period(&self, first_line: usize, stated: Option<f64>) -> Result<Option<f64>> {
        let half = self.rows.len() / 2;
        if half == 0 {
            return Ok(None);
        }
        let steps = || self.rows.windows(2).map(|pair| pair[1].1 - pair[0].1);
        let usual = median(steps().collect());
        // frames from the first row, so far as one can tell from the usual step
        let mut frame = 0.0;
        let frames: Vec<f64> = std::iter::once(0.0)
            .chain(steps().map(|step| {
                frame += (step / usual).round();
                frame
            }))
            .collect();
        let long_steps = self.rows.iter().zip(&self.rows[half..]).zip(frames.iter().zip(&frames[half..]));
        let step = median(long_steps.map(|((a, b), (i, j))| (b.1 - a.1) / (j - i)).collect());
        if !(1e-6..=1e6).contains(&step) {
            if stated.is_some() {
                return Ok(None);
            }
            let found = format!("times that step by {step} s");
            return Err(Error::at_line(first_line, found, "steps from 1e-6 to 1e6 s"));
        }
        // the step is known better than one time by the number of rows that it spans
        let known = self.decimals + half.ilog10() as usize;
        Ok(Some(from_period(step, known)))
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[(values.len() - 1) / 2]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(cells: &[&str], stated: Option<f64>) -> Result<(f64, Vec<usize>, usize)> {
        let mut times = Times::default();
        for (line, cell) in cells.iter().enumerate() {
            times.push(line + 1, cell.as_bytes())?;
        }
        let mut warnings = Warnings::default();
        let grid = times.grid(stated, 1000, &mut warnings)?;
        Ok((grid.rate, grid.frames, warnings.beside(()).warnings.len()))
    }

    #[test]
    fn rounded_times_give_the_whole_rate() {
        let cells = ["3.067", "3.083", "3.100", "3.117", "3.133", "3.150"];
        assert_eq!(grid(&cells, None).unwrap(), (60.0, (0..6).collect(), 0));
        assert_eq!(grid(&cells, Some(60.0)).unwrap().0, 60.0);
    }

    #[test]
    fn times_win_over_a_header_that_they_contradict() {
        let (rate, frames, warnings) =
            grid(&["0", "0.04", "0.08", "0.12", "0.16", "0.192"], Some(250.0)).unwrap();
        assert_eq!((rate, frames), (25.0, (0..6).collect()));
        assert_eq!(warnings, 2);
    }

    #[test]
    fn a_hole_in_time_is_missing_frames() {
        let (rate, frames, warnings) = grid(&["0", "0.1", "0.2", "0.5", "0.6"], None).unwrap();
        assert_eq!((rate, frames, warnings), (10.0, vec![0, 1, 2, 5, 6], 1));
    }

    #[test]
    fn times_that_fall_stand_still_or_run_away_are_refused() {
        for cells in [
            ["0", "0.1", "0.05", "0.3"].as_slice(),
            &["0", "0", "0"],
            &["0", "0.1", "0.2", "100000"],
            &["0", "nan"],
            &["0"],
        ] {
            assert!(grid(cells, None).is_err(), "{cells:?}");
        }
    }
}
