//! The records of a process in a unit's folder.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::worker::Worker;

/// A unit is running.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Running {
    pub by: Worker,
    /// Seconds since 1970.
    pub started_secs: u64,
}

/// A unit is done.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Receipt {
    pub unit: String,
    pub by: Worker,
    /// Seconds since 1970.
    pub started_secs: u64,
    /// Duration.
    pub seconds: f64,
    /// The result in words.
    pub summary: String,
    /// The settings on which its files depend, and the program's SHA-256.
    pub settings: Value,
    /// The files that it wrote, with paths relative to the evaluation's folder, and their SHA-256.
    pub files: BTreeMap<String, String>,
}

/// A unit has failed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    pub unit: String,
    pub by: Worker,
    /// Seconds since 1970.
    pub started_secs: u64,
    pub seconds: f64,
    /// The reason, on one line.
    pub why: String,
}
