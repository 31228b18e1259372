//! `sdg camera list`.

use anyhow::{Result, bail};
use clap::Args;

use crate::exit::Outcome;

/// `sdg camera list`
#[derive(Debug, Args)]
pub struct ListArgs {}

/// Runs it.
pub fn run(_args: &ListArgs) -> Result<Outcome> {
    bail!("expected a build that has this")
}
