//! `sdg completions`: the shell's completion script.

use std::io::Write;

use anyhow::Result;
use clap::Args as ClapArgs;

use crate::exit::Outcome;

/// `sdg completions`
#[derive(Debug, ClapArgs)]
pub struct CompletionsArgs {
    /// The shell
    #[arg(value_name = "SHELL")]
    pub shell: clap_complete::Shell,
}

/// Writes the script to standard output.
pub fn run(args: &CompletionsArgs, mut command: clap::Command) -> Result<Outcome> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "sdg", &mut script);
    // Written in one call, so that a closed pipe is returned as an error; the generator itself would panic.
    std::io::stdout().lock().write_all(&script)?;
    Ok(Outcome::Done)
}
