//! The `marey` command line: everything on one machine, the services one by one, and a client of the REST interface.
//!
//! The program is a library so that tests can start it as a process of its own.

#[cfg(test)]
mod alone;
mod body;
mod cli;
mod cmu;
mod database;
mod database_show;
mod demo;
mod folders;
mod health;
mod keys;
mod live;
mod marker_sets;
mod pack;
mod results;
mod run;
mod sample;
mod sample_capture;
mod serve;
mod session_files;
mod status;
mod take;
mod up;
mod upload;
mod watch;
mod words;

use std::process::ExitCode;

use clap::Parser;
use jobs::run_json::Code;

/// This program: its version, and the commit that it was built from, where the build knew it.
pub const CODE: Code = Code::from_commit(option_env!("MAREY_BUILT_COMMIT"));

/// Runs the command given on the command line.
pub fn main() -> ExitCode {
    end_quietly_on_a_closed_pipe();
    match cli::run(cli::Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("marey: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// `marey status | head -1` closes our output while we write: that is no fault worth a report. The standard library panics
/// there.
fn end_quietly_on_a_closed_pipe() {
    let report = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let message = panic.payload_as_str().unwrap_or_default();
        if message.starts_with("failed printing to stdout") && message.contains("Broken pipe") {
            #[expect(clippy::disallowed_methods, reason = "a hook for panics can't return to main")]
            std::process::exit(0);
        }
        report(panic);
    }));
}
