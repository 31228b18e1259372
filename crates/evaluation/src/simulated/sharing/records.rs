//! Records that a process writes in a unit's folder.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::worker::Worker;

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
