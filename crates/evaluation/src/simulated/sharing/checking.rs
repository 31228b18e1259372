//! Faults of units that prevent the tables: missing, running, failed, duplicate, or different from the receipt.

use std::path::Path;

use anyhow::{Context, Result};
use sdg_files::{Access, Lock};
use sdg_weights_conversion::sha256_of;

use super::super::settings::difference;
use super::super::units::Evaluation;
use super::made_with::{made_with_another, other_model};
use super::records::{ModelHashes, Receipt};
use super::unit_folder::{UnitFolder, UnitState};
use super::unit_list::ListedUnit;

/// The exclusive right to make the tables of a folder, until it is dropped.
#[derive(Debug)]
pub struct Collecting(#[allow(dead_code, reason = "held until it is dropped")] Lock);

impl Collecting {
    /// Takes the right for this process; `None` if another process has it.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn begin(folder: &Path) -> Result<Option<Self>> {
        Ok(Lock::take(&folder.join(".collect.lock"), Access::Alone)?.map(Self))
    }
}

/// One line for each unit that cannot be counted; empty if the tables can be made.
///
/// # Errors
/// Records cannot be read.
pub fn faults(evaluation: &Evaluation, units: &[ListedUnit]) -> Result<Vec<String>> {
    let folder = evaluation.store.folder();
    let mut faults = Vec::new();
    for unit in units {
        let state = UnitFolder::of(folder, &unit.name).read()?;
        let told = match state.receipts.as_slice() {
            [] => Some(why_missing(&state)),
            [receipt] => stale(evaluation, unit, receipt, &state.models)?,
            several => {
                let by: Vec<String> = several.iter().map(|receipt| receipt.by.to_string()).collect();
                Some(format!("duplicate: done by {}; remove units/{} and do it again", by.join(" and by "), unit.name))
            }
        };
        faults.extend(told.map(|told| format!("{}: {told}", unit.name)));
    }
    Ok(faults)
}

fn why_missing(state: &UnitState) -> String {
    match (&state.running, state.failures.last()) {
        (None, _) if state.interrupted.is_some() => "missing: interrupted".to_owned(),
        (Some(running), _) if !state.is_abandoned => format!("still running on {}", running.by),
        (Some(running), _) => format!("missing: {} ended without a result", running.by),
        (None, Some(failure)) => format!(
            "missing: failed {} on {}: {}",
            if state.failures.len() == 1 { "once".to_owned() } else { format!("{} times, last", state.failures.len()) },
            failure.by,
            failure.why
        ),
        (None, None) => "missing: not begun yet".to_owned(),
    }
}

/// The first difference between a unit's receipt and this run's settings, program, models or files, or between the
/// receipt and the unit's files.
fn stale(
    evaluation: &Evaluation,
    unit: &ListedUnit,
    receipt: &Receipt,
    made_with: &ModelHashes,
) -> Result<Option<String>> {
    if let Some(difference) = difference(&evaluation.settings_of(unit)?, &receipt.settings)? {
        return Ok(Some(format!("stale: done with other settings ({difference})")));
    }
    if let Some(model) = other_model(made_with, &evaluation.models_of(unit)?) {
        return Ok(Some(format!("stale: {}", made_with_another(model, &unit.name))));
    }
    if let Some(file) = unit.files.iter().find(|file| !receipt.all_files.contains(*file)) {
        return Ok(Some(format!("missing: done without {file}")));
    }
    for (file, expected) in &receipt.files {
        let path = evaluation.store.path(file);
        if !path.exists() {
            return Ok(Some(format!("stale: {file} is gone")));
        }
        let found = sha256_of(&path).with_context(|| path.display().to_string())?;
        if found != *expected {
            return Ok(Some(format!(
                "stale: {file} differs from the file in its receipt (SHA-256: expected {expected}, found {found})"
            )));
        }
    }
    Ok(None)
}
