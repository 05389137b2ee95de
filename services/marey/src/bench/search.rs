use std::path::PathBuf;

use motion_db::{MotionDatabase, WindowIndex};

use crate::evaluate::motions;

/// `marey bench search`
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folders of motion for the database: ASF+AMC or BVH, also .zst
    #[arg(long, required = true, num_args = 1.., value_name = "DIR")]
    train: Vec<PathBuf>,
}

/// Runs `marey bench search`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let database = MotionDatabase::build(&motions::read(&args.train)?)?;
    println!("{} windows", WindowIndex::new(&database, 2)?.num_rows());
    Ok(())
}
