//! The vocabulary of Marey: skeletons, poses, motions, point trajectories; cameras, pictures, silhouettes,
//! matches of points and meshes.
//!
//! Units inside the program: metres, seconds, radians; y is up; coordinates are right-handed. Files in
//! other units are converted when they are read and written (crate `formats`).
//! Transforms are named `a_from_b`, so that spaces cancel.
//!
//! ```
//! use model::{Axis, Channel, Joint, Motion, Skeleton};
//! let root = Joint::root("hips", vec![Channel::translation(Axis::Y), Channel::rotation(Axis::X)]);
//! let skeleton = Skeleton::new("two numbers", vec![root]).unwrap();
//! let motion = Motion::new(skeleton.into(), 60.0, vec![0.9, 0.1, 0.9, 0.2]).unwrap();
//! assert_eq!(motion.num_frames(), 2);
//! ```

mod camera;
mod error;
mod image;
mod joint;
mod mesh;
mod motion;
mod point_match;
mod points;
mod record;
mod shown;
mod silhouette;
mod skeleton;

pub use camera::{Camera, Distortion};
pub use error::Error;
pub use image::Image;
pub use joint::{Axis, Channel, ChannelKind, Joint, UnknownAxis};
pub use mesh::Mesh;
pub use motion::Motion;
pub use point_match::PointMatch;
pub use points::{PointTrajectories, Samples};
pub use record::SkeletonRecord;
pub use shown::{counted, shown, shown_rate};
pub use silhouette::Silhouette;
pub use skeleton::Skeleton;

/// Result of the constructors of this crate.
pub type Result<T> = std::result::Result<T, Error>;
