//! `sdg camera calibrate`.

use anyhow::{Result, bail};
use clap::Args;

use crate::exit::Outcome;

/// `sdg camera calibrate`
#[derive(Debug, Args)]
pub struct CalibrateArgs {}

/// Runs it.
pub fn run(_args: &CalibrateArgs) -> Result<Outcome> {
    bail!("expected a build that has this")
}
