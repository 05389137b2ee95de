//! Where the person is, and whether the views are of one person at one place.

use nalgebra::{Matrix3, Vector2, Vector3};
use vision::{HullOptions, HullView, Rasteriser, Topology, carve_hull};

use crate::{Error, Options, Result, observation::Observation};

/// Views needed.
const LEAST_VIEWS: usize = 2;
/// Least angle between the two views farthest apart, degrees.
const LEAST_ANGLE: f64 = 30.0;
/// More of an outline than this on the image's border: the view is cut.
const CUT: f64 = 0.02;
/// From this number of views on, the hull is what all but one see.
const TOLERANT: usize = 4;
/// Heights of people, with an arm up or sitting low, metres.
const HEIGHTS_M: std::ops::RangeInclusive<f64> = 0.5..=2.8;
/// Heights that may be a person's where nothing is known yet, metres.
const ROUGH_HEIGHTS_M: std::ops::RangeInclusive<f64> = 0.3..=4.0;
/// Cells of the hull, metres.
const CELL_M: f64 = 0.03;
/// Least share of each silhouette that the hull covers where calibration and silhouettes are right.
const COVERED: f64 = 0.85;
/// Below this mean share the views have no person in common.
const LEAST_COVERED: f64 = 0.75;
/// Volume of the second piece, as a share of the first, or area of the second region of a silhouette, above which there are
/// two people.
const SECOND: f64 = 0.25;

/// What the coarse hull tells.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// centre of the hull's volume, metres
    pub centroid: Vector3<f64>,
    /// indices of the observations that agree with each other
    pub kept: Vec<usize>,
}

/// Carves the hull of these views.
pub fn locate(observations: &[Observation], options: &Options) -> Result<Place> {
    check_views(observations)?;
    // a hull of the wrong unit would be too large to be carved
    if let Some(height_m) = rough_height(observations).filter(|height| !ROUGH_HEIGHTS_M.contains(height)) {
        return Err(Error::Height { height_m });
    }
    let all: Vec<usize> = (0..observations.len()).collect();
    let divided = observations.iter().filter(|view| view.second_region > SECOND);
    let share = divided.clone().map(|view| view.second_region).fold(0.0, f64::max);
    if 3 * divided.count() > observations.len() {
        return Err(Error::TwoPeople { share });
    }
    let Some(carved) = carve(observations)? else { return Err(Error::ViewsDoNotMeet { explained: 0.0 }) };
    let explained = carved.covered.iter().sum::<f64>() / carved.covered.len() as f64;
    if carved.second > SECOND && explained * (1.0 + carved.second) >= COVERED {
        return Err(Error::TwoPeople { share: carved.second });
    }
    let (kept, bad): (Vec<usize>, Vec<usize>) =
        all.into_iter().partition(|&view| carved.covered[view] >= COVERED);
    match bad[..] {
        [] => {}
        [view] if kept.len() > LEAST_VIEWS => {
            if !options.leave_out_bad_view {
                return Err(Error::ViewDisagrees { camera: observations[view].camera.name.clone() });
            }
        }
        _ if explained < LEAST_COVERED => return Err(Error::ViewsDoNotMeet { explained }),
        _ => return carved.place((0..observations.len()).collect()),
    }
    carved.place(kept)
}

fn check_views(observations: &[Observation]) -> Result<()> {
    if observations.is_empty() {
        return Err(Error::Nobody);
    }
    if observations.len() < LEAST_VIEWS {
        return Err(Error::TooFewViews { found: observations.len(), least: LEAST_VIEWS });
    }
    let directions: Vec<_> = observations.iter().map(|view| view.camera.direction()).collect();
    // looking from opposite sides shows the same outline
    let apart = |a: &Vector3<f64>, b: &Vector3<f64>| a.cross(b).norm().atan2(a.dot(b).abs());
    let pairs = directions.iter().enumerate().flat_map(|(i, a)| directions[..i].iter().map(move |b| (a, b)));
    let degrees = pairs.map(|(a, b)| apart(a, b)).fold(0.0, f64::max).to_degrees();
    if degrees < LEAST_ANGLE {
        return Err(Error::SameSide { degrees });
    }
    if observations.iter().filter(|view| view.cut <= CUT).count() < LEAST_VIEWS {
        let least = observations.iter().min_by(|a, b| a.cut.total_cmp(&b.cut));
        return Err(Error::CutOff { camera: least.map_or(String::new(), |view| view.camera.name.clone()) });
    }
    Ok(())
}

