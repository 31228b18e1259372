//! `sdg demo`: the complete task with shipped data, from a photo to grasps.

#[cfg(feature = "simulation")]
mod run;

use std::path::PathBuf;

use clap::Args as ClapArgs;

#[cfg(feature = "simulation")]
pub use run::run;

use crate::shared_args::seconds;

/// `sdg demo`
#[derive(Debug, ClapArgs)]
pub struct DemoArgs {
    /// The object: one of the parts in datasets/
    #[arg(long, default_value = "pendulum", value_name = "NAME")]
    pub object: String,
    /// Number of grasp attempts
    #[arg(long, default_value_t = 10, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub attempts: u32,
    /// Seed of all random choices
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub seed: u64,
    /// Maximum seconds for training the network
    #[arg(long, value_name = "SECS", value_parser = seconds)]
    pub time_budget: Option<f64>,
    /// Folder for the report
    #[arg(long, default_value = "report", value_name = "DIR")]
    pub out: PathBuf,
    /// End with one JSON object on standard output
    #[arg(long)]
    pub json: bool,
}
