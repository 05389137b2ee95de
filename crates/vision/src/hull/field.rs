use nalgebra::Vector3;
use rayon::prelude::*;

use super::{
    HullOptions,
    cone::{Cone, Verdict},
};
use crate::Error;

/// How far inside the hull the points of a grid are.
#[derive(Debug, Clone)]
pub(super) struct Field {
    /// first point, metres
    pub origin: Vector3<f64>,
    /// distance between points, metres
    pub cell_m: f64,
    /// points along x, y and z
    pub size: [usize; 3],
    /// metres, positive inside; far from the surface only the sign is right. x runs fastest, then z, then y
    pub values: Vec<f32>,
}

/// Points along a side of the largest cells of the octree; halved down to [`SMALLEST`].
const BLOCK: usize = 16;
const SMALLEST: usize = 2;

/// Values of the points beside the surface: by octree, block after block, layers of blocks on all cores.
pub(super) fn carve_finely(
    cones: &[Cone],
    [least, most]: [Vector3<f64>; 2],
    options: &HullOptions,
) -> Result<Field, Error> {
    let cell_m = options.cell_m;
    // whole cells from the world's origin, so that neighbouring frames share their grid, and one cell of air around
    let first = (least / cell_m).map(|x| x.floor() - 1.0);
    let last = (most / cell_m).map(|x| x.ceil() + 1.0);
    let points = last - first + Vector3::repeat(1.0);
    let cells = points.x * points.y * points.z;
    if cells > options.max_cells as f64 {
        return Err(Error::TooManyCells {
            size_m: (most - least).into(),
            cell_m,
            cells: cells as usize,
            most: options.max_cells,
        });
    }
    let size = [points.x as usize, points.y as usize, points.z as usize];
    let layer = size[0] * size[2];
    let mut field = Field { origin: first * cell_m, cell_m, size, values: vec![-1.0; layer * size[1]] };
    let all: Vec<u8> = (0..cones.len() as u8).collect();
    field.values.par_chunks_mut(layer * BLOCK).enumerate().for_each(|(slab, values)| {
        let mut slab =
            Slab { cones, origin: first * cell_m, cell_m, size, first_layer: slab * BLOCK, values };
        for z in (0..size[2]).step_by(BLOCK) {
            for x in (0..size[0]).step_by(BLOCK) {
                slab.carve([x, slab.first_layer, z], BLOCK, &all, options.tolerated);
            }
        }
    });
    Ok(field)
}

/// Some layers of the grid.
struct Slab<'a> {
    cones: &'a [Cone],
    origin: Vector3<f64>,
    cell_m: f64,
    size: [usize; 3],
    first_layer: usize,
    values: &'a mut [f32],
}

impl Slab<'_> {
    /// Fills the block of `side` points a side from point `first`. Of the cones, `open` are those that see it neither as all
    /// person nor as all background; `spare` more may see it as background.
    fn carve(&mut self, first: [usize; 3], side: usize, open: &[u8], spare: usize) {
        let end = [0, 1, 2].map(|axis| (first[axis] + side).min(self.size[axis]));
        if (0..3).any(|axis| first[axis] >= end[axis]) {
            return;
        }
        let middle = first.map(|index| index as f64 + (side - 1) as f64 / 2.0);
        let centre = self.origin + Vector3::from(middle) * self.cell_m;
        // one cell more on all sides: then the surface never passes between a point that is filled in and another
        let radius = (side + 1) as f64 / 2.0 * self.cell_m * 3f64.sqrt();
        let (mut still_open, mut count, mut spare) = ([0; super::MAX_VIEWS], 0, spare);
        for &cone in open {
            match self.cones[cone as usize].judge(&centre, radius) {
                Verdict::Outside if spare == 0 => return,
                Verdict::Outside => spare -= 1,
                Verdict::Inside => {}
                Verdict::Mixed => {
                    still_open[count] = cone;
                    count += 1;
                }
            }
        }
        let open = &still_open[..count];
        if count <= spare {
            self.fill(first, end, |_, _| 1.0);
        } else if side <= SMALLEST {
            self.fill(first, end, |slab, place| slab.inside_m(open, spare, place));
        } else {
            let half = side / 2;
            for octant in 0..8 {
                let child =
                    [0, 1, 2].map(|axis| first[axis] + if octant >> axis & 1 == 1 { half } else { 0 });
                self.carve(child, half, open, spare);
            }
        }
    }

    fn fill(&mut self, first: [usize; 3], end: [usize; 3], value: impl Fn(&Self, &Vector3<f64>) -> f64) {
        for y in first[1]..end[1] {
            for z in first[2]..end[2] {
                for x in first[0]..end[0] {
                    let place = self.origin + Vector3::new(x as f64, y as f64, z as f64) * self.cell_m;
                    let index = ((y - self.first_layer) * self.size[2] + z) * self.size[0] + x;
                    self.values[index] = value(self, &place) as f32;
                }
            }
        }
    }

    /// How far inside the hull a place is: what the cone says that remains when the `spare` least are left out.
    fn inside_m(&self, open: &[u8], spare: usize, place: &Vector3<f64>) -> f64 {
        let mut values = [f64::INFINITY; super::MAX_VIEWS];
        let kept = spare + 1;
        for &cone in open {
            let mut value = self.cones[cone as usize].inside_m(place);
            for slot in &mut values[..kept] {
                if value < *slot {
                    std::mem::swap(slot, &mut value);
                }
            }
        }
        values[spare]
    }
}
