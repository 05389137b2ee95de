//! The options of one command as a command line of their own, for tests.

/// A command line that has nothing but these options.
#[derive(Debug, clap::Parser)]
pub struct Alone<A: clap::Args> {
    /// what was given
    #[command(flatten)]
    pub args: A,
}
