//! From errors by frame and by joint to lines and bars.

use motion_db::FRAME_RATE;

use super::plot::{Place, Series};
use crate::{Comparison, Gap};

/// Most places of a line: more would not be seen.
const MAX_PLACES: usize = 400;

/// Mean over trials and quartiles of the errors by frame, from the beginning of each trial, for as long as a quarter of the trials goes on. x is in seconds.
pub fn over_time(name: String, trials: &[&[f64]]) -> Series {
    let fewest = (trials.len() / 4).max(1);
    let longest = trials.iter().map(|t| t.len()).max().unwrap_or(0);
    let columns = (0..longest).map(|frame| {
        let errors: Vec<f64> = trials.iter().filter_map(|t| t.get(frame).copied()).collect();
        (frame as f64 / FRAME_RATE, errors)
    });
    let places = columns.take_while(|(_, errors)| errors.len() >= fewest).map(|(x, errors)| place(x, errors));
    Series { name, places: places.collect() }
}

/// As [`over_time`], with 0 where the gap begins: only frames that every trial has.
pub fn around_gap(name: String, trials: &[(&[f64], &Gap)]) -> Series {
    let before = trials.iter().map(|(_, gap)| gap.frames.start).min().unwrap_or(0);
    let after = trials.iter().map(|(errors, gap)| errors.len() - gap.frames.start).min().unwrap_or(0);
    let places = (0..before + after).map(|i| {
        let errors = trials.iter().map(|(errors, gap)| errors[gap.frames.start - before + i]).collect();
        place((i as f64 - before as f64) / FRAME_RATE, errors)
    });
    Series { name, places: places.collect() }
}

/// One trial's errors by frame; of a long one means and quartiles over pieces. x is in seconds.
pub fn from_errors(name: String, errors: &[f64]) -> Series {
    let step = errors.len().div_ceil(MAX_PLACES).max(1);
    let places = errors
        .chunks(step)
        .enumerate()
        .map(|(i, piece)| place((i * step) as f64 / FRAME_RATE, piece.to_vec()));
    Series { name, places: places.collect() }
}

fn place(x: f64, mut values: Vec<f64>) -> Place {
    values.sort_by(f64::total_cmp);
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    Place { x, mean, low: quantile(&values, 0.25), high: quantile(&values, 0.75) }
}

/// Between the two nearest of sorted values.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = share * sorted.len().saturating_sub(1) as f64;
    let value = |i: usize| sorted.get(i).copied().unwrap_or(0.0);
    let (low, part) = (at.floor() as usize, at.fract());
    value(low) + if part > 0.0 { part * (value(low + 1) - value(low)) } else { 0.0 }
}

/// For each joint that turns, its name and the mean over trials of its geodesic error, degrees, in each group of trials.
pub fn joint_bars(groups: &[Vec<&Comparison>]) -> Vec<(String, Vec<f64>)> {
    let Some(first) = groups.first().and_then(|group| group.first()) else { return Vec::new() };
    let turning = first.joints.iter().enumerate().filter(|(_, joint)| joint.angles > 0);
    let bars = turning.map(|(j, joint)| {
        let mean = |group: &Vec<&Comparison>| {
            let errors = group.iter().filter_map(|c| Some(c.joints.get(j)?.geodesic_deg));
            errors.sum::<f64>() / group.len().max(1) as f64
        };
        (joint.joint.clone(), groups.iter().map(mean).collect())
    });
    bars.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_means_and_bands_quartiles() {
        let trials: [&[f64]; 5] = [&[1.0, 1.0], &[2.0], &[3.0], &[4.0], &[10.0]];
        let series = over_time("x".to_owned(), &trials);
        assert_eq!(series.places[0], Place { x: 0.0, mean: 4.0, low: 2.0, high: 4.0 });
        assert_eq!(series.places.len(), 2, "one of five is a quarter, rounded down");
        let eight: Vec<&[f64]> = std::iter::repeat_n(&[1.0][..], 7).chain([&[1.0, 1.0][..]]).collect();
        assert_eq!(over_time("x".to_owned(), &eight).places.len(), 1);
    }

    #[test]
    fn gaps_are_laid_over_one_another() {
        let gap = |begin| Gap { frames: begin..begin + 1, points: 0..1 };
        let (early, late) = (gap(1), gap(2));
        let trials: [(&[f64], &Gap); 2] = [(&[1.0, 9.0, 2.0, 2.0], &early), (&[1.0, 1.0, 7.0, 4.0], &late)];
        let means: Vec<f64> = around_gap("x".to_owned(), &trials).places.iter().map(|p| p.mean).collect();
        assert_eq!(means, [1.0, 8.0, 3.0]);
    }

    #[test]
    fn a_long_trial_is_drawn_in_pieces() {
        let errors: Vec<f64> = (0..100_000).map(f64::from).collect();
        let series = from_errors("x".to_owned(), &errors);
        assert!(series.places.len() <= MAX_PLACES && series.places.len() > MAX_PLACES / 2);
        let first = series.places[0];
        assert!(first.low < first.mean && first.mean < first.high);
    }
}
