//! The commands `marey evaluate` and `marey bench`: how good and how fast reconstructions are, on recordings of one's own.
//!
//! What is computed is in the crate `evaluation`; here files are read, commands parsed, and tables written.

pub mod bench;
pub mod evaluate;
mod motions;
mod progress;
