//! What every service process shares: configuration, telemetry, health, shutdown, and the frame that runs
//! a gRPC server beside a worker loop.
//!
//! A service reads a [`Config`] once, calls [`telemetry::start`], and hands its gRPC routes and its worker
//! to [`start`]. Tests and `marey up` do the same in one process.

pub mod compute;
pub mod config;
pub mod database;
mod error;
mod file_error;
mod health;
pub mod log_format;
mod making_versions;
pub mod objects;
mod resources;
mod server;
pub mod shutdown;
pub mod telemetry;
mod variables;

pub use config::Config;
pub use error::Error;
pub use file_error::FileError;
pub use making_versions::MakesVersion;
pub use resources::Resources;
pub use server::{Parts, Running, start};