/// Median height of the silhouettes at the place that is nearest to all rays through their middles, metres; `None` if the
/// rays are parallel.
fn rough_height(observations: &[Observation]) -> Option<f64> {
    let (mut matrix, mut sum) = (Matrix3::zeros(), Vector3::zeros());
    for Observation { camera, silhouette, .. } in observations {
        let [left, top, right, bottom] = silhouette.bounds()?.map(|side| side as f64 / 2.0);
        let Some(ray) = camera.ray(Vector2::new(left + right, top + bottom)) else { continue };
        let across = Matrix3::identity() - ray * ray.transpose();
        matrix += across;
        sum += across * camera.position();
    }
    let middle = matrix.try_inverse()? * sum;
    let height = |observation: &Observation| {
        let camera = &observation.camera;
        let depth = (middle - camera.position()).dot(&camera.direction());
        let [_, top, _, bottom] = observation.silhouette.bounds()?;
        Some(depth.abs() * (bottom - top) as f64 / camera.focal.y)
    };
    let mut heights: Vec<f64> = observations.iter().filter_map(height).collect();
    heights.sort_by(f64::total_cmp);
    heights.get(heights.len() / 2).copied()
}

struct Carved {
    centroid: Vector3<f64>,
    height_m: f64,
    /// volume of the second piece as a share of the first
    second: f64,
    /// share of each silhouette that the largest piece covers
    covered: Vec<f64>,
}

impl Carved {
    fn place(self, kept: Vec<usize>) -> Result<Place> {
        if !HEIGHTS_M.contains(&self.height_m) {
            return Err(Error::Height { height_m: self.height_m });
        }
        if self.second > SECOND {
            return Err(Error::TwoPeople { share: self.second });
        }
        Ok(Place { centroid: self.centroid, kept })
    }
}

/// The hull, if there is any. Where there are enough views, what all but one see is kept: a hole in one silhouette must not
/// cut through the body, and a camera that was moved shows by what it sees where nothing is.
fn carve(observations: &[Observation]) -> Result<Option<Carved>> {
    let views: Vec<_> = observations
        .iter()
        .map(|Observation { camera, silhouette, .. }| HullView { camera, silhouette })
        .collect();
    let tolerated = usize::from(observations.len() >= TOLERANT);
    let options = HullOptions { cell_m: CELL_M, tolerated, leave_out: 0, ..HullOptions::default() };
    let hull = match carve_hull(&views, &options) {
        Ok(hull) => hull,
        Err(vision::Error::EmptyHull { .. }) => return Ok(None),
        Err(vision::Error::TooManyCells { size_m, .. }) => {
            return Err(Error::Height { height_m: size_m[1] });
        }
        Err(error) => return Err(Error::Hull(error)),
    };
    let topology = Topology::new(&hull.mesh.faces, hull.mesh.vertices.len());
    let mut rasteriser = Rasteriser::new();
    let covered = observations.iter().map(|observation| {
        let (view, observed) = &observation.scoring;
        let mut drawn = model::Silhouette::empty(view.size[0], view.size[1]);
        rasteriser.silhouette(view, &hull.mesh.vertices, &topology, &mut drawn);
        let both = drawn.words().iter().zip(observed.silhouette().words());
        let both: u32 = both.map(|(a, b)| (a & b).count_ones()).sum();
        f64::from(both) / observed.silhouette().area().max(1) as f64
    });
    let covered = covered.collect();
    let heights = hull.mesh.vertices.iter().map(|vertex| vertex.y);
    let [low, high] =
        heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], y| [low.min(y), high.max(y)]);
    Ok(Some(Carved {
        centroid: centroid(&hull.mesh.vertices, &hull.mesh.faces),
        height_m: high - low,
        second: hull.pieces_m3.get(1).map_or(0.0, |second| second / hull.pieces_m3[0]),
        covered,
    }))
}

/// Centre of the volume of a closed mesh, metres.
pub fn centroid(vertices: &[Vector3<f64>], faces: &[[u32; 3]]) -> Vector3<f64> {
    let Some(origin) = vertices.first() else { return Vector3::zeros() };
    let (mut sum, mut volume) = (Vector3::zeros(), 0.0);
    for face in faces {
        let [a, b, c] = face.map(|corner| vertices[corner as usize] - origin);
        let six_times = a.dot(&b.cross(&c));
        sum += (a + b + c) * (six_times / 4.0);
        volume += six_times;
    }
    if volume.abs() > 1e-12 { origin + sum / volume } else { *origin }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_centre_of_a_tetrahedron_is_the_mean_of_its_corners() {
        let far = Vector3::new(3.0, -2.0, 7.0);
        let vertices = [far, far + Vector3::x(), far + Vector3::y(), far + Vector3::z()];
        let found = centroid(&vertices, &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]);
        assert!((found - vertices.iter().sum::<Vector3<f64>>() / 4.0).norm() < 1e-12);
    }
}
