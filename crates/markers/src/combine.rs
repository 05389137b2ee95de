//! One trajectory from several markers, without jumps where one of them drops out.

use model::PointTrajectories;
use nalgebra::Vector3;

/// How fast the vector between a marker and the mean may turn while it is not seen, radians a second: a limb in a walk.
const TURN_RATE: f64 = 2.0;

/// The trajectory of one point.
#[derive(Debug)]
pub(crate) struct Combined {
    /// metres, NaN where nothing was measured, shape `[frames]`
    pub(crate) positions: Vec<Vector3<f64>>,
    /// metres, NaN for the run's default, shape `[frames]`
    pub(crate) sigmas: Vec<f64>,
}

impl Combined {
    pub(crate) fn num_measured(&self) -> usize {
        self.positions.iter().filter(|p| p.x.is_finite()).count()
    }
}

/// The weighted mean of the columns `markers` (at least one) where all of them were measured.
///
/// In other frames each measured marker is carried to the mean by the vector between the two as it was in the nearest
/// complete frames before and after, interpolated; the standard deviation grows by the arc through which the vector may
/// have turned since. Where no frame is complete, the marker that was measured least is left out until one is.
/// `sigma_m`: of the point given its markers, added to theirs.
pub(crate) fn combine(
    trajectories: &PointTrajectories,
    markers: &[usize],
    weights: &[f64],
    sigma_m: Option<f64>,
) -> Combined {
    let group = complete_somewhere(trajectories, markers, weights);
    let frames = trajectories.num_frames();
    let sum = |values: &mut dyn Iterator<Item = (Vector3<f64>, f64)>| {
        let (total, weight) =
            values.fold((Vector3::zeros(), 0.0), |(sum, all), (v, w)| (sum + v * w, all + w));
        total / weight
    };
    // NaN spreads: a mean is finite only where all are
    let means: Vec<Vector3<f64>> = (0..frames)
        .map(|f| sum(&mut group.iter().map(|(marker, w)| (trajectories.frame(f)[*marker], *w))))
        .collect();
    let is_complete = |f: &usize| means[*f].x.is_finite();
    let after: Vec<Option<usize>> = {
        let mut next = None;
        let mut after: Vec<_> = (0..frames)
            .rev()
            .map(|f| {
                next = if is_complete(&f) { Some(f) } else { next };
                next
            })
            .collect();
        after.reverse();
        after
    };
    let mut before = None;
    let mut combined = Combined { positions: Vec::with_capacity(frames), sigmas: Vec::with_capacity(frames) };
    for frame in 0..frames {
        let samples = trajectories.samples(frame);
        let measured = || group.iter().filter(|(marker, _)| samples.positions[*marker].x.is_finite());
        let own = own_sigma(sigma_m, measured().map(|(marker, w)| (samples.sigma(*marker), *w)));
        if is_complete(&frame) {
            before = Some(frame);
            combined.positions.push(means[frame]);
            combined.sigmas.push(own);
            continue;
        }
        // from a marker to the mean, as it was or will be
        let vector = |marker: usize| {
            let at = |f: usize| means[f] - trajectories.frame(f)[marker];
            match (before, after[frame]) {
                (Some(a), Some(b)) => at(a).lerp(&at(b), (frame - a) as f64 / (b - a) as f64),
                (Some(a), None) => at(a),
                (None, Some(b)) => at(b),
                (None, None) => Vector3::repeat(f64::NAN),
            }
        };
        let carried = measured().map(|(marker, w)| (samples.positions[*marker] + vector(*marker), *w));
        let position = sum(&mut { carried });
        let away = |f: Option<usize>| f.map_or(usize::MAX, |f| f.abs_diff(frame));
        let seconds = away(before).min(away(after[frame])) as f64 / trajectories.frame_rate();
        let arm = sum(&mut measured().map(|(marker, w)| (vector(*marker).norm() * Vector3::x(), *w))).x;
        combined.positions.push(position);
        combined.sigmas.push(grown(own, arm * (TURN_RATE * seconds).min(1.0)));
    }
    combined
}

