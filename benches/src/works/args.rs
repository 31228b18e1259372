//! Arguments of a work.

use std::path::PathBuf;

use clap::Args as ClapArgs;

/// `sdg-bench work`
#[derive(Debug, ClapArgs)]
pub struct WorkArgs {
    /// Name of the work; `compare --help` lists them
    pub name: String,
    /// Weights written by `sdg-bench weights`
    #[arg(long, value_name = "FILE")]
    pub weights: Option<PathBuf>,
    /// Folder with image.png and annotation.json
    #[arg(long, value_name = "DIR")]
    pub demonstration: Option<PathBuf>,
    /// Grasp model that the work `teaching` writes and `edge-grasp` reads
    #[arg(long, value_name = "FILE")]
    pub model: Option<PathBuf>,
    /// Number of threads, for works that start their own
    #[arg(long, default_value_t = 2, value_name = "N")]
    pub threads: usize,
}
