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
    /// A grasp model that `sdg teach` wrote
    #[arg(long, value_name = "FILE")]
    pub grasp_model: PathBuf,
    /// The object on the table: one of those shipped under datasets/; without it, your own part
    #[arg(long, value_name = "NAME")]
    pub object: Option<String>,
    /// What is known of your own part
    #[command(flatten)]
    pub own_part: OwnPartArgs,
    /// Grasp attempts
    #[arg(long, default_value_t = 10, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub attempts: u32,
    /// Decides object poses, robot starts, lights and table
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub seed: u64,
    /// Where the network computes
    #[command(flatten)]
    pub compute: ComputeArgs,
    /// The camera on the wrist: resolution, focal length and lens of this file, instead of 640x480 at 550 px without distortion;
    /// where it is the arm tells. For models taught with a camera, which then look in the plan view
    #[arg(long, value_name = "FILE")]
    pub camera: Option<PathBuf>,
    /// Put the part down in this place of the workcell's file: NAME, or NAME:CELL for one cell of a tray, whose cells are else taken
    /// in turn. An attempt succeeds where the part really lies within 3 mm and 3° of its place
    #[arg(long, value_name = "NAME", requires = "workcell")]
    pub place: Option<String>,
    /// The workcell's file, for its places and obstacles
    #[arg(long, value_name = "FILE", requires = "place")]
    pub workcell: Option<PathBuf>,
    /// Leave out the check against the demonstration
    #[arg(long)]
    pub no_verify: bool,
    /// Folder for the report
    #[arg(long, default_value = "report", value_name = "DIR")]
    pub out: PathBuf,
    /// End with one JSON object on standard output
    #[arg(long)]
    pub json: bool,
}
