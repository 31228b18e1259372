//! `sdg rehearse`: grasp attempts in simulation.

#[cfg(feature = "simulation")]
mod run;

use std::path::PathBuf;

use clap::Args as ClapArgs;

#[cfg(feature = "simulation")]
pub use run::{finish, run, show_attempt};

use crate::shared_args::{ComputeArgs, OwnPartArgs};

/// `sdg rehearse`
#[derive(Debug, ClapArgs)]
pub struct RehearseArgs {
    /// A grasp model written by `sdg teach`
    #[arg(long, value_name = "FILE")]
    pub grasp_model: PathBuf,
    /// The object on the table: one of the parts in datasets/; without it, your own part
    #[arg(long, value_name = "NAME")]
    pub object: Option<String>,
    /// Properties of your own part
    #[command(flatten)]
    pub own_part: OwnPartArgs,
    /// Number of grasp attempts
    #[arg(long, default_value_t = 10, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub attempts: u32,
    /// Seed of object poses, robot starts, lights and table
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub seed: u64,
    /// Device for the network
    #[command(flatten)]
    pub compute: ComputeArgs,
    /// The wrist camera: resolution, focal length and lens of this file, instead of 640x480 at 550 px without
    /// distortion; its pose follows from the arm. For models taught with a camera; they then work in the plan view
    #[arg(long, value_name = "FILE")]
    pub camera: Option<PathBuf>,
    /// Put the part down at this place of the workcell file: NAME, or NAME:CELL for one cell of a tray; with NAME
    /// alone, the tray's cells are used one after another. An attempt succeeds if the part is within 3 mm and 3° of its
    /// place, by the last picture and by its true pose; for a bin, if it is inside it, by its true pose and, if the
    /// last picture shows it, by this picture
    #[arg(long, value_name = "NAME", requires = "workcell")]
    pub place: Option<String>,
    /// The workcell file, with places and obstacles
    #[arg(long, value_name = "FILE", requires = "place")]
    pub workcell: Option<PathBuf>,
    /// Skip the check against the demonstration
    #[arg(long)]
    pub no_verify: bool,
    /// Folder for the report
    #[arg(long, default_value = "report", value_name = "DIR")]
    pub out: PathBuf,
    /// End with one JSON object on standard output
    #[arg(long)]
    pub json: bool,
}
