//! Measured points where no body can be: swapped, lost or mistyped samples, far from the others of their frame, and files
//! whose unit is not the metre.

use kinematics::ControlPoint;
use model::Skeleton;
use nalgebra::Vector3;

use crate::InputError;

/// How much farther apart than the stretched skeleton allows two points may be: bodies and markers differ from the model.
const MARGIN: f64 = 1.2;
/// The same for points that the skeleton holds close together, metres.
const MARGIN_M: f64 = 0.1;
/// Nobody is measured farther than this from the origin, metres.
const FARTHEST_M: f64 = 1e5;
/// Where more of the samples are too far, the scale is wrong, or the stature; no sample is to blame then.
const MOST: f64 = 0.2;
/// Points of a body are not farther apart than so many statures.
const WIDEST: f64 = 1.5;
/// Two points are not so many times as far apart as the stretched skeleton allows, whoever's skeleton it is.
const STRETCHED: f64 = 2.0;
/// How far apart the pair that is stretched most usually is, as a share of what the skeleton allows.
const USUAL: [f64; 2] = [0.38, 1.1];
/// Units of length that files have by mistake, and how many of them a metre has.
const UNITS: [(&str, f64); 4] =
    [("feet", 3.281), ("inches", 39.37), ("centimetres", 100.0), ("millimetres", 1000.0)];
/// Nobody is faster than this, metres a second.
const FASTEST: f64 = 15.0;
/// Shorter ways than this are noise, however short the time, metres.
const SHORT_M: f64 = 0.1;

/// A sample that was taken out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Outlier {
    /// index of the frame
    pub frame: usize,
    /// index of the point
    pub point: usize,
}

/// How far apart points can be: along the stretched skeleton.
#[derive(Debug, Clone)]
pub(super) struct Reach {
    /// metres, shape `[points][points]`
    pairs_m: Vec<Vec<f64>>,
    stature_m: f64,
}

impl Reach {
    pub(super) fn new(skeleton: &Skeleton, points: &[ControlPoint], stature_m: f64) -> Self {
        let joints = skeleton.joints();
        let line = |joint: usize| -> Vec<usize> {
            std::iter::successors(Some(joint), |joint| joints[*joint].parent).collect()
        };
        let lines: Vec<_> = points.iter().map(|point| line(point.joint)).collect();
        let length = |line: &[usize], other: &[usize]| -> f64 {
            line.iter().filter(|joint| !other.contains(joint)).map(|joint| joints[*joint].offset.norm()).sum()
        };
        let pair = |a: usize, b: usize| {
            if points[a].joint == points[b].joint {
                return (points[a].offset - points[b].offset).norm();
            }
            let bones = length(&lines[a], &lines[b]) + length(&lines[b], &lines[a]);
            bones + points[a].offset.norm() + points[b].offset.norm()
        };
        let row = |a: usize| (0..points.len()).map(|b| pair(a, b)).collect();
        Self { pairs_m: (0..points.len()).map(row).collect(), stature_m }
    }

    /// Distance over what the skeleton allows with its margin: above 1 no body has the two points there.
    fn stretch(&self, row: &[Vector3<f64>], a: usize, b: usize) -> f64 {
        (row[a] - row[b]).norm() / (MARGIN * self.pairs_m[a][b] + MARGIN_M)
    }
}

/// Takes out samples that are farther from the others than the body reaches: they count as not measured. `measured`: metres,
/// NaN where not measured, shape `[frames][points]`.
pub(super) fn remove(measured: &mut [Vec<Vector3<f64>>], reach: &Reach) -> Vec<Outlier> {
    let mut found = take_out(measured, |row| {
        (0..row.len()).filter(|point| is_measured(&row[*point]) && row[*point].amax() > FARTHEST_M).collect()
    });
    let mut near = measured.to_vec();
    let too_far = take_out(&mut near, |row| too_far(row, reach));
    let samples = measured.iter().flatten().filter(|position| is_measured(position)).count();
    if too_far.len() as f64 <= MOST * samples as f64 {
        measured.clone_from_slice(&near);
        found.extend(too_far);
        found.sort_by_key(|outlier| (outlier.frame, outlier.point));
    }
    found
}

