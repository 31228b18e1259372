//! `sdg completions`: what the shell needs to complete commands and options.

use std::io::Write;

use anyhow::Result;
use clap::CommandFactory;

use crate::args::{Args, CompletionsArgs};
use crate::exit::Outcome;

/// Writes the script to standard output.
pub fn run(args: &CompletionsArgs) -> Result<Outcome> {
    let mut command = Args::command();
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "sdg", &mut script);
    // Written at once, so that a closed pipe is an error and not a panic of the generator.
    std::io::stdout().lock().write_all(&script)?;
    Ok(Outcome::Done)
}
