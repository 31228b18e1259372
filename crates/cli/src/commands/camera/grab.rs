//! `sdg camera grab`.

use anyhow::{Result, bail};
use clap::Args;

use crate::exit::Outcome;

/// `sdg camera grab`
#[derive(Debug, Args)]
pub struct GrabArgs {}

/// Runs it.
pub fn run(_args: &GrabArgs) -> Result<Outcome> {
    bail!("expected a build that has this")
}