/// Makes sure that the points are as far apart as those of a body are in metres. Takes medians over the frames, so that wild
/// samples don't count.
///
/// # Errors
/// If they are farther apart, with the unit that they probably have.
pub(super) fn check_unit(
    measured: &[Vec<Vector3<f64>>],
    reach: &Reach,
    points: &[ControlPoint],
) -> Result<(), InputError> {
    let mut widths = Vec::new();
    let mut ratios = Vec::new();
    for row in measured {
        let apart = |&(a, b): &(usize, usize)| (row[a] - row[b]).norm();
        let widest = pairs(row).max_by(|p, q| apart(p).total_cmp(&apart(q)));
        let Some((a, b)) = widest else { continue };
        widths.push((apart(&(a, b)), (b, a)));
        let ratio = |(a, b): (usize, usize)| apart(&(a, b)) / reach.pairs_m[a][b].max(MARGIN_M);
        ratios.extend(pairs(row).map(ratio).max_by(f64::total_cmp));
    }
    widths.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    ratios.sort_by(f64::total_cmp);
    let (Some(&(width_m, (a, b))), Some(&ratio)) =
        (widths.get(widths.len() / 2), ratios.get(ratios.len() / 2))
    else {
        return Ok(());
    };
    if width_m <= WIDEST * reach.stature_m && ratio <= STRETCHED {
        return Ok(());
    }
    let [least, most] = USUAL;
    let likely = |(_, in_metre): &&(&str, f64)| (ratio / most..=ratio / least).contains(in_metre);
    let units: Vec<&str> = UNITS.iter().filter(likely).map(|(name, _)| *name).collect();
    let unit =
        if units.is_empty() { "in another unit".to_owned() } else { format!("in {}", units.join(" or ")) };
    Err(InputError::Unit {
        first: points[a].name.clone(),
        second: points[b].name.clone(),
        width_m,
        stature_m: reach.stature_m,
        unit,
    })
}

/// The first frame to which all points move faster than anybody can, if there is one, and how far, metres.
pub(super) fn jump(measured: &[Vec<Vector3<f64>>], frame_rate: f64) -> Option<(usize, f64)> {
    let farthest_m = (FASTEST / frame_rate).max(SHORT_M);
    measured.windows(2).enumerate().find_map(|(frame, rows)| {
        let ways = rows[0].iter().zip(&rows[1]).map(|(before, after)| (after - before).norm());
        let mut ways: Vec<f64> = ways.filter(|way| way.is_finite()).collect();
        ways.sort_by(f64::total_cmp);
        let is_jump = ways.len() >= 2 && ways[0] > farthest_m;
        is_jump.then(|| (frame + 1, ways[ways.len() / 2]))
    })
}

fn is_measured(position: &Vector3<f64>) -> bool {
    position.iter().all(|v| v.is_finite())
}

/// All pairs of points that were measured, the greater index first.
fn pairs(row: &[Vector3<f64>]) -> impl Iterator<Item = (usize, usize)> {
    let points: Vec<usize> = (0..row.len()).filter(|point| is_measured(&row[*point])).collect();
    (0..points.len()).flat_map(move |i| {
        let points = points.clone();
        (0..i).map(move |j| (points[i], points[j]))
    })
}

/// Makes NaN of the samples of a frame that `choose` names.
fn take_out(
    measured: &mut [Vec<Vector3<f64>>],
    choose: impl Fn(&[Vector3<f64>]) -> Vec<usize>,
) -> Vec<Outlier> {
    let mut taken = Vec::new();
    for (frame, row) in measured.iter_mut().enumerate() {
        for point in choose(row) {
            row[point] = Vector3::repeat(f64::NAN);
            taken.push(Outlier { frame, point });
        }
    }
    taken
}

/// Which points are too far from others: again and again the one that is so from most, and among as many the one that is
/// farthest from all. Of the last two that are too far apart nobody can tell which is wrong.
fn too_far(row: &[Vector3<f64>], reach: &Reach) -> Vec<usize> {
    let mut row = row.to_vec();
    let mut taken = Vec::new();
    loop {
        let mut blame = vec![(0, 0.0); row.len()];
        for (a, b) in pairs(&row) {
            let stretch = reach.stretch(&row, a, b);
            for point in [a, b] {
                blame[point].0 += usize::from(stretch > 1.0);
                blame[point].1 += stretch;
            }
        }
        let worst = (0..row.len()).filter(|point| blame[*point].0 > 0);
        let worst =
            worst.max_by(|a, b| blame[*a].0.cmp(&blame[*b].0).then(blame[*a].1.total_cmp(&blame[*b].1)));
        let Some(worst) = worst else { break };
        let left: Vec<usize> = (0..row.len()).filter(|point| is_measured(&row[*point])).collect();
        let out = if left.len() == 2 { left } else { vec![worst] };
        for point in out {
            row[point] = Vector3::repeat(f64::NAN);
            taken.push(point);
        }
    }
    taken.sort_unstable();
    taken
}

