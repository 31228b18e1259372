//! What a process leaves in a unit's folder.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::worker::Worker;

/// A unit is at work.
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
    /// How long it took.
    pub seconds: f64,
    /// What came of it, in words.
    pub summary: String,
    /// What its files depend on: settings, and the program's SHA-256.
    pub settings: Value,
    /// Each file that it wrote, from the evaluation's folder, and its SHA-256.
    pub files: BTreeMap<String, String>,
}

/// A unit came to nothing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    pub unit: String,
    pub by: Worker,
    /// Seconds since 1970.
    pub started_secs: u64,
    pub seconds: f64,
    /// Why, in one line.
    pub why: String,
}
