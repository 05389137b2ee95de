//! `marey evaluate`.

/// `marey evaluate`
#[derive(Debug, clap::Args)]
pub struct Args {}

/// Runs `marey evaluate`.
pub fn run(_args: Args) -> anyhow::Result<()> {
    anyhow::bail!("not there yet")
}
