//! Acclaim skeletons (ASF).

mod bones;
mod read;
mod sections;
mod tree;
mod write;

use std::sync::Arc;

use model::Skeleton;

pub(crate) use bones::{Bone, bones};
pub use read::read;
pub use write::write;

/// Metres per file unit of the CMU database: one unit is 1/0.45 inch.
pub const CMU_METRES_PER_UNIT: f64 = 0.0254 / 0.45;

/// What an ASF file says: the skeleton, and the unit in which its AMC files give translations.
#[derive(Debug, Clone, PartialEq)]
pub struct File {
    /// the skeleton, in metres; its DOFs are in the order of the bones, of each bone in the order of its `dof` line
    pub skeleton: Arc<Skeleton>,
    /// length of one unit of the ASF and its AMC files
    pub metres_per_unit: f64,
}
