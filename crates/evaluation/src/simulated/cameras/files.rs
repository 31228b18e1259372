//! Writes the results of the cameras to files in the evaluation's folder, and summarises them in a few lines.

use std::path::{Path, PathBuf};

use anyhow::Result;
use serde_json::json;

use super::summary::CamerasSummary;
use super::tables::{markdown, page};
use crate::machine::machine;
use crate::simulated::store::Store;

impl CamerasSummary {
    /// Writes tables and a page, and returns their files. `jobs` is the number of parallel units; `command` reproduces
    /// the results.
    ///
    /// # Errors
    /// Files cannot be written.
    pub fn write(&self, store: &Store, jobs: usize, command: &str, report_folder: &Path) -> Result<[PathBuf; 2]> {
        let settings = store.settings();
        let facts = [
            ("seed", settings.seed.to_string()),
            ("preset", settings.preset.clone()),
            ("worker seconds for pictures", format!("{:.0}", self.seconds)),
            ("in parallel", format!("{jobs} units of work")),
        ];
        let facts: Vec<_> = facts.into_iter().chain(store.origin_facts()).collect();
        store.write_bytes("cameras.md", markdown(self, &facts, command).as_bytes())?;
        let json = json!({ "summary": self, "machine": machine(), "command": command });
        store.write_bytes("cameras.json", format!("{json:#}\n").as_bytes())?;
        Ok([store.path("cameras.md"), page(self, &facts, command).write(report_folder)?])
    }

    /// One line for each model on each set.
    pub fn lines(&self) -> String {
        let mut text = String::new();
        for row in &self.sets {
            let of =
                if row.found.of > 0 { format!("found {}", row.found) } else { format!("accepted {}", row.accepted) };
            let errors = row.errors.map(|errors| {
                let turn = errors.median_deg.zip(errors.p95_deg);
                let turn = turn.map(|(median, p95)| format!(", {median:.2}° ({p95:.2}°)")).unwrap_or_default();
                let [mm, deg] = [errors.within_sigma_mm, errors.within_sigma_deg]
                    .map(|share| share.percent().map_or("–".to_owned(), |percent| format!("{percent:.0} %")));
                format!("; {:.2} mm ({:.2} mm){turn}, within sigma {mm} and {deg}", errors.median_mm, errors.p95_mm)
            });
            text += &format!("{} {}: {of}, {} wrong{}\n", row.model, row.set, row.wrong, errors.unwrap_or_default());
        }
        text
    }
}
