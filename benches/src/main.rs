//! `sdg-bench`: compares our speed with that of other software, on the same work in one run.
//!
//! ```text
//! sdg-bench compare ─┬─ sdg-bench work NAME ─────── our side      they compute alternately; each is a
//!                    ├─ python peers/worker.py ──── a peer        separate process, so that its peak
//!                    └─ …                                         memory is measured separately
//!         │
//!         └─ medians ─ target/bench/peers.json, a table, benches/RESULTS.md
//! ```
//!
//! [`registry`] lists the compared works. Both sides load the same weights, process the same pictures and report
//! facts about their results (number of boxes, scores), which must agree before anything is timed. This program does not
//! install the peers (`make bench` does) and does not test our kernels (their own tests do).
#![forbid(unsafe_code)]
#![allow(missing_docs, reason = "a program that measures")]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod browser;
mod compare;
mod curves;
mod edge;
mod matchers;
mod network;
mod protocol;
mod registry;
mod results;
mod scene;
mod turned_parts;
mod works;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::network::Network;
use crate::works::WorkArgs;

/// Compares our speed with PyTorch, ONNX Runtime, OpenVINO and albumentations, on the same work in one run.
#[derive(Debug, Parser)]
#[command(name = "sdg-bench", version, arg_required_else_help = true)]
struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Runs our side and the peers alternately and writes medians
    Compare(compare::CompareArgs),
    /// Compares the page's detection with onnxruntime-web in the same page of a headless Chromium
    Browser(browser::BrowserArgs),
    /// Measures the time of model S as a function of pixels, parts in the picture and edge points
    Curves(curves::CurvesArgs),
    /// Compares model S with corrmatch and OpenCV's matchers: times, found parts and wrong detections
    Matchers(matchers::MatchersArgs),
    /// Measures size, start, memory and frames per second of the program for small machines, on one core
    Edge(edge::EdgeArgs),
    /// Runs one of our works on requests from standard input; `compare` starts it
    Work(WorkArgs),
    /// Writes a network's weights for both sides to load
    Weights {
        /// Name of the network
        network: Network,
        /// Output file, safetensors
        out: PathBuf,
    },
}

fn main() -> ExitCode {
    sdg_grasp::keep_freed_memory();
    let result = match Args::parse().command {
        Command::Compare(args) => compare::run(&args),
        Command::Browser(args) => browser::run(&args),
        Command::Curves(args) => curves::run(&args),
        Command::Matchers(args) => matchers::run(&args),
        Command::Edge(args) => edge::run(&args),
        Command::Work(args) => protocol::serve(|| works::build(&args)),
        Command::Weights { network, out } => network.write_weights(&out),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("sdg-bench: {error:#}");
            ExitCode::FAILURE
        }
    }
}
