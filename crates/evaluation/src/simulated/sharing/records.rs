//! Records that a process writes in a unit's folder.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::worker::Worker;

/// The SHA-256 of model files, by their path relative to the evaluation's folder; `None` without a file.
pub type ModelHashes = BTreeMap<String, Option<String>>;

/// The record of a running unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Running {
    pub by: Worker,
    /// Time of the start, in seconds since 1970.
    pub started_secs: u64,
}

/// The record of a finished unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Receipt {
    pub unit: String,
    pub by: Worker,
    /// Time of the start, in seconds since 1970.
    pub started_secs: u64,
    /// Duration, in seconds.
    pub seconds: f64,
    /// The result in words.
    pub summary: String,
    /// The settings that determine the unit's files, and the program's SHA-256.
    pub settings: Value,
    /// The SHA-256 of each file that the unit wrote, by its path relative to the evaluation's folder.
    pub files: BTreeMap<String, String>,
    /// All files that the unit could write, including those of parts without a model.
    #[serde(default)]
    pub all_files: BTreeSet<String>,
}

impl Receipt {
    /// Whether the unit was done for all these files. A unit that was done for fewer models is done again.
    pub fn covers(&self, files: &[String]) -> bool {
        files.iter().all(|file| self.all_files.contains(file))
    }

    /// This receipt, for the files of an earlier receipt of the unit too.
    pub(super) fn after(mut self, earlier: Self) -> Self {
        self.seconds += earlier.seconds;
        self.files.extend(earlier.files);
        self.all_files.extend(earlier.all_files);
        self
    }
}

/// The record of a failed unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    pub unit: String,
    pub by: Worker,
    /// Time of the start, in seconds since 1970.
    pub started_secs: u64,
    pub seconds: f64,
    /// The reason of the failure, on one line.
    pub why: String,
}
