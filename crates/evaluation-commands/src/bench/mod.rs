//! `marey bench`: how fast the parts are, on motion of your own.

mod live;
mod reconstruct;
mod search;

/// `marey bench`
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    Reconstruct(Box<reconstruct::Args>),
    /// Search windows of held-out motion in a database: compare exact with fast search
    Search(Box<search::Args>),
    Live(Box<live::Args>),
}

/// Runs `marey bench`.
pub fn run(args: Args) -> anyhow::Result<()> {
    match args.what {
        What::Reconstruct(args) => reconstruct::run(&args),
        What::Search(args) => search::run(&args),
        What::Live(args) => live::run(&args),
    }
}
