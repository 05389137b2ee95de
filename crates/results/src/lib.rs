//! The files that people get of a run, whatever its kind.
//!
//! [`formats`] has the one table of formats that every kind of run with a motion writes; a kind adds what is its own as
//! [`ResultFile`]s.
//! [`write`] writes them one after the other.

mod file;
mod positions;
mod run_json;
mod table;
mod write;

pub use file::ResultFile;
pub use positions::cell;
pub use run_json::run_json;
pub use table::{Body, Finished, Kind, formats};
pub use write::{write, write_one};
