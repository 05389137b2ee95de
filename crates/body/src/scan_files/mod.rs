//! Registered scans out of the files that people upload to learn a body model from.
//!
//! [`ScanSet::read`] takes files by name and content, as archives have them: one OBJ or PLY a scan, or all in
//! `vertices.npy` with `faces.npy`; beside them, where there are any, a rig (`rig.json`), a skin (`skin_joints.npy`,
//! `skin_weights.npy`) and tables (`scans.csv`, `subjects.csv`). See `docs/body.md`.

mod file_use;
mod meshes;
mod rig;
mod set;
mod tables;

pub use file_use::is_part_of_scan_set;
pub use set::{ScanOptions, ScanSet};
