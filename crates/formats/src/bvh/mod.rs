//! BVH: a skeleton and its motion in one text file.

mod hierarchy;
mod read;
mod write;

pub use read::read;
pub use write::write;

/// What a BVH file doesn't say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// length of one unit; by default 0.01, as most programs write centimetres
    pub metres_per_unit: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { metres_per_unit: 0.01 }
    }
}
