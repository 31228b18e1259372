//! Runs one unit in a folder that several processes use.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use sdg_inputs::one_line;
use sdg_weights_conversion::sha256_of;
use serde_json::Value;

use super::super::one_unit::caught;
use super::super::schedule::{Task, run_all};
use super::super::settings::difference;
use super::super::units::{Evaluation, Unit};
use super::records::{Failure, Receipt};
use super::unit_folder::UnitFolder;
use super::unit_list::{ListedUnit, Work};
use super::worker::Worker;
use crate::error::EvaluationError;

/// The outcome of a unit.
#[derive(Debug, Clone, PartialEq)]
pub enum Ended {
    /// The unit is done; contains the result in words.
    Done(String),
    /// The unit was done before.
    Already(Box<Receipt>),
    /// The unit was interrupted by Ctrl-C.
    Interrupted,
}

impl Evaluation<'_> {
    /// Runs a unit with this number of threads, unless it is done already, and writes a receipt or the reason of its
    /// failure. If another process is running the unit, this is reported, and the function waits for its end.
    ///
    /// # Errors
    /// The errors of the unit; a dependency is missing; or the unit was done with other settings.
    pub fn do_listed(
        &self,
        unit: &ListedUnit,
        threads: usize,
        is_interrupted: &(dyn Fn() -> bool + Sync),
        told: &dyn Fn(&str),
    ) -> Result<Ended> {
        let name = &unit.name;
        let folder = UnitFolder::of(self.store.folder(), name);
        let mut is_told = false;
        let mut wait = || {
            if !is_told {
                is_told = true;
                told(&format!("{name}: running in another process{}; waiting for its end", holder_text(&folder)));
            }
            !is_interrupted()
        };
        let Some(_held) = folder.hold(&mut wait)? else { return Ok(Ended::Interrupted) };
        let settings = self.settings_of(unit)?;
        if let Some(receipt) = folder.read()?.receipts.into_iter().next() {
            if let Some(difference) = difference(&settings, &receipt.settings)? {
                return Err(EvaluationError::UnitOfOtherSettings { unit: name.clone(), difference }.into());
            }
            return Ok(Ended::Already(Box::new(receipt)));
        }
        let (by, started) = (Worker::this(), Instant::now());
        let started_secs = folder.begin(&by)?.started_secs;
        let ended =
            self.check_after(unit).and_then(|()| self.do_work(unit, threads, is_interrupted)).and_then(|summary| {
                let Some(summary) = summary else { return Ok(None) };
                Ok(Some(Receipt {
                    unit: name.clone(),
                    by: by.clone(),
                    started_secs,
                    seconds: started.elapsed().as_secs_f64(),
                    summary,
                    settings,
                    files: self.written_by(unit)?,
                }))
            });
        match ended {
            Ok(Some(receipt)) => {
                folder.finish(&receipt)?;
                Ok(Ended::Done(receipt.summary))
            }
            Ok(None) => {
                folder.end()?;
                Ok(Ended::Interrupted)
            }
            Err(error) => {
                let seconds = started.elapsed().as_secs_f64();
                let failure = Failure { unit: name.clone(), by, started_secs, seconds, why: one_line(&error) };
                Err(match folder.fail(&failure) {
                    Ok(()) => error.context(name.clone()),
                    Err(also) => anyhow!("{name}: {}; and this cannot be recorded: {}", failure.why, one_line(&also)),
                })
            }
        }
    }

    /// The settings that determine a unit's files.
    pub(super) fn settings_of(&self, unit: &ListedUnit) -> Result<Value> {
        let settings = self.store.settings();
        Ok(match unit.work {
            Work::Unit(Unit::Teach(_)) => serde_json::to_value(settings.teaching())?,
            Work::Unit(_) | Work::Time(_) => serde_json::to_value(settings)?,
        })
    }

    /// Checks that the units on which a unit depends are done.
    fn check_after(&self, unit: &ListedUnit) -> Result<()> {
        let folder = self.store.folder();
        for before in &unit.after {
            if UnitFolder::of(folder, before).read()?.receipts.is_empty() {
                bail!(
                    "expected {before} to be done before, found no receipt of it in {}; if it was done, it was done \
                     in another folder: check that all machines use the same one",
                    folder.display()
                );
            }
        }
        Ok(())
    }

    fn do_work(
        &self,
        unit: &ListedUnit,
        threads: usize,
        is_interrupted: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<String>> {
        if is_interrupted() {
            return Ok(None);
        }
        let summary = Mutex::new(None);
        let tasks = [Task { unit: unit.work, after: Vec::new() }];
        run_all(&tasks, 1, threads, &|work: &Work| {
            let ended = caught(|| match work {
                Work::Unit(unit) => self.work(*unit, is_interrupted),
                Work::Time(object) => self.measure_speed(object, threads).map(|()| Some("timed".to_owned())),
            })?;
            *summary.lock().unwrap_or_else(PoisonError::into_inner) = ended;
            Ok(ControlFlow::Continue(()))
        })?;
        Ok(summary.into_inner().unwrap_or_else(PoisonError::into_inner))
    }

    /// The files written by a unit and their hashes.
    fn written_by(&self, unit: &ListedUnit) -> Result<BTreeMap<String, String>> {
        let mut written = BTreeMap::new();
        for file in &unit.files {
            let path = self.store.path(file);
            if path.exists() {
                let hash = sha256_of(&path).with_context(|| path.display().to_string())?;
                written.insert(file.clone(), hash);
            }
        }
        Ok(written)
    }
}

/// The process that runs a unit, if known.
fn holder_text(folder: &UnitFolder) -> String {
    let running = folder.read().ok().and_then(|state| state.running);
    running.map_or_else(String::new, |running| format!(", by {}", running.by))
}
