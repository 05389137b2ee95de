//! The `marey` command line: everything on one machine, the services one by one, and a client of the REST interface.
//!
//! The program is a library so that tests can start it as a process of its own.

mod cli;
mod client;
mod cmu;
mod connection;
mod database;
mod demo;
mod evaluate;
mod health;
mod keys;
mod pack;
mod results;
mod run;
mod sample;
mod serve;
mod status;
mod take;
mod up;
mod upload;
mod watch;

use std::process::ExitCode;

use clap::Parser;

/// Runs the command given on the command line.
pub fn main() -> ExitCode {
    match cli::run(cli::Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("marey: {error:#}");
            ExitCode::FAILURE
        }
    }
}
