//! The visual hull: all of space that every camera sees as the person (Laurentini 1994;
//! docs/papers.md#other-sources), carved by an octree and returned as a closed surface.

mod agreement;
mod bounds;
mod components;
mod cone;
mod cube;
mod field;
mod marching_cubes;

use model::{Camera, Mesh, Silhouette};
use rayon::prelude::*;

pub use agreement::Agreement;

use crate::Error;
use agreement::carve_coarsely;
use bounds::root_cube;
use components::largest_component;
use cone::Cone;
use field::carve_finely;
use marching_cubes::surface_of;

/// A silhouette and the camera that saw it.
#[derive(Debug, Clone, Copy)]
pub struct HullView<'a> {
    /// the camera
    pub camera: &'a Camera,
    /// what it saw, of the size of its image
    pub silhouette: &'a Silhouette,
}

/// How a hull is carved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HullOptions {
    /// side of a cell, metres
    pub cell_m: f64,
    /// a place is kept if all but this many views see it
    pub tolerated: usize,
    /// at most this many views that disagree with the others are left out (see [`Agreement`])
    pub leave_out: usize,
    /// most cells of the box around the hull; one takes four bytes
    pub max_cells: usize,
}

impl Default for HullOptions {
    fn default() -> Self {
        Self { cell_m: 0.005, tolerated: 0, leave_out: 1, max_cells: 60_000_000 }
    }
}

/// A visual hull.
#[derive(Debug, Clone, PartialEq)]
pub struct Hull {
    /// surface of its largest piece, metres; closed, faces look outwards
    pub mesh: Mesh,
    /// volumes of its pieces of at least a thousandth of the largest, cubic metres, largest first. A second one of some size is a second person, or a ghost
    /// where cones of different people meet
    pub pieces_m3: Vec<f64>,
    /// how well each view agrees with the others, in the order of the views
    pub agreement: Vec<Agreement>,
}

/// Most views at a time.
const MAX_VIEWS: usize = 64;

/// Carves the hull of these views.
///
/// Where a silhouette touches the border of its image, what lies beyond the border is judged by the border: the person goes
/// on there. Elsewhere, places outside an image are outside the hull.
///
/// # Errors
/// [`Error::TooFewViews`], [`Error::SilhouetteSize`], [`Error::EmptySilhouette`], [`Error::Parameter`],
/// [`Error::EmptyHull`] if the views have nothing in common, [`Error::TooManyCells`] if cells are too small.
pub fn carve_hull(views: &[HullView<'_>], options: &HullOptions) -> Result<Hull, Error> {
    check(views, options)?;
    let mut cones: Vec<Cone> = views.par_iter().map(|view| Cone::new(view)).collect();
    let root = root_cube(&cones);
    let mut agreement = vec![Agreement::default(); views.len()];
    // cones that are left, as indices of views
    let mut kept: Vec<usize> = (0..views.len()).collect();
    let bounds = loop {
        let coarse = carve_coarsely(&cones, &root, options);
        let left_out = views.len() - kept.len();
        for (&view, coarse_agreement) in kept.iter().zip(&coarse.agreement) {
            agreement[view] = *coarse_agreement;
        }
        match coarse.worst {
            Some(worst) if left_out < options.leave_out && cones.len() > 3 + options.tolerated => {
                agreement[kept.remove(worst)].is_left_out = true;
                cones.remove(worst);
            }
            _ => break coarse.bounds,
        }
    };
    let empty = Error::EmptyHull { tolerated: options.tolerated, views: views.len() };
    let Some(bounds) = bounds else { return Err(empty) };
    let field = carve_finely(&cones, bounds, options)?;
    let (mesh, pieces_m3) = largest_component(surface_of(&field));
    if mesh.faces.is_empty() {
        return Err(empty);
    }
    Ok(Hull { mesh, pieces_m3, agreement })
}

fn check(views: &[HullView<'_>], options: &HullOptions) -> Result<(), Error> {
    let found = views.len();
    if found < 2 {
        return Err(Error::TooFewViews { found });
    }
    if found > MAX_VIEWS {
        return Err(Error::Parameter {
            name: "number of views",
            found: found as f64,
            expected: "at most 64",
        });
    }
    for view in views {
        let (silhouette, camera) = (view.silhouette, view.camera.name.clone());
        let found = [silhouette.width(), silhouette.height()];
        let expected = view.camera.size.map(|side| side as usize);
        if found != expected {
            return Err(Error::SilhouetteSize { camera, found, expected });
        }
        if silhouette.bounds().is_none() {
            return Err(Error::EmptySilhouette { camera });
        }
    }
    if !(options.cell_m >= 1e-4 && options.cell_m <= 1.0) {
        let expected = "0.0001 to 1 m";
        return Err(Error::Parameter { name: "cell_m", found: options.cell_m, expected });
    }
    if options.tolerated + 2 > views.len() {
        let expected = "fewer, so that at least two views see the hull";
        return Err(Error::Parameter { name: "tolerated", found: options.tolerated as f64, expected });
    }
    Ok(())
}
