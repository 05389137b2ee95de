//! Where the person is, and whether the views are of one person at one place.

use nalgebra::Vector3;
use vision::{HullOptions, HullView, Rasteriser, Topology, carve_hull};

use crate::{Error, Options, Result, observation::Observation};

/// Views needed.
const LEAST_VIEWS: usize = 2;
/// Least angle between the two views farthest apart, degrees.
const LEAST_ANGLE: f64 = 30.0;
/// More of an outline than this on the image's border: the view is cut.
const CUT: f64 = 0.02;
/// Cells of the hull, metres.
const CELL_M: f64 = 0.03;
/// Least share of each silhouette that the hull covers where calibration and silhouettes are right.
const COVERED: f64 = 0.85;
/// A mean share below this is no person that the views have in common.
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
    let all: Vec<usize> = (0..observations.len()).collect();
    let divided = observations.iter().filter(|view| view.second_region > SECOND);
    let share = divided.clone().map(|view| view.second_region).fold(0.0, f64::max);
    if 3 * divided.count() > observations.len() {
        return Err(Error::TwoPeople { share });
    }
    let (carved, covered) = carve(observations, &all, 0)?;
    let Some(carved) = carved else { return Err(Error::ViewsDoNotMeet { explained: 0.0 }) };
    let explained = covered.iter().sum::<f64>() / covered.len() as f64;
    if covered.iter().all(|&covered| covered >= COVERED) {
        return carved.place(all);
    }
    if carved.second > SECOND && carved.explained_by_all_pieces(explained) >= COVERED {
        return Err(Error::TwoPeople { share: carved.second });
    }
    if let (Some(without), covered) = carve(observations, &all, 1)?
        && let Some(bad) = without.left_out
        && all.iter().zip(&covered).all(|(&view, &covered)| view == bad || covered >= COVERED)
    {
        if !options.leave_out_bad_view {
            return Err(Error::ViewDisagrees { camera: observations[bad].camera.name.clone() });
        }
        return without.place(all.into_iter().filter(|&view| view != bad).collect());
    }
    if explained < LEAST_COVERED {
        return Err(Error::ViewsDoNotMeet { explained });
    }
    carved.place(all)
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

struct Carved {
    centroid: Vector3<f64>,
    height_m: f64,
    /// volume of the second piece as a share of the first
    second: f64,
    left_out: Option<usize>,
}

impl Carved {
    fn place(self, kept: Vec<usize>) -> Result<Place> {
        if !(0.5..2.8).contains(&self.height_m) {
            return Err(Error::Height { height_m: self.height_m });
        }
        if self.second > SECOND {
            return Err(Error::TwoPeople { share: self.second });
        }
        Ok(Place { centroid: self.centroid, kept })
    }

    /// A bound of the share that all pieces cover, from that of the first: the others are as large in the images as in space.
    fn explained_by_all_pieces(&self, explained: f64) -> f64 {
        explained * (1.0 + self.second)
    }
}

/// The hull, if there is any, and the share of each silhouette that its largest piece covers.
fn carve(
    observations: &[Observation],
    views: &[usize],
    leave_out: usize,
) -> Result<(Option<Carved>, Vec<f64>)> {
    let of_view = |&view: &usize| {
        let Observation { camera, silhouette, .. } = &observations[view];
        HullView { camera, silhouette }
    };
    let hull_views: Vec<_> = views.iter().map(of_view).collect();
    let options = HullOptions { cell_m: CELL_M, tolerated: 0, leave_out, ..HullOptions::default() };
    let hull = match carve_hull(&hull_views, &options) {
        Ok(hull) => hull,
        Err(vision::Error::EmptyHull { .. }) => return Ok((None, vec![0.0; views.len()])),
        Err(vision::Error::TooManyCells { size_m, .. }) => {
            return Err(Error::Height { height_m: size_m[1] });
        }
        Err(error) => return Err(Error::Hull(error)),
    };
    let topology = Topology::new(&hull.mesh.faces, hull.mesh.vertices.len());
    let mut rasteriser = Rasteriser::new();
    let covered = views.iter().map(|&view| {
        let (view, observed) = &observations[view].scoring;
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
    let carved = Carved {
        centroid: centroid(&hull.mesh.vertices, &hull.mesh.faces),
        height_m: high - low,
        second: hull.pieces_m3.get(1).map_or(0.0, |second| second / hull.pieces_m3[0]),
        left_out: hull.agreement.iter().position(|view| view.is_left_out).map(|at| views[at]),
    };
    Ok((Some(carved), covered))
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