/// The markers with their weights, less those without which there is a frame that has all.
fn complete_somewhere(
    trajectories: &PointTrajectories,
    markers: &[usize],
    weights: &[f64],
) -> Vec<(usize, f64)> {
    let frames = 0..trajectories.num_frames();
    let is_measured = |frame: usize, marker: usize| trajectories.frame(frame)[marker].x.is_finite();
    let count = |marker: usize| frames.clone().filter(|f| is_measured(*f, marker)).count();
    let mut group: Vec<(usize, f64)> = markers.iter().copied().zip(weights.iter().copied()).collect();
    while group.len() > 1 && !frames.clone().any(|f| group.iter().all(|(m, _)| is_measured(f, *m))) {
        // of those measured as rarely, the last
        let least = (0..group.len()).rev().min_by_key(|i| count(group[*i].0)).unwrap_or_default();
        group.remove(least);
    }
    group
}

/// Standard deviation of a mean: that of the point given its markers, and theirs, which are taken to err alike.
fn own_sigma(point: Option<f64>, markers: impl Iterator<Item = (Option<f64>, f64)>) -> f64 {
    let known = markers.filter_map(|(sigma, w)| Some((sigma? * w, w)));
    let (sum, weight) = known.fold((0.0, 0.0), |(sum, all), (s, w)| (sum + s, all + w));
    let from_markers = if weight > 0.0 { Some(sum / weight) } else { None };
    match (point, from_markers) {
        (Some(a), Some(b)) => f64::hypot(a, b),
        (a, b) => a.or(b).unwrap_or(f64::NAN),
    }
}

/// `sigma` and the further error together; the run's default stays as long as nothing is added.
fn grown(sigma: f64, further: f64) -> f64 {
    if further.is_nan() || further <= 0.0 {
        return sigma;
    }
    if sigma.is_nan() { further } else { sigma.hypot(further) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GONE: [f64; 3] = [f64::NAN; 3];

    fn trajectories(frames: &[[[f64; 3]; 2]]) -> PointTrajectories {
        let positions = frames.iter().flatten().map(|p| Vector3::from(*p)).collect();
        PointTrajectories::new(vec!["a".into(), "b".into()], 10.0, positions).unwrap()
    }

    fn x(combined: &Combined) -> Vec<f64> {
        combined.positions.iter().map(|p| p.x).collect()
    }

    #[test]
    fn a_marker_that_drops_out_makes_no_jump() {
        // the pair is 2 apart and moves by 1 a frame; b is away in the middle, and closer when it comes back
        let moving = [
            [[0.0; 3], [2.0, 0.0, 0.0]],
            [[1.0, 0.0, 0.0], GONE],
            [[2.0, 0.0, 0.0], GONE],
            [[3.0, 0.0, 0.0], [4.4, 0.0, 0.0]],
            [GONE, [5.4, 0.0, 0.0]],
            [GONE, GONE],
        ];
        let combined = combine(&trajectories(&moving), &[0, 1], &[0.5, 0.5], Some(0.01));
        for (found, expected) in x(&combined).iter().zip([1.0, 1.9, 2.8, 3.7, 4.7]) {
            assert!((found - expected).abs() < 1e-12, "{found} instead of {expected}");
        }
        assert!(combined.positions[5].x.is_nan());
        assert_eq!(combined.num_measured(), 5);
        assert_eq!((combined.sigmas[0], combined.sigmas[3]), (0.01, 0.01));
        // 0.1 s at 2 rad/s with an arm of 0.9 m
        assert!((combined.sigmas[1] - 0.01_f64.hypot(0.18)).abs() < 1e-12, "{}", combined.sigmas[1]);
    }

    #[test]
    fn weights_weigh_and_known_errors_add() {
        let pair = trajectories(&[[[0.0; 3], [4.0, 0.0, 0.0]]]);
        let combined = combine(&pair, &[0, 1], &[0.75, 0.25], None);
        assert_eq!(x(&combined), [1.0]);
        assert!(combined.sigmas[0].is_nan());
        let pair = pair.with_sigmas(vec![0.03, 0.03]).unwrap();
        let combined = combine(&pair, &[0, 1], &[0.75, 0.25], Some(0.04));
        assert!((combined.sigmas[0] - 0.05).abs() < 1e-12);
    }

    #[test]
    fn markers_that_were_never_there_together_do_without_the_rarer_one() {
        let apart = [[[1.0; 3], GONE], [[2.0; 3], GONE], [GONE, [7.0; 3]]];
        let combined = combine(&trajectories(&apart), &[0, 1], &[0.5, 0.5], None);
        assert_eq!(x(&combined)[..2], [1.0, 2.0]);
        assert!(combined.positions[2].x.is_nan());
        let nothing = combine(&trajectories(&[[GONE, GONE]]), &[0, 1], &[0.5, 0.5], None);
        assert_eq!(nothing.num_measured(), 0);
    }
}