#[cfg(test)]
mod tests {
    use body::BodyModel;

    use super::*;

    const NAMES: [&str; 6] = ["left_wrist", "right_wrist", "left_ankle", "right_ankle", "root", "head"];
    const STANDING: [[f64; 3]; 6] = [
        [0.25, 0.85, 0.05],
        [-0.25, 0.85, 0.05],
        [0.12, 0.1, 0.0],
        [-0.12, 0.1, 0.0],
        [0.0, 0.95, 0.0],
        [0.0, 1.65, 0.0],
    ];

    /// Points of the shipped body, and how far they reach.
    fn reach(names: &[&str]) -> (Vec<ControlPoint>, Reach) {
        let model = BodyModel::shipped();
        let shape = model.shape(&[]);
        let skeleton = model.skeleton(&shape).unwrap();
        let points = kinematics::control_points(&skeleton, names).unwrap();
        let reach = Reach::new(&skeleton, &points, 1.75);
        (points, reach)
    }

    /// Somebody who stands and is pushed along x, in ten frames.
    fn walk(points: usize) -> Vec<Vec<Vector3<f64>>> {
        let row = |frame: usize| {
            let at = |p: &[f64; 3]| Vector3::from(*p) + Vector3::x() * 0.1 * frame as f64;
            STANDING[..points].iter().map(at).collect()
        };
        (0..10).map(row).collect()
    }

    #[test]
    fn the_reach_of_points_is_the_way_along_the_bones() {
        let (_, reach) = reach(&NAMES);
        let [wrists, trunk] = [reach.pairs_m[0][1], reach.pairs_m[4][5]];
        assert!((1.2..1.9).contains(&wrists) && (0.5..0.9).contains(&trunk), "{wrists} {trunk}");
        assert_eq!(reach.pairs_m[3][5], reach.pairs_m[5][3]);
    }

    #[test]
    fn samples_far_from_the_others_are_taken_out_and_no_others() {
        let (points, reach) = reach(&NAMES);
        let mut measured = walk(6);
        assert_eq!(remove(&mut measured, &reach), []);
        assert_eq!(measured, walk(6));
        measured[3][1].x = 1000.0;
        measured[7][2].z = -1e300;
        let expected = [(3, 1), (7, 2)].map(|(frame, point)| Outlier { frame, point });
        assert_eq!(remove(&mut measured, &reach), expected);
        assert!(measured[3][1].x.is_nan() && measured[7][2].x.is_nan());
        assert_eq!(measured[3][0], walk(6)[3][0]);
        assert!(check_unit(&measured, &reach, &points).is_ok());
    }

    #[test]
    fn a_head_beside_its_body_is_taken_out() {
        let (_, reach) = reach(&NAMES);
        for aside in [Vector3::x(), -Vector3::x(), Vector3::z(), Vector3::y()] {
            let mut measured = walk(6);
            measured[4][5] += 1.2 * aside;
            assert_eq!(remove(&mut measured, &reach), [Outlier { frame: 4, point: 5 }], "{aside}");
        }
    }

    #[test]
    fn of_two_points_too_far_apart_none_is_believed() {
        let (_, reach) = reach(&NAMES[..2]);
        let mut measured = walk(2);
        measured[4][0].x = 50.0;
        assert_eq!(remove(&mut measured, &reach).len(), 2);
    }

    #[test]
    fn a_wrong_unit_blames_no_sample_and_is_named() {
        for count in [4, 6] {
            let (points, reach) = reach(&NAMES[..count]);
            assert!(check_unit(&walk(count), &reach, &points).is_ok());
            for (unit, in_metre) in UNITS {
                let mut measured = walk(count);
                measured.iter_mut().flatten().for_each(|position| *position *= in_metre);
                let before = measured.clone();
                assert_eq!(remove(&mut measured, &reach), []);
                assert_eq!(measured, before);
                let error = check_unit(&measured, &reach, &points).unwrap_err().to_string();
                assert!(error.contains(unit) && error.contains("expected positions in metres"), "{error}");
            }
        }
    }

    #[test]
    fn nobody_jumps_200_m_between_two_frames() {
        let mut measured = walk(6);
        assert_eq!(jump(&measured, 60.0), None);
        measured[6..].iter_mut().flatten().for_each(|position| position.z += 200.0);
        let (frame, way_m) = jump(&measured, 60.0).unwrap();
        assert!(frame == 6 && (way_m - 200.0).abs() < 0.1, "{frame} {way_m}");
    }
}
