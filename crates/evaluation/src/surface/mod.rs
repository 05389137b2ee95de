//! Distances between points and the surfaces of meshes.

mod closest;
mod sampling;
mod statistics;

pub use closest::{Closest, Surface};
pub use sampling::sample_surface;
pub use statistics::{DistanceStatistics, SurfaceComparison, compare_surfaces};
