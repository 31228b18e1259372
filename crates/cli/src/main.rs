//! The `sdg` binary: parses, runs, sets the exit code.
#![forbid(unsafe_code)]

use std::process::ExitCode;

use clap::Parser;
use sdg_cli::args::Args;

fn main() -> ExitCode {
    sdg_grasp::keep_freed_memory();
    sdg_cli::run(&Args::parse())
}
