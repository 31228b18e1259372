//! `sdg camera hand-eye`.

use anyhow::{Result, bail};
use clap::Args;

use crate::exit::Outcome;

/// `sdg camera hand-eye`
#[derive(Debug, Args)]
pub struct HandEyeArgs {}

/// Runs it.
pub fn run(_args: &HandEyeArgs) -> Result<Outcome> {
    bail!("expected a build that has this")
}
