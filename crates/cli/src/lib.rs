//! `sdg`: teach a robot a grasp from one photo.
//!
//! ```text
//! args ─ commands/<command>.rs ─ inputs, cell, evaluation, page-session, annotate, ros2-node
//! ```
//!
//! Without the features `simulation` and `annotate` (`cargo build -p sdg-cli --no-default-features`) the program is
//! suited to small machines: it teaches and detects, without MuJoCo, EGL and the annotation page.
//!
//! The binary calls [`parse_args`] and [`run`]. Other crates do the work; this crate has the arguments, texts, progress
//! and exit codes. It is not an interface for other programs.
//!
//! ```
//! use clap::Parser;
//! use sdg_cli::args::{Args, Command};
//!
//! let args = Args::try_parse_from(["sdg", "demo", "--attempts", "3"]).expect("a call as in docs/command-line.md");
//! assert!(matches!(args.command, Command::Demo(demo) if demo.object == "pendulum" && demo.attempts == 3));
//! ```
#![forbid(unsafe_code)]
#![allow(missing_docs, reason = "the library of a program: nothing but this workspace uses it")]
#![cfg_attr(test, allow(clippy::unwrap_used))]

// First, so that its macros replace those of std in all other modules.
#[macro_use]
mod output;

#[doc(hidden)]
pub mod args;
mod clock;
mod commands;
mod demonstrations;
mod examples;
mod exit;
mod found_text;
mod interrupt;
mod json_line;
mod live_pictures;
mod output_paths;
mod paint;
#[cfg(feature = "simulation")]
mod parts;
mod progress;
mod robots;
mod shared_args;
mod teaching_progress;
mod web_browser;

use std::ffi::OsString;

use clap::error::{ContextKind, ContextValue};
use clap::{Command as ClapCommand, CommandFactory, FromArgMatches};

use crate::args::{Args, Command};
use crate::exit::Outcome;
use crate::paint::{Paint, Tone};

#[doc(hidden)]
/// The definition of the command line, with examples and exit codes.
pub fn command() -> ClapCommand {
    examples::with_examples(Args::command())
}

#[doc(hidden)]
/// Parses arguments, the first of which is the program's name. For wrong arguments and `--help`, it prints the text and
/// ends the process.
pub fn parse_args(arguments: impl IntoIterator<Item = OsString>) -> Args {
    clock::start();
    let matches = command().try_get_matches_from(arguments);
    matches.and_then(|matches| Args::from_arg_matches(&matches)).unwrap_or_else(|error| without_password(error).exit())
}

/// Hides the password in a wrong address of a camera: clap prints the value as it was given.
fn without_password(mut error: clap::Error) -> clap::Error {
    if let Some(ContextValue::String(value)) = error.get(ContextKind::InvalidValue) {
        let shown = sdg_camera::without_password(value);
        error.insert(ContextKind::InvalidValue, ContextValue::String(shown));
    }
    error
}

#[doc(hidden)]
/// Runs one command; prints errors on one line and returns the exit code.
pub fn run(args: &Args) -> u8 {
    let done = match &args.command {
        #[cfg(feature = "simulation")]
        Command::Demo(demo) => commands::demo::run(demo),
        #[cfg(feature = "annotate")]
        Command::Annotate(annotate) => commands::annotate::run(annotate),
        #[cfg(not(feature = "annotate"))]
        Command::Annotate(_) => Err(exit::Usage(
            "this sdg was built without the annotation page: expected a build with cargo's feature \"annotate\""
                .to_owned(),
        )
        .into()),
        Command::Teach(teach) => match &teach.demos {
            Some(folder) => commands::teach_folder::run(teach, folder),
            None => commands::teach::run(teach),
        },
        Command::Detect(detect) => commands::detect::run(detect),
        #[cfg(feature = "simulation")]
        Command::Rehearse(rehearse) => commands::rehearse::run(rehearse),
        #[cfg(not(feature = "simulation"))]
        Command::Demo(_) | Command::Rehearse(_) | Command::Simulate(_) => Err(exit::without_simulator()),
        #[cfg(feature = "simulation")]
        Command::Simulate(simulate) => commands::simulate::run(simulate),
        Command::Evaluate(evaluate) => commands::evaluate::run(evaluate),
        Command::Grasp(grasp) => commands::grasp::run(grasp),
        Command::Plan(plan) => commands::plan::run(plan),
        Command::Workcell(workcell) => commands::workcell::run(workcell),
        Command::Robot(robot) => commands::robot::run(robot),
        #[cfg(feature = "ros2")]
        Command::Ros2(ros2) => commands::ros2::run(ros2),
        #[cfg(not(feature = "ros2"))]
        Command::Ros2(_) => Err(exit::without_ros2()),
        Command::Augment(augment) => commands::augment::run(augment),
        Command::Annotation(annotation) => commands::annotation::run(annotation),
        Command::Weights(weights) => commands::weights::run(weights),
        Command::Camera(camera) => commands::camera::run(camera),
        Command::Completions(completions) => commands::completions::run(completions, command()),
        Command::Man(man) => commands::man::run(man, command()),
        Command::Devices(devices) => commands::devices::run(devices),
    };
    match done.and_then(|outcome| output::finish().map(|()| outcome)) {
        Ok(outcome) => {
            if prints_total_time(&args.command) {
                eprintln!("took {:.1} s from start to exit", clock::elapsed_secs());
            }
            outcome.code()
        }
        Err(error) if exit::is_closed_pipe(&error) => Outcome::Done.code(),
        Err(error) => {
            eprintln!("{} {}", Paint::stderr().text(Tone::Bad, "sdg:"), exit::one_line(&error));
            exit::code_of(&error)
        }
    }
}

/// Whether the total time is printed at the end: for commands that take long and do not report it themselves.
fn prints_total_time(command: &Command) -> bool {
    match command {
        Command::Demo(_) | Command::Rehearse(_) | Command::Augment(_) => true,
        Command::Evaluate(evaluate) => !evaluate.sharing.list_units,
        _ => false,
    }
}
