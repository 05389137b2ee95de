use pulp::{Arch, Simd, WithSimd};

use crate::{Descriptor, Feature, Features, Options};

/// Features whose widths differ by more are not the same, ratio.
const MOST_SCALE: f64 = 1.6;
/// Descriptors farther apart are not the same, steps: unrelated ones are about 600 apart.
const FARTHEST: u32 = 350;
/// Matches nearer than this to the best, times the width of the feature, are the same place.
const SAME_PLACE: f64 = 3.0;

/// Pairs of features that look alike, as indices before and now, in the order of those now: each is the nearest to the other of
/// all within reach, and clearly nearer than the second nearest at another place (Lowe's section 7.1).
pub fn match_features(before: &Features, now: &Features, options: &Options) -> Vec<[usize; 2]> {
    let reach = options.reach * extent(&before.points).max(extent(&now.points));
    let search = Search { before, now, reach };
    let mut nearest_now: Vec<Option<(u32, usize)>> = vec![None; before.points.len()];
    let mut nearest_before = Vec::with_capacity(now.points.len());
    let mut distances = vec![NOT_SEEN; before.points.len()];
    for i in 0..now.points.len() {
        Arch::new().dispatch(Row { search: &search, i, distances: &mut distances });
        let mut best: Option<(u32, usize)> = None;
        for (j, &distance) in distances.iter().enumerate().filter(|(_, distance)| **distance != NOT_SEEN) {
            if best.is_none_or(|(least, _)| distance < least) {
                best = Some((distance, j));
            }
            if nearest_now[j].is_none_or(|(least, _)| distance < least) {
                nearest_now[j] = Some((distance, i));
            }
        }
        let clear = best.filter(|&(distance, j)| {
            let chosen = &before.points[j];
            let is_other = |other: &Feature| {
                (other.pixel - chosen.pixel).norm() > SAME_PLACE * chosen.scale_px.max(other.scale_px)
            };
            let others = distances.iter().zip(&before.points).filter(|(_, other)| is_other(other));
            let second = others.map(|(distance, _)| *distance).min().unwrap_or(NOT_SEEN);
            let is_clear = f64::from(distance) < options.ratio.powi(2) * f64::from(second);
            is_clear && distance < FARTHEST * FARTHEST
        });
        nearest_before.push(clear);
    }
    let mutual = |(i, nearest): (usize, Option<(u32, usize)>)| {
        let (_, j) = nearest?;
        (nearest_now[j]?.1 == i).then_some([j, i])
    };
    nearest_before.into_iter().enumerate().filter_map(mutual).collect()
}

/// Stands for an impossible pair.
const NOT_SEEN: u32 = u32::MAX;

struct Search<'a> {
    before: &'a Features,
    now: &'a Features,
    reach: f64,
}

/// Squared distances of one feature's descriptor from those of all before.
struct Row<'a> {
    search: &'a Search<'a>,
    i: usize,
    distances: &'a mut [u32],
}

impl WithSimd for Row<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Self { search: Search { before, now, reach }, i, distances } = self;
        let (here, descriptor) = (&now.points[i], &now.descriptors[i]);
        for (j, distance) in distances.iter_mut().enumerate() {
            let there = &before.points[j];
            let ratio = there.scale_px / here.scale_px;
            let is_near = (there.pixel - here.pixel).norm_squared() <= reach * reach;
            *distance = if is_near && ratio < MOST_SCALE && ratio * MOST_SCALE > 1.0 {
                squared_distance(descriptor, &before.descriptors[j])
            } else {
                NOT_SEEN
            };
        }
    }
}

#[inline(always)]
fn squared_distance(a: &Descriptor, b: &Descriptor) -> u32 {
    let mut sum = 0i32;
    for i in 0..a.len() {
        let difference = i32::from(i16::from(a[i]) - i16::from(b[i]));
        sum += difference * difference;
    }
    sum as u32
}

/// Larger side of the box around features, pixels.
fn extent(points: &[Feature]) -> f64 {
    let side = |axis: usize| {
        let along = points.iter().map(|point| point.pixel[axis]);
        let (low, high) =
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        (high - low).max(0.0)
    };
    side(0).max(side(1))
}
