//! The HTTP gateway: people's way in.
//!
//! It keeps nothing itself. What people upload goes to the object store, what they ask for goes into PostgreSQL as a
//! run with its first job in one transaction, and what comes of it is read back from both. The API is described in
//! `docs/api.md` and, by the server itself, at `/openapi.json` and `/docs`.

pub mod access;
mod answer;
mod app;
mod changes;
mod config;
mod error;
mod extract;
mod files;
mod housekeeping;
mod idempotency;
mod json;
mod live;
mod lock;
mod names;
mod observe;
mod openapi;
mod page;
mod query;
mod refusal;
mod routes;
mod runs;
mod server;
mod sessions;
mod upload;
mod versioned;

pub use app::App;
pub use config::Config;
pub use error::Error;
pub use live::Replicas;
pub use names::{check_file_name, check_versioned_name};
pub use routes::{openapi_document, router};
pub use runs::{UNITS, session_run_fields, session_run_kinds};
pub use server::{Gateway, run};
