//! `sdg`: teach a robot a grasp from one photo.
//!
//! ```text
//! args ─ commands/<verb>.rs ─ grasp, simulation, report
//! ```
//!
//! The binary is a thin shell around [`run`]; [`rehearsal`], [`trial`] and [`evaluation`] are open to the end-to-end tests.
//!
//! ```
//! use clap::Parser;
//! use sdg_cli::args::{Args, Command};
//!
//! let args = Args::try_parse_from(["sdg", "demo", "--attempts", "3"]).expect("a call of the contract");
//! assert!(matches!(args.command, Command::Demo(demo) if demo.object == "pendulum" && demo.attempts == 3));
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod against_truth;
mod annotation_files;
pub mod args;
pub mod base_weights;
mod commands;
mod demonstrations;
pub mod detector_config;
pub mod evaluation;
mod exit;
mod files;
mod interrupt;
mod machine;
mod page_teacher;
mod pictures;
pub mod rehearsal;
mod run_page;
pub mod shipped;
mod teaching_page;
mod teaching_progress;
pub mod trial;

use std::process::ExitCode;

use crate::args::{Args, Command};
use crate::exit::Outcome;

/// Runs one command; prints the one line of an error and returns the exit code.
pub fn run(args: &Args) -> ExitCode {
    let done = match &args.command {
        Command::Demo(demo) => commands::demo::run(demo),
        Command::Annotate(annotate) => commands::annotate::run(annotate),
        Command::Teach(teach) => commands::teach::run(teach),
        Command::Detect(detect) => commands::detect::run(detect),
        Command::Rehearse(rehearse) => commands::rehearse::run(rehearse),
        Command::Evaluate(evaluate) => commands::evaluate::run(evaluate),
        Command::Augment(augment) => commands::augment::run(augment),
        Command::Annotation(annotation) => commands::annotation::run(annotation),
        Command::Weights(weights) => commands::weights::run(weights),
        Command::Completions(completions) => commands::completions::run(completions),
        Command::Man(man) => commands::man::run(man),
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
