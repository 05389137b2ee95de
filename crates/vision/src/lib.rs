//! Geometry of silhouettes: from meshes and cameras to images, and from images of several cameras back to space.
//!
//! - [`View`], [`Topology`], [`Rasteriser`], [`DepthBuffer`]: meshes drawn through cameras.
//! - [`contours`], [`DistanceField`]: outlines of silhouettes, and how far from them everything is.
//! - [`find_rim`]: the points of a mesh that make its outline.
//! - [`Chamfer`], [`overlap_in`]: how much two silhouettes differ.
//! - [`carve_hull`]: the visual hull of several views, and which view disagrees with the others.
//! - [`scene`]: synthetic captures and their noise.
//!
//! Metres and y up in the world; pixels in images, (0, 0) is the centre of the top-left one (`docs/vision.md`).
//!
//! ```
//! use model::{Camera, Silhouette};
//! use nalgebra::{Isometry3, Vector2, Vector3};
//! let camera = Camera {
//!     name: "front".into(),
//!     size: [100, 100],
//!     focal: Vector2::repeat(100.0),
//!     principal: Vector2::repeat(49.5),
//!     distortion: Default::default(),
//!     camera_from_world: Isometry3::translation(0.0, 0.0, 2.0),
//! };
//! // a triangle two metres away; half a metre is 25 pixels there
//! let vertices = [Vector3::zeros(), Vector3::new(0.5, 0.0, 0.0), Vector3::new(0.0, 0.5, 0.0)];
//! let topology = vision::Topology::new(&[[0, 1, 2]], vertices.len());
//! let mut silhouette = Silhouette::empty(100, 100);
//! let view = vision::View::new(&camera);
//! let bounds = vision::Rasteriser::new().silhouette(&view, &vertices, &topology, &mut silhouette);
//! assert_eq!(bounds, Some([50, 50, 74, 74]));
//! ```

mod chamfer;
mod contour;
mod depth;
mod distance;
mod error;
mod hull;
mod raster;
mod rim;
pub mod scene;
mod topology;
mod view;

pub use chamfer::{Chamfer, Difference, Observed, overlap_in};
pub use contour::{Contour, ContourOptions, ContourPoint, contours};
pub use depth::DepthBuffer;
pub use distance::{DistanceField, reduced};
pub use error::Error;
pub use hull::{Agreement, Hull, HullOptions, HullView, carve_hull};
pub use raster::Rasteriser;
pub use rim::{RimPoint, find_rim};
pub use topology::{Edge, Topology};
pub use view::{View, reduced_pixel};
