//! A client of the gateway: its REST interface ([`Client`]), its live streams ([`live`]), and which server is meant.

mod in_options;
mod latency;
pub mod live;
pub mod numbers;
pub mod outputs;
pub mod parameters;
mod request;
mod rest;
mod server;
mod server_args;

pub use latency::Latency;
pub use request::Request;
pub use rest::{Client, Jobs, MotionDatabase, Page, ResultFile, Run, Session, encode};
pub use server::{DEFAULT_DATA_DIR, Server};
pub use server_args::ServerArgs;
