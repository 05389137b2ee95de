//! Extrema of the differences of Gaussians, to a part of a pixel.

use nalgebra::{Matrix3, Vector3};
use pulp::{Arch, Simd, WithSimd};

use crate::{
    Options,
    scale_space::{FIRST, LAYERS, Octave, SCALES},
};

/// An extremum in an octave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremum {
    /// index of the octave
    pub octave: usize,
    /// the Gaussian whose width is nearest
    pub layer: usize,
    /// where, pixels of the octave
    pub place: [f32; 2],
    /// width of the Gaussian, pixels of the octave
    pub sigma: f32,
    /// height above or below the neighbours' level
    pub strength: f32,
}

/// Differences of an octave.
#[derive(Debug, Default)]
pub struct Differences {
    layers: [Vec<f32>; LAYERS - 1],
    /// 1 where a pixel of a row may be an extremum
    marks: Vec<u8>,
}

/// An extremum moves to a neighbouring pixel so often at most before it is given up.
const MOST_MOVES: usize = 4;
/// An extremum this far from its pixel belongs to the next, pixels.
const FARTHEST: f64 = 0.6;

impl Differences {
    /// Adds the extrema of an octave, row by row.
    pub fn find(&mut self, octave: &Octave, index: usize, options: &Options, found: &mut Vec<Extremum>) {
        for (i, layer) in self.layers.iter_mut().enumerate() {
            layer.clear();
            layer.extend(
                octave.layers[i + 1].iter().zip(&octave.layers[i]).map(|(wider, finer)| wider - finer),
            );
        }
        let width = octave.width;
        // the pixel itself is lower than the extremum between pixels
        let least = 0.8 * options.contrast as f32;
        for layer in 1..=SCALES {
            for y in 1..octave.height - 1 {
                let start = y * width;
                let line = |layer: usize, y: usize| &self.layers[layer][y * width..(y + 1) * width];
                self.marks.resize(width, 0);
                Arch::new().dispatch(Mark {
                    lines: [
                        line(layer, y),
                        line(layer, y - 1),
                        line(layer, y + 1),
                        line(layer - 1, y),
                        line(layer + 1, y),
                    ],
                    least,
                    inside: &octave.well_inside[start..start + width],
                    marks: &mut self.marks[..width],
                });
                for x in 1..width - 1 {
                    if self.marks[x] != 0 && self.is_extremum(layer, start + x, width) {
                        found.extend(self.refine(octave, index, layer, [x, y], options));
                    }
                }
            }
        }
    }

    fn is_extremum(&self, layer: usize, at: usize, width: usize) -> bool {
        let value = self.layers[layer][at];
        let sign = value.signum();
        let high = sign * value;
        let is_below = |layer: usize, from: usize| {
            let row = &self.layers[layer][from - 1..from + 2];
            row.iter().all(|neighbour| sign * neighbour <= high)
        };
        [layer, layer - 1, layer + 1]
            .into_iter()
            .all(|layer| is_below(layer, at - width) && is_below(layer, at) && is_below(layer, at + width))
    }

    /// Lowe's section 4: the extremum of the quadratic through the neighbours; none if it is low, or along an edge.
    fn refine(
        &self,
        octave: &Octave,
        index: usize,
        mut layer: usize,
        [mut x, mut y]: [usize; 2],
        options: &Options,
    ) -> Option<Extremum> {
        let width = octave.width;
        for _ in 0..MOST_MOVES {
            let at = y * width + x;
            let value = |layer: usize, at: usize| f64::from(self.layers[layer][at]);
            let middle = value(layer, at);
            let (left, right) = (value(layer, at - 1), value(layer, at + 1));
            let (above, below) = (value(layer, at - width), value(layer, at + width));
            let (finer, wider) = (value(layer - 1, at), value(layer + 1, at));
            let gradient = Vector3::new(right - left, below - above, wider - finer) / 2.0;
            let (xx, yy, ss) =
                (right + left - 2.0 * middle, below + above - 2.0 * middle, wider + finer - 2.0 * middle);
            let cross = |a: f64, b: f64, c: f64, d: f64| (a - b - c + d) / 4.0;
            let in_layer = |layer: usize, to: usize| value(layer, to);
            let xy = cross(
                in_layer(layer, at + width + 1),
                in_layer(layer, at + width - 1),
                in_layer(layer, at - width + 1),
                in_layer(layer, at - width - 1),
            );
            let xs = cross(
                value(layer + 1, at + 1),
                value(layer + 1, at - 1),
                value(layer - 1, at + 1),
                value(layer - 1, at - 1),
            );
            let ys = cross(
                value(layer + 1, at + width),
                value(layer + 1, at - width),
                value(layer - 1, at + width),
                value(layer - 1, at - width),
            );
            let hessian = Matrix3::new(xx, xy, xs, xy, yy, ys, xs, ys, ss);
            let offset = -(hessian.try_inverse()? * gradient);
            if offset.iter().any(|x| !x.is_finite()) {
                return None;
            }
            if offset.amax() <= FARTHEST {
                let height = (middle + 0.5 * gradient.dot(&offset)).abs();
                let (trace, determinant) = (xx + yy, xx * yy - xy * xy);
                let ratio = options.edge_ratio;
                let is_blob =
                    determinant > 0.0 && trace * trace * ratio < (ratio + 1.0).powi(2) * determinant;
                return (height >= options.contrast && is_blob).then(|| Extremum {
                    octave: index,
                    layer: ((layer as f64 + offset.z).round() as usize).clamp(1, SCALES),
                    place: [(x as f64 + offset.x) as f32, (y as f64 + offset.y) as f32],
                    sigma: (FIRST * 2f64.powf((layer as f64 + offset.z) / SCALES as f64)) as f32,
                    strength: height as f32,
                });
            }
            let moved = |at: usize, by: f64, end: usize| {
                let next = at as i64 + by.clamp(-1.0, 1.0).round() as i64;
                (1..end as i64).contains(&next).then_some(next as usize)
            };
            x = moved(x, offset.x, width - 1)?;
            y = moved(y, offset.y, octave.height - 1)?;
            layer = moved(layer, offset.z, SCALES + 1)?;
            if octave.well_inside[y * width + x] == 0 {
                return None;
            }
        }
        None
    }
}

/// Marks the pixels of a row that are high enough and no lower (or no higher) than six of their 26 neighbours.
struct Mark<'a> {
    /// the row; above and below; in the finer and the wider layer
    lines: [&'a [f32]; 5],
    least: f32,
    inside: &'a [u8],
    marks: &'a mut [u8],
}

impl WithSimd for Mark<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Self { lines: [here, above, below, finer, wider], least, inside, marks } = self;
        let inner = marks.len() - 2;
        let (left, right) = (&here[..inner], &here[2..][..inner]);
        let [here, above, below, finer, wider] =
            [here, above, below, finer, wider].map(|line| &line[1..][..inner]);
        let (inside, marks) = (&inside[1..][..inner], &mut marks[1..][..inner]);
        for i in 0..inner {
            let around = [left[i], right[i], above[i], below[i], finer[i], wider[i]];
            let (mut high, mut low) = (around[0], around[0]);
            for other in &around[1..] {
                high = if *other > high { *other } else { high };
                low = if *other < low { *other } else { low };
            }
            let value = here[i];
            let is_peak = (value >= least) & (value >= high);
            let is_pit = (value <= -least) & (value <= low);
            marks[i] = inside[i] & u8::from(is_peak | is_pit);
        }
    }
}
