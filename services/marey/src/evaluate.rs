//! `marey evaluate`: how far reconstructions are from the truth.

pub(crate) mod motions;
mod papers;
mod sparse_command;

/// `marey evaluate`
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    /// Reconstruct recorded motion from a few of its own points, and compare
    Sparse(Box<sparse_command::Args>),
}

/// Runs `marey evaluate`.
pub fn run(args: Args) -> anyhow::Result<()> {
    match args.what {
        What::Sparse(args) => sparse_command::run(&args),
    }
}
