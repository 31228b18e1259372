//! The arguments of `sdg evaluate` for units that many processes share.

use std::path::PathBuf;

use clap::Args as ClapArgs;

/// The heading of these options in the help.
const SHARING: &str = "Units for a cluster (docs/slurm.md)";

/// Running single units in a shared folder, and making the tables of all results.
#[derive(Debug, ClapArgs)]
pub struct SharingArgs {
    /// List the names of all units of work and exit; with --json also each unit's dependencies and whether it is done
    #[arg(long, group = "sharing", conflicts_with_all = ["pictures", "sheet"], help_heading = SHARING)]
    pub list_units: bool,
    /// Run only these units, in the folder of --out, where other processes may run other units; finished units are
    /// skipped
    #[arg(
        long,
        value_name = "NAME",
        num_args = 1..,
        value_delimiter = ',',
        group = "sharing",
        conflicts_with_all = ["pictures", "sheet"],
        help_heading = SHARING
    )]
    pub unit: Vec<String>,
    /// Check that every unit was done exactly once, by this program with these settings, and write the tables;
    /// otherwise report the error of each faulty unit
    #[arg(long, group = "sharing", conflicts_with_all = ["pictures", "sheet"], help_heading = SHARING)]
    pub collect: bool,
    /// Show the progress of the units in a folder until it no longer changes; with --json once, as one object
    #[arg(
        long,
        value_name = "DIR",
        group = "sharing",
        conflicts_with_all = ["pictures", "sheet"],
        help_heading = SHARING
    )]
    pub watch: Option<PathBuf>,
    /// Print a script that submits all units to this scheduler as job arrays
    #[arg(
        long,
        value_name = "SCHEDULER",
        value_parser = ["slurm"],
        group = "sharing",
        conflicts_with_all = ["pictures", "sheet"],
        help_heading = SHARING
    )]
    pub submit: Option<String>,
    /// Run the script of --submit instead of printing it
    #[arg(long, requires = "submit", help_heading = SHARING)]
    pub yes: bool,
    /// Number of cores requested for a unit
    #[arg(
        long,
        default_value_t = 2,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=1024),
        requires = "submit",
        help_heading = SHARING
    )]
    pub cores: u32,
    /// Memory requested for a unit
    #[arg(
        long,
        default_value_t = 1500,
        value_name = "MB",
        value_parser = clap::value_parser!(u32).range(1..),
        requires = "submit",
        help_heading = SHARING
    )]
    pub memory_mb: u32,
    /// Time limit of a unit
    #[arg(
        long,
        default_value_t = 30,
        value_name = "MINS",
        value_parser = clap::value_parser!(u32).range(1..=100_000),
        requires = "submit",
        help_heading = SHARING
    )]
    pub limit_mins: u32,
    /// An additional argument for sbatch, such as --sbatch=--partition=cpu; repeat for several
    #[arg(long, value_name = "ARG", allow_hyphen_values = true, requires = "submit", help_heading = SHARING)]
    pub sbatch: Vec<String>,
}

impl SharingArgs {
    /// Whether any of these options is given. Otherwise, the whole evaluation runs.
    pub fn is_asked_for(&self) -> bool {
        self.list_units || !self.unit.is_empty() || self.collect || self.watch.is_some() || self.submit.is_some()
    }
}
