//! Writes the protocol's results to files in the evaluation's folder.

use std::path::{Path, PathBuf};

use anyhow::Result;
use serde_json::json;

use super::groups::PartGroup;
use super::page::page;
use super::settings::Settings;
use super::summary::{ModelSummary, Summary};
use super::tables::markdown;
use super::units::Evaluation;
use crate::machine::machine;

/// The written files and the summaries.
#[derive(Debug)]
pub struct WrittenTables {
    /// The summary of each group of parts.
    pub summaries: Vec<Summary>,
    /// Number of remaining units.
    pub remaining: usize,
    /// The results of all models and cells, as JSON.
    pub cells: PathBuf,
    /// The tables as Markdown.
    pub tables: PathBuf,
    /// The page.
    pub report: PathBuf,
}

impl Evaluation<'_> {
    /// Writes the tables of the finished units. The page states `settings`; `command` reproduces the results.
    ///
    /// # Errors
    /// Records cannot be read, or files cannot be written.
    pub fn write_tables(&self, settings: &Settings, command: &str, report_folder: &Path) -> Result<WrittenTables> {
        let store = self.store;
        let summaries = Summary::collect(self)?;
        let remaining = self.remaining()?;
        let facts = [
            ("seed", settings.seed.to_string()),
            ("preset", settings.preset.clone()),
            ("in parallel", format!("{} units of work", self.jobs)),
        ];
        let facts: Vec<_> = facts.into_iter().chain(store.origin_facts()).collect();
        store.write_bytes("tables.md", markdown(&summaries, &facts, command).as_bytes())?;
        let of_group = |group: PartGroup| summaries.iter().find(|summary| summary.group == group);
        let [paper, held_out] = PartGroup::ALL.map(of_group);
        let json = json!({
            "models": paper.map_or(&[][..], |summary| &summary.models),
            "cells": paper.map_or(&[][..], |summary| &summary.cells),
            "held_out": held_out.map(|summary| json!({ "models": summary.models, "cells": summary.cells })),
            "settings": settings,
            "remaining": remaining,
            "machine": machine(),
            "command": command,
        });
        store.write_bytes("tables.json", format!("{json:#}\n").as_bytes())?;
        let report = page(&summaries, store, &facts, command)?.write(report_folder)?;
        let [cells, tables] = ["tables.json", "tables.md"].map(|name| store.path(name));
        Ok(WrittenTables { summaries, remaining, cells, tables, report })
    }
}

impl Summary {
    /// One line for each model.
    pub fn lines(&self) -> String {
        let of = if self.group == PartGroup::HeldOut { " (held-out parts)" } else { "" };
        let line = |model: &ModelSummary| {
            let figures = &model.verified;
            format!(
                "{}{of}: held {} ({} at the first look), right {}, false alarms {}\n",
                model.model, figures.held, figures.held_at_first_look.count, figures.right, figures.false_alarms
            )
        };
        self.models.iter().map(line).collect()
    }
}
