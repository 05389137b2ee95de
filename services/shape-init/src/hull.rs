//! The visual hull of what cameras saw.

use model::{Camera, Silhouette};
use vision::{Hull, HullOptions, HullView, carve_hull};

use crate::InputError;

/// Carves the hull of views, with cells of `cell_m` metres. Views that nobody is in are left out; one that disagrees with the
/// others may be.
///
/// # Errors
/// If the views have nothing in common.
pub(crate) fn hull(views: &[(Camera, Silhouette)], cell_m: f64) -> Result<Hull, InputError> {
    let seen = views.iter().filter(|(_, silhouette)| silhouette.area() > 0);
    let views: Vec<HullView<'_>> = seen.map(|(camera, silhouette)| HullView { camera, silhouette }).collect();
    Ok(carve_hull(&views, &HullOptions { cell_m, ..HullOptions::default() })?)
}
