//! The command line, as `marey --help` tells it.

use clap::{Parser, Subcommand};
use evaluation_commands::{bench, evaluate};

use crate::{
    body, cmu, database, demo, health, keys, live, marker_sets, results, run, sample, sample_capture, serve,
    status, up, upload,
};

/// Full-body motion from a few control points.
///
/// You measured a few points of a moving person (wrists, ankles, head, …) and want the whole body: Marey finds the most
/// probable motion, learned from recordings like it, and gives it to you as BVH for Blender, Maya or Unity, as AMC and as CSV.
#[derive(Debug, Parser)]
#[command(name = "marey", version, max_term_width = 100, after_help = EXAMPLES)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "\
See it work, without any data of your own:
  marey demo

First session:
  marey up                                      start everything; leave it running
  marey db build walks recordings/ --watch      learn from a folder of ASF+AMC or BVH files
  marey upload \"take 3\" points.csv skeleton.asf
  marey run \"take 3\" --database walks --watch
  marey results RUN -o take3/                   then open take3/motion.bvh

A body from calibrated cameras:
  marey upload \"take 4\" calib.toml cam*.mp4 plates/
  marey run \"take 4\" --watch

Commands that talk to a server find one started by `marey up` in this folder or above. For another:
  export MAREY_URL=https://mocap.example MAREY_API_KEY=mk_…";

#[derive(Debug, Subcommand)]
enum Command {
    Demo(demo::Args),
    Up(up::Args),
    /// Build and list motion databases: the recordings that Marey learns from
    #[command(subcommand)]
    Db(database::Command),
    /// Learn, list and sample body models: the bodies that people may have
    #[command(subcommand)]
    Body(body::Command),
    Upload(upload::Args),
    Run(Box<run::Args>),
    Markers(marker_sets::Args),
    Results(results::Args),
    Status(status::Args),
    Cancel(status::CancelArgs),
    Live(live::Args),
    /// Measure how well motion is reconstructed, on recordings of your own
    Evaluate(evaluate::Args),
    /// Measure how fast the parts are, on recordings of your own
    Bench(bench::Args),
    Sample(sample::Args),
    SampleCapture(sample_capture::Args),
    /// Get recorded motion from public collections
    #[command(subcommand)]
    Data(Data),
    /// Run one service, configured by MAREY_… variables
    #[command(subcommand)]
    Serve(serve::Service),
    Migrate(keys::MigrateArgs),
    /// Make API keys
    #[command(subcommand)]
    Key(keys::Command),
    Health(health::Args),
}

#[derive(Debug, Subcommand)]
enum Data {
    Cmu(cmu::Args),
}

/// Runs one command.
pub fn run(cli: Cli) -> anyhow::Result<()> {
    match cli.command {
        Command::Demo(args) => demo::run(&args),
        Command::Up(args) => up::run(&args),
        Command::Db(command) => database::run(&command),
        Command::Body(command) => body::run(&command),
        Command::Upload(args) => upload::run(&args),
        Command::Run(args) => run::run(&args),
        Command::Markers(args) => marker_sets::run(&args),
        Command::Results(args) => results::run(&args),
        Command::Status(args) => status::run(&args),
        Command::Cancel(args) => status::cancel(&args),
        Command::Live(args) => live::run(&args),
        Command::Evaluate(args) => evaluate::run(args),
        Command::Bench(args) => bench::run(args),
        Command::Sample(args) => sample::run(&args),
        Command::SampleCapture(args) => sample_capture::run(&args),
        Command::Data(Data::Cmu(args)) => cmu::run(&args),
        Command::Serve(service) => serve::run(&service),
        Command::Migrate(args) => keys::migrate(&args),
        Command::Key(command) => keys::run(&command),
        Command::Health(args) => health::run(&args),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        super::Cli::command().debug_assert();
    }
}
