use model::{Image, Silhouette};
use nalgebra::Vector2;

use crate::{
    Descriptor, Options,
    descriptor::Grid,
    extrema::{Differences, Extremum},
    grey::Grey,
    orientation::directions,
    scale_space::ScaleSpace,
};

/// A point that can be found again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feature {
    /// where, pixels
    pub pixel: Vector2<f64>,
    /// width of the Gaussian that it is an extremum of, pixels
    pub scale_px: f64,
    /// which way it is turned, radians from u towards v
    pub direction: f64,
    /// height of the extremum; black is 0 and white 1
    pub strength: f64,
}

/// The features of a picture.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Features {
    /// shape `[features]`; the same point comes twice where it has two directions
    pub points: Vec<Feature>,
    /// how each looks, shape `[features]`
    pub descriptors: Vec<Descriptor>,
}

/// Finds features; keeps its buffers from picture to picture.
#[derive(Debug, Default)]
pub struct Detector {
    grey: Grey,
    space: ScaleSpace,
    differences: Differences,
    extrema: Vec<Extremum>,
    grid: Grid,
    weights: Vec<f32>,
}

/// Side of the squares that features are spread over, as a share of the region's larger side.
const SQUARE: f64 = 1.0 / 24.0;

/// The features of a picture inside a silhouette, the strongest of every part of it first.
pub fn detect(image: &Image, inside: &Silhouette, options: &Options) -> Features {
    Detector::default().detect(image, inside, options)
}

impl Detector {
    /// As [`detect`](crate::detect).
    pub fn detect(&mut self, image: &Image, inside: &Silhouette, options: &Options) -> Features {
        let mut features = Features::default();
        if !self.grey.read(image, inside) {
            return features;
        }
        self.space.fill(&self.grey, options.margin_px);
        self.extrema.clear();
        for (index, octave) in self.space.octaves().iter().enumerate() {
            self.differences.find(octave, index, options, &mut self.extrema);
        }
        self.spread(options.max_features);
        for extremum in &self.extrema {
            let octave = &self.space.octaves()[extremum.octave];
            let Extremum { layer, place, sigma, strength, .. } = *extremum;
            let step = self.grey.step * f64::from(1u32 << extremum.octave);
            let pixel = |axis: usize| self.grey.origin[axis] + step * f64::from(place[axis]);
            let pixel = Vector2::new(pixel(0), pixel(1));
            let grid = &mut self.grid;
            directions(octave, extremum, &mut self.weights, |direction| {
                if features.points.len() >= options.max_features {
                    return;
                }
                let Some(descriptor) = grid.describe(octave, layer, place, sigma, direction) else { return };
                features.descriptors.push(descriptor);
                features.points.push(Feature {
                    pixel,
                    scale_px: step * f64::from(sigma),
                    direction: f64::from(direction),
                    strength: f64::from(strength),
                });
            });
        }
        features
    }

    /// Orders the extrema: the strongest of every square first, then the second ones, and so on; keeps the first `most`.
    fn spread(&mut self, most: usize) {
        let side = SQUARE * self.grey.width.max(self.grey.height) as f64;
        let columns = (self.grey.width as f64 / side) as usize + 1;
        let rows = (self.grey.height as f64 / side) as usize + 1;
        let square = |extremum: &Extremum| {
            let at =
                |axis: usize| f64::from(extremum.place[axis]) * f64::from(1u32 << extremum.octave) / side;
            (at(1) as usize).min(rows - 1) * columns + (at(0) as usize).min(columns - 1)
        };
        // equal ones stay in the order of their octaves and rows
        self.extrema.sort_by(|a, b| b.strength.total_cmp(&a.strength));
        let mut taken = vec![0usize; rows * columns];
        let mut ranked: Vec<(usize, Extremum)> = self
            .extrema
            .iter()
            .map(|extremum| {
                let in_square = &mut taken[square(extremum)];
                *in_square += 1;
                (*in_square, *extremum)
            })
            .collect();
        ranked.sort_by_key(|(rank, _)| *rank);
        self.extrema.clear();
        self.extrema.extend(ranked.into_iter().take(most).map(|(_, extremum)| extremum));
    }
}
