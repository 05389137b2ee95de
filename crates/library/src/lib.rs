//! The library of what was learned: body models out of the object store; motion databases, checked, mapped or read, whole or in
//! shards; the [`versions`] of both that are ready, and how one gets ready; and the [`Cache`] in which services keep what they
//! opened.

pub mod body_model;
mod cache;
pub mod motion_database;
mod threads;
pub mod versions;

pub use cache::Cache;
pub use threads::AllCores;
