//! `sdg camera watch`.

use anyhow::{Result, bail};
use clap::Args;

use crate::exit::Outcome;

/// `sdg camera watch`
#[derive(Debug, Args)]
pub struct WatchArgs {}

/// Runs it.
pub fn run(_args: &WatchArgs) -> Result<Outcome> {
    bail!("expected a build that has this")
}
