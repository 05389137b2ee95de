//! The rows of motion databases and body models, as far as services read and write them: versions that are ready are found,
//! those that were built become ready. What people make, list and delete of them is the gateway's.

pub mod body_models;
mod built;
pub mod motion_databases;
mod sql;

pub use built::Built;
