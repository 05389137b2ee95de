//! The library of what was learned: body models out of the object store; motion databases, checked, mapped or read, whole or in
//! shards; and the [`Cache`] in which services keep what they opened.

pub mod body_model;
mod cache;
pub mod motion_database;
mod threads;

pub use cache::Cache;
pub use threads::AllCores;
