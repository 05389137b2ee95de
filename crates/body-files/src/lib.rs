//! Bodies to and from files: the registered scans that people upload to learn a body model from, and bodies as GLB.
//!
//! [`ScanSet::read`] takes files by name and content, as archives have them: one OBJ or PLY a scan, or all in
//! `vertices.npy` with `faces.npy`; beside them, where there are any, a rig (`rig.json`), a skin (`skin_joints.npy`,
//! `skin_weights.npy`) and tables (`scans.csv`, `subjects.csv`). See `docs/body.md`.
//!
//! ```
//! let model = body::BodyModel::shipped();
//! let wanted = body::Wanted { stature_m: Some(1.80), mass_kg: Some(75.0), ..Default::default() };
//! let shape = model.shape(&model.alpha_for(&wanted)?);
//! let glb = body_files::glb(&model, &shape, None)?;
//! assert!(glb.starts_with(b"glTF"));
//! # Ok::<(), body_files::Error>(())
//! ```

mod error;
mod glb;
mod meshes;
mod scans;
mod shipped;
mod tables;
mod template;

pub use error::Error;
pub use glb::{Poses, glb};
pub use scans::{ScanOptions, ScanSet, is_used};
pub use shipped::{Shipped, shipped};

/// Result of this crate.
pub type Result<T> = std::result::Result<T, Error>;
