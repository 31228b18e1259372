//! Writes the results of the axes to files in the evaluation's folder.

use std::path::{Path, PathBuf};

use anyhow::Result;
use serde_json::json;

use super::against::{RunDifference, difference_tables};
use super::page::page;
use super::summary::AxesSummary;
use super::tables::markdown;
use crate::machine::machine;
use crate::simulated::store::Store;

impl AxesSummary {
    /// Writes tables and a page, and returns their files. `jobs` is the number of parallel units, `comparisons` are
    /// those with the run in the folder `other`, and `command` reproduces the results.
    ///
    /// # Errors
    /// Files cannot be written.
    pub fn write(
        &self,
        store: &Store,
        jobs: usize,
        (comparisons, other): (&[RunDifference], Option<&Path>),
        command: &str,
        report_folder: &Path,
    ) -> Result<[PathBuf; 2]> {
        let settings = store.settings();
        let facts = [
            ("seed", settings.seed.to_string()),
            ("preset", settings.preset.clone()),
            ("worker seconds", self.seconds.to_string()),
            ("in parallel", format!("{jobs} units of work")),
        ];
        let facts: Vec<_> = facts.into_iter().chain(store.origin_facts()).collect();
        let other = other.map(|folder| folder.display().to_string()).unwrap_or_default();
        let more = || difference_tables(comparisons, &other);
        store.write_bytes("axes.md", markdown(self, more(), &facts, command).as_bytes())?;
        let json = json!({ "summary": self, "against": comparisons, "machine": machine(), "command": command });
        store.write_bytes("axes.json", format!("{json:#}\n").as_bytes())?;
        Ok([store.path("axes.md"), page(self, more(), &facts, command).write(report_folder)?])
    }
}
