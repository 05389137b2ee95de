//! The morphable body: a mesh whose shape was learned from registered scans, a skeleton inside it, and a skin that follows
//! the skeleton (docs/papers.md#morphable-model, eq. 1).
//!
//! `M(α) = m₀ + Σ α_i m_i`: up to 20 principal components, α in standard deviations of the population. The joints are a
//! linear function of the vertices, so they follow the shape. A pose has 22 degrees of freedom: 6 of the root and 16
//! angles. Vertices are moved by linear blend skinning with at most four joints a vertex.
//!
//! Convention: metres, radians, y up; in its rest pose the body faces +z and its left is +x. For joint j with rest position
//! h_j and rotation R_j, the product of the rotations of its DOFs in their order about axes of the rest pose,
//!
//! ```text
//! A_j = A_parent · T(h_j) · R_j · T(−h_j),     A_root = T(t) · T(h) · exp(r) · T(−h),     vertex = Σ_k w_k A_k v
//! ```
//!
//! Scans are read by [`ScanSet`], bodies are written by [`glb()`]:
//!
//! ```
//! let model = body::BodyModel::shipped();
//! let wanted = body::Wanted { stature_m: Some(1.80), mass_kg: Some(75.0), ..Default::default() };
//! let shape = model.shape(&model.alpha_for(&wanted)?);
//! let glb = body::glb(&model, &shape, None)?;
//! assert!(glb.starts_with(b"glTF"));
//! # Ok::<(), body::Error>(())
//! ```

mod density;
mod error;
mod extremes;
mod file;
mod glb;
mod heat;
mod jacobian;
mod learn;
mod limb;
mod measure;
mod mesh_check;
mod motion;
mod population;
mod pose;
mod procrustes;
mod registered;
mod regressor;
mod rig;
mod rig_json;
mod scan_files;
mod shape;
mod shipped;
mod skin;
mod skinned;
mod subject;
mod template;
mod wanted;

pub use density::DENSITY_KG_M3;
pub use error::Error;
pub use file::MAX_BYTES;
pub use glb::{Poses, glb};
pub use heat::heat_skin;
pub use jacobian::ShapeDrift;
pub use learn::{Aligned, Alignment, LearnOptions, Learned, Scan, learn, unpose};
pub use limb::Limb;
pub use measure::Measurements;
pub use pose::Posed;
pub use registered::{RegisteredFit, RegisteredOptions, fit_registered};
pub use regressor::JointRegressor;
pub use rig::{Dof, DofKind, ROOT_DOFS, Rig, RigJoint};
pub use rig_json::RigFile;
pub use scan_files::{ScanOptions, ScanSet, is_part_of_scan_set};
pub use shape::{BodyModel, MAX_COMPONENTS, MAX_VERTICES, ModelParts, Shape};
pub use shipped::{Shipped, shipped};
pub use skin::Skin;
pub use subject::{Sex, Subject, UnknownSex};
pub use template::{KnownJoints, Template, TemplateParts};
pub use wanted::{MAX_DEVIATIONS, Wanted};

/// Result of the fallible functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;
