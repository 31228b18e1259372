//! `sdg camera board`.

use anyhow::{Result, bail};
use clap::Args;

use crate::exit::Outcome;

/// `sdg camera board`
#[derive(Debug, Args)]
pub struct BoardArgs {}

/// Runs it.
pub fn run(_args: &BoardArgs) -> Result<Outcome> {
    bail!("expected a build that has this")
}
