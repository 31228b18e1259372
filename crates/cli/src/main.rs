//! The `sdg` binary: parses the arguments, runs the command, sets the exit code.
#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    sdg_grasp::keep_freed_memory();
    sdg_cli::run(&sdg_cli::parse_args(std::env::args_os())).into()
}
