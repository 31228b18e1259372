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
use super::made_with::{made_with_another, other_model};
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
        let (settings, models) = (self.settings_of(unit)?, self.models_of(unit)?);
        let state = folder.read()?;
        let earlier = state.receipts.into_iter().next();
        let (by, started) = (Worker::this(), Instant::now());
        if let Some(receipt) = &earlier {
            let other_settings = difference(&settings, &receipt.settings)?
                .map(|difference| EvaluationError::UnitOfOtherSettings { unit: name.clone(), difference }.into());
            let of_other_model = || {
                let model = other_model(&state.models, &models)?;
                Some(anyhow!("{name}: {}", made_with_another(model, name)))
            };
            let refused: Option<anyhow::Error> = other_settings.or_else(of_other_model);
            match (refused, receipt.covers(&unit.files)) {
                (None, true) => return Ok(Ended::Already(Box::new(receipt.clone()))),
                (None, false) => {}
                (Some(error), true) => return Err(error),
                (Some(error), false) => {
                    // Without a record, --watch would wait for the unit.
                    let started_secs = folder.begin(&by)?.started_secs;
                    let why = one_line(&error);
                    folder.fail(&Failure { unit: name.clone(), by, started_secs, seconds: 0.0, why })?;
                    return Err(error);
                }
            }
        }
        let running = folder.begin(&by)?;
        let started_secs = running.started_secs;
        let ended = self.check_after(unit).and_then(|()| {
            let mut known = state.models;
            if earlier.is_none() && known != models {
                // Results of other models, such as single attempts, that have no receipt.
                unit.files.iter().try_for_each(|file| self.store.remove(file))?;
                known.clear();
            }
            known.extend(models);
            if !known.is_empty() {
                folder.write_models(&known)?;
            }
            let Some(summary) = self.do_work(unit, threads, is_interrupted)? else { return Ok(None) };
            Ok(Some(Receipt {
                unit: name.clone(),
                by: by.clone(),
                started_secs,
                seconds: started.elapsed().as_secs_f64(),
                summary,
                settings,
                files: self.written_by(unit)?,
                all_files: unit.files.iter().cloned().collect(),
            }))
        });
        match ended {
            Ok(Some(mut receipt)) => {
                if let Some(earlier) = earlier {
                    folder.remove_receipt(&earlier)?;
                    receipt = receipt.after(earlier);
                }
                folder.finish(&receipt)?;
                Ok(Ended::Done(receipt.summary))
            }
            Ok(None) => {
                folder.interrupt(&running)?;
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

#[cfg(test)]
mod tests {
    use sdg_grasp::{ModelKind, Preset};
    use sdg_simulation::objects::ObjectSpec;

    use super::super::checking::faults;
    use super::super::unit_list::all_units;
    use super::*;
    use crate::simulated::cell::{Cell, Marks};
    use crate::simulated::records::TeachingRecord;
    use crate::{Settings, Store};

    const LOOK: &str = "look-pendulum";

    /// Does the unit of the pictures, of which there are none, for these models.
    fn look(store: &Store, objects: &[ObjectSpec], models: &[ModelKind]) -> Result<Ended> {
        let units = all_units(models, objects, false);
        let unit = units.iter().find(|unit| unit.name == LOOK).unwrap();
        evaluation(store, objects, models).do_listed(unit, 1, &|| false, &|_| ())
    }

    fn evaluation<'a>(store: &'a Store, objects: &'a [ObjectSpec], models: &'a [ModelKind]) -> Evaluation<'a> {
        Evaluation { models, objects, preset: Preset::Edge, store, unverified: false, jobs: 1 }
    }

    #[test]
    fn a_unit_is_done_again_for_further_models_and_refused_after_another_teaching() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open_shared(folder.path(), &Settings::for_test(1, 1, 0)).unwrap();
        let objects = [ObjectSpec::by_name("pendulum").unwrap()];
        // The teachings have ended without a model.
        for model in [ModelKind::S, ModelKind::C] {
            let cell = Cell { model, object: "pendulum" };
            let failed = TeachingRecord::Failed { why: "nothing learnt".into() };
            store.write_made_with(&cell.teaching_file(Marks::Shipped), &store.settings().teaching(), &failed).unwrap();
            let unit = UnitFolder::of(folder.path(), &format!("teach-{cell}"));
            let _held = unit.hold(&mut || false).unwrap();
            let by = Worker::this();
            let started_secs = unit.begin(&by).unwrap().started_secs;
            let receipt = Receipt {
                unit: format!("teach-{cell}"),
                by,
                started_secs,
                seconds: 0.0,
                summary: String::new(),
                settings: Value::Null,
                files: BTreeMap::new(),
                all_files: [cell.model_file(Marks::Shipped), cell.teaching_file(Marks::Shipped)].into(),
            };
            unit.finish(&receipt).unwrap();
        }
        let is_done_now = |models: &[ModelKind]| matches!(look(&store, &objects, models).unwrap(), Ended::Done(_));
        assert!(is_done_now(&[ModelKind::S]));
        assert!(!is_done_now(&[ModelKind::S]));
        let both = [ModelKind::S, ModelKind::C];
        let told = |models: &[ModelKind]| {
            let faults = faults(&evaluation(&store, &objects, models), &all_units(models, &objects, false)).unwrap();
            faults.into_iter().find(|fault| fault.starts_with(LOOK))
        };
        assert_eq!(told(&both).unwrap(), "look-pendulum: missing: done without cells/C-pendulum.look.json");
        assert!(is_done_now(&[ModelKind::C]));
        assert!(!is_done_now(&both) && !is_done_now(&[ModelKind::S]));
        assert_eq!(UnitFolder::of(folder.path(), LOOK).read().unwrap().receipts.len(), 1);
        assert_eq!(told(&both), None);

        // C is taught again.
        store.write_bytes("models/C-pendulum.sdg", b"a model").unwrap();
        let expected = "look-pendulum: done with an earlier models/C-pendulum.sdg; this model was taught again";
        let refused = look(&store, &objects, &both).unwrap_err().to_string();
        assert!(refused.starts_with(expected) && refused.ends_with("remove units/look-pendulum and do it again"));
        assert!(told(&both).unwrap().starts_with("look-pendulum: stale: done with an earlier models/C-pendulum.sdg"));
        assert_eq!(told(&[ModelKind::S]), None);
        // For further models, the unit is not done: the refusal is recorded, so that --watch does not wait for it.
        let unit = UnitFolder::of(folder.path(), LOOK);
        assert!(unit.read().unwrap().failures.is_empty());
        assert!(look(&store, &objects, &[ModelKind::S, ModelKind::C, ModelKind::D]).is_err());
        let state = unit.read().unwrap();
        assert!(state.running.is_none() && state.failures[0].why.starts_with(expected), "{:?}", state.failures);
    }
}
