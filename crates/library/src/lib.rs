//! The library of what was learned: motion databases out of the object store, checked, mapped or read, whole or in shards; and
//! the [`Cache`] in which services keep what they opened.

mod cache;
pub mod motion_database;
mod threads;

pub use cache::Cache;
pub use threads::AllCores;
