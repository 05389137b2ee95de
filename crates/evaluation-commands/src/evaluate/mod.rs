//! `marey evaluate`: how far reconstructions are from the truth.

mod body_commands;
mod capture;
mod ik;
mod multiview;
mod overlay;
mod recovery;
mod run_command;
mod run_joints;
mod run_truth;
mod shape;
mod sparse_command;
mod sweep;
mod written;

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
    /// Fit skeletons to performers as if theirs were not known, and compare
    Skeleton(body_commands::Args),
    /// Hold standing feet in reconstructed motion, and compare
    Feet(body_commands::Args),
    /// Compare the motion that a run found with the true motion
    Run(run_command::Args),
    /// Find elbows and knees of moving limbs by inverse kinematics, with and without silhouettes, and compare
    Ik(ik::Args),
    /// Find pose and shape of a known body in silhouettes, and compare
    Shape(Box<shape::Args>),
    /// Follow a known body through the frames of a capture, and compare
    Multiview(Box<multiview::Args>),
    /// Disturb poses and see which search finds them again
    Recovery(Box<recovery::Args>),
}

/// Runs `marey evaluate`.
pub fn run(args: Args) -> anyhow::Result<()> {
    match args.what {
        What::Sparse(args) => sparse_command::run(&args),
        What::Skeleton(args) => body_commands::skeletons(&args),
        What::Feet(args) => body_commands::feet(&args),
        What::Run(args) => run_command::run(&args),
        What::Ik(args) => ik::run(&args),
        What::Shape(args) => shape::run(&args),
        What::Multiview(args) => multiview::run(&args),
        What::Recovery(args) => recovery::run(&args),
    }
}
