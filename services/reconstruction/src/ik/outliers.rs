//! Measured points where no body can be: swapped, lost or mistyped samples, far from the others of their frame.

use nalgebra::Vector3;

/// No point of a body is farther from the middle of its points than so many statures.
const REACH: f64 = 1.5;
/// Nobody is measured farther than this from the origin, metres.
const FARTHEST_M: f64 = 1e5;
/// Where more of the samples are too far, the scale is wrong, or the stature; no sample is to blame then.
const MOST: f64 = 0.2;

/// A sample that was taken out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Outlier {
    /// index of the frame
    pub frame: usize,
    /// index of the point
    pub point: usize,
}

/// Takes out samples that are farther from the others than the body reaches: they count as not measured. `measured`: metres,
/// NaN where not measured, shape `[frames][points]`.
pub(super) fn remove(measured: &mut [Vec<Vector3<f64>>], stature_m: f64) -> Vec<Outlier> {
    let is_absurd = |position: &Vector3<f64>| position.amax() > FARTHEST_M;
    let mut found = take_out(measured, |positions| positions.iter().map(is_absurd).collect());
    let reach_m = REACH * stature_m;
    let mut far = measured.to_vec();
    let too_far = take_out(&mut far, |positions| are_too_far(positions, reach_m));
    let samples = measured.iter().flatten().filter(|position| is_measured(position)).count();
    if too_far.len() as f64 <= MOST * samples as f64 {
        measured.clone_from_slice(&far);
        found.extend(too_far);
        found.sort_by_key(|outlier| (outlier.frame, outlier.point));
    }
    found
}

fn is_measured(position: &Vector3<f64>) -> bool {
    position.iter().all(|v| v.is_finite())
}

/// Makes NaN of the samples that `choose` says yes to; it is given those of a frame that were measured.
fn take_out(
    measured: &mut [Vec<Vector3<f64>>],
    choose: impl Fn(&[Vector3<f64>]) -> Vec<bool>,
) -> Vec<Outlier> {
    let mut taken = Vec::new();
    for (frame, row) in measured.iter_mut().enumerate() {
        let points: Vec<usize> = (0..row.len()).filter(|point| is_measured(&row[*point])).collect();
        let positions: Vec<Vector3<f64>> = points.iter().map(|point| row[*point]).collect();
        for (point, is_out) in points.into_iter().zip(choose(&positions)) {
            if is_out {
                row[point] = Vector3::repeat(f64::NAN);
                taken.push(Outlier { frame, point });
            }
        }
    }
    taken
}

/// Which positions are too far from the middle of all. Of two that are too far apart nobody can tell which is wrong.
fn are_too_far(positions: &[Vector3<f64>], reach_m: f64) -> Vec<bool> {
    match positions {
        [] | [_] => vec![false; positions.len()],
        [a, b] => vec![(a - b).norm() > 2.0 * reach_m; 2],
        _ => {
            let middle = Vector3::from_fn(|axis, _| median(positions.iter().map(|p| p[axis]).collect()));
            positions.iter().map(|position| (position - middle).norm() > reach_m).collect()
        }
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three points of a body that walks along x, in ten frames.
    fn walk() -> Vec<Vec<Vector3<f64>>> {
        let place = |frame: usize, y: f64| Vector3::new(0.1 * frame as f64, y, 0.0);
        (0..10).map(|frame| [0.1, 1.0, 1.7].map(|y| place(frame, y)).to_vec()).collect()
    }

    #[test]
    fn samples_far_from_the_others_are_taken_out_and_no_others() {
        let mut measured = walk();
        assert_eq!(remove(&mut measured, 1.75), []);
        assert_eq!(measured, walk());
        measured[3][1].x = 1000.0;
        measured[7][2].z = -1e300;
        assert_eq!(
            remove(&mut measured, 1.75),
            [(3, 1), (7, 2)].map(|(frame, point)| Outlier { frame, point })
        );
        assert!(measured[3][1].x.is_nan() && measured[7][2].x.is_nan());
        assert_eq!(measured[3][0], walk()[3][0]);
    }

    #[test]
    fn of_two_points_too_far_apart_none_is_believed() {
        let mut measured: Vec<_> = walk().into_iter().map(|row| row[..2].to_vec()).collect();
        measured[4][0].x = 50.0;
        assert_eq!(remove(&mut measured, 1.75).len(), 2);
    }

    #[test]
    fn a_wrong_unit_blames_no_sample() {
        let mut measured = walk();
        measured.iter_mut().flatten().for_each(|position| *position *= 100.0);
        let before = measured.clone();
        assert_eq!(remove(&mut measured, 1.75), []);
        assert_eq!(measured, before);
    }
}
