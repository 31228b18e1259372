//! `sdg camera table`.

use anyhow::{Result, bail};
use clap::Args;

use crate::exit::Outcome;

/// `sdg camera table`
#[derive(Debug, Args)]
pub struct TableArgs {}

/// Runs it.
pub fn run(_args: &TableArgs) -> Result<Outcome> {
    bail!("expected a build that has this")
}
