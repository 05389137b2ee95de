//! File formats of motion, markers, cameras, meshes and pictures: bytes to model and back.
//!
//! Readers take bytes and give a [`Read`]: the value, in metres, seconds and radians with y up, and the warnings about
//! what was doubtful in the file (only the value, where nothing can be). What can't be read is an [`Error`] that says
//! where (line or byte offset), what was found and what was expected. Readers never panic and need memory in
//! proportion to the bytes they are given, whatever the bytes claim; pictures, which are packed, have limits of their
//! own. The dialects are described in `docs/formats.md`.
//!
//! ```
//! let asf = b":units\n length 0.45\n angle deg\n:root\n order TX TY TZ RX RY RZ\n axis XYZ\n:bonedata\n:hierarchy\n";
//! let acclaim = formats::asf::read(asf).unwrap().value;
//! let motion = formats::amc::read(b":DEGREES\n1\nroot 0 17 0 0 90 0\n", &acclaim, 120.0).unwrap().value;
//! assert!((motion.pose(0)[1] - 17.0 * 0.0254 / 0.45).abs() < 1e-12);
//! ```

pub mod amc;
pub mod archive;
pub mod asf;
pub mod bvh;
pub mod c3d;
pub mod calibration;
mod error;
mod euler;
mod extension;
mod file_role;
mod frame_rate;
pub mod glb;
pub mod image_files;
pub mod media_type;
pub mod mesh_files;
pub mod motion_csv;
pub mod motion_files;
pub mod npy;
pub mod obj;
pub mod ply;
mod points;
pub mod points_csv;
mod read;
pub mod session;
mod text;
mod time_grid;
pub mod trc;

pub use bvh::Options as BvhOptions;
pub use error::{Error, Place};
pub use file_role::{FileRole, NotInSession, UnknownFileRole};
pub use points::PointsOptions;
pub use read::{Read, Warning};

/// Result of the readers.
pub type Result<T> = std::result::Result<T, Error>;
