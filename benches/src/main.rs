//! `sdg-bench`: our speed against that of others, on the same work in one run.
//!
//! ```text
//! sdg-bench compare ─┬─ sdg-bench work NAME ─────── ours          one computes at a time, turn by turn;
//!                    ├─ python peers/worker.py ──── a peer        each is a process of its own, so that
//!                    └─ …                                         its peak memory is its own too
//!         │
//!         └─ medians ─ target/bench/peers.json, a table, benches/RESULTS.md
//! ```
//!
//! What is compared stands in [`registry`]; both sides load the same weights, see the same pictures and tell facts of
//! what they computed (how many boxes, which scores), which must agree before anything is timed. Left out: installing
//! the peers (`make bench`) and checking our kernels (their own tests).
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

/// Our speed against PyTorch, ONNX Runtime, OpenVINO and albumentations, on the same work in one run.
#[derive(Debug, Parser)]
#[command(name = "sdg-bench", version, arg_required_else_help = true)]
struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Runs ours and theirs turn by turn and writes medians
    Compare(compare::CompareArgs),
    /// The page's detection against onnxruntime-web's in the same page of a headless Chromium
    Browser(browser::BrowserArgs),
    /// The time of model S against pixels, parts in the picture and edge points
    Curves(curves::CurvesArgs),
    /// Model S beside corrmatch and OpenCV's matchers: times, found and wrong ones
    Matchers(matchers::MatchersArgs),
    /// Size, start, memory and frames a second of the program for small machines, on one core
    Edge(edge::EdgeArgs),
    /// Runs one of our works when asked on standard input; `compare` starts it
    Work(WorkArgs),
    /// Writes a network's weights for both sides to load
    Weights {
        /// Which network
        network: Network,
        /// A safetensors file
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
