//! `sdg`: teach a robot a grasp from one photo.
//!
//! ```text
//! args ─ commands/<verb>.rs ─ grasp, simulation, report
//! ```
//!
//! `main` parses, matches once, prints the one line of an error and sets the exit code (see [`exit`]).
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod args;
mod commands;
mod demonstrations;
mod exit;
mod files;
mod interrupt;
mod pictures;
mod teaching_progress;

use std::process::ExitCode;

use clap::Parser;

use crate::args::{Args, Command};
use crate::exit::Outcome;

fn main() -> ExitCode {
    let args = Args::parse();
    let done = match args.command {
        Command::Demo(demo) => commands::demo::run(&demo),
        Command::Teach(teach) => commands::teach::run(&teach),
        Command::Detect(detect) => commands::detect::run(&detect),
        Command::Rehearse(rehearse) => commands::rehearse::run(&rehearse),
        Command::Augment(augment) => commands::augment::run(&augment),
    };
    match done {
        Ok(outcome) => outcome.into(),
        Err(error) if exit::is_closed_pipe(&error) => Outcome::Done.into(),
        Err(error) => {
            eprintln!("sdg: {}", exit::one_line(&error));
            exit::code_of(&error)
        }
    }
}
