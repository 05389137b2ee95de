use model::shown;

/// What keeps a computation on silhouettes and meshes from a result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A hull needs views from at least two sides.
    #[error("found {found} views, expected at least 2")]
    TooFewViews {
        /// views found
        found: usize,
    },
    /// A silhouette is not of the size of its camera's image.
    #[error("the silhouette of camera {camera} has {found:?} pixels, its calibration says {expected:?}")]
    SilhouetteSize {
        /// name of the camera
        camera: String,
        /// width and height of the silhouette
        found: [usize; 2],
        /// width and height of the camera's image
        expected: [usize; 2],
    },
    /// Nobody is in a silhouette.
    #[error("the silhouette of camera {camera} is empty, expected a person")]
    EmptySilhouette {
        /// name of the camera
        camera: String,
    },
    /// No place in space is seen by all cameras.
    #[error(
        "the silhouettes of the {views} cameras have no place in common, even if {tolerated} may disagree: calibration and silhouettes don't fit"
    )]
    EmptyHull {
        /// views that may disagree
        tolerated: usize,
        /// number of views
        views: usize,
    },
    /// The cells are so small, or the hull is so large, that they would take too much memory.
    #[error("a hull of {size_m:?} m has {cells} cells of {cell_m} m, expected at most {most}")]
    TooManyCells {
        /// extents of the hull
        size_m: [f64; 3],
        /// side of a cell
        cell_m: f64,
        /// cells in its box
        cells: usize,
        /// cells allowed
        most: usize,
    },
    /// A parameter out of range.
    #[error("{name} is {}, expected {expected}", shown(*found))]
    Parameter {
        /// its name
        name: &'static str,
        /// its value
        found: f64,
        /// what it should be
        expected: &'static str,
    },
}
