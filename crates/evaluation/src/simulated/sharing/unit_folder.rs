//! The folder of one unit, with records of its processes and results.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result};
use sdg_files::{Access, Lock, write_atomically};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::records::{Failure, ModelHashes, Receipt, Running};
use super::worker::{Worker, unix_secs};

/// Maximum size of a record.
const MAX_RECORD_BYTES: u64 = 1 << 20;
/// Interval between attempts to take a lock that another process holds.
const LOCK_WAIT: Duration = Duration::from_millis(500);
const RUNNING: &str = "running.json";
const INTERRUPTED: &str = "interrupted.json";
const MODELS: &str = "models.json";
/// The failure of a process that left no record of an end, as when it was killed.
pub(super) const ABANDONED: &str = "its process ended without a result";

/// The folder with the records of a unit.
#[derive(Debug)]
pub struct UnitFolder(PathBuf);

/// The state of a unit.
#[derive(Debug, Default)]
pub struct UnitState {
    /// Receipts; more than one if two processes did the same unit.
    pub receipts: Vec<Receipt>,
    /// Failures, the oldest first.
    pub failures: Vec<Failure>,
    /// The process that last began the unit and has not ended it.
    pub running: Option<Running>,
    /// Whether that process no longer exists, although it left no record of an end.
    pub is_abandoned: bool,
    /// The process that was interrupted, if no other one has begun the unit since.
    pub interrupted: Option<Running>,
    /// The models with which the unit's results were made.
    pub models: ModelHashes,
}

/// The right to run a unit, until it is dropped.
#[derive(Debug)]
pub(super) struct Held(#[allow(dead_code, reason = "held until it is dropped")] Lock);

impl UnitFolder {
    /// The folder of a unit in an evaluation's folder, whether or not it exists.
    pub fn of(evaluation: &Path, unit: &str) -> Self {
        Self(evaluation.join("units").join(unit))
    }

    /// Takes the unit for this process, after the process that holds it, if any, has ended. If that process, or an
    /// earlier one, left no record of an end, its failure is recorded. `wait` is called repeatedly, and may return
    /// `false` to stop waiting; the result is then `None`. A file system without locks grants every request: duplicates
    /// are then detected by two receipts.
    ///
    /// # Errors
    /// The folder cannot be written, or records cannot be read or are damaged.
    pub(super) fn hold(&self, wait: &mut dyn FnMut() -> bool) -> Result<Option<Held>> {
        fs::create_dir_all(&self.0).with_context(|| format!("{}: cannot make this folder", self.0.display()))?;
        // A lock that was free or refused shows that the file system has locks: without them, the process of the record
        // may still run.
        let mut has_locks = self.read()?.is_abandoned;
        loop {
            match Lock::take(&self.lock_file(), Access::Alone)? {
                Some(lock) => {
                    if has_locks {
                        self.record_abandoned()?;
                    }
                    return Ok(Some(Held(lock)));
                }
                None if wait() => {
                    has_locks = true;
                    std::thread::sleep(LOCK_WAIT);
                }
                None => return Ok(None),
            }
        }
    }

    /// Reads the state of the unit.
    ///
    /// # Errors
    /// Records cannot be read or are damaged.
    pub fn read(&self) -> Result<UnitState> {
        let mut state = UnitState::default();
        for path in self.entries()? {
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
            if name.starts_with("done-") {
                state.receipts.extend(read_passing_record::<Receipt>(&path)?);
            } else if name.starts_with("failed-") {
                state.failures.push(read_record(&path)?);
            } else if name == RUNNING {
                state.running = read_passing_record(&path)?;
            } else if name == INTERRUPTED {
                state.interrupted = read_passing_record(&path)?;
            } else if name == MODELS {
                state.models = read_record(&path)?;
            }
        }
        state.failures.sort_by_key(|failure| failure.started_secs);
        state.is_abandoned = state.running.is_some() && Lock::is_free(&self.lock_file());
        Ok(state)
    }

    /// Records that this process has begun.
    pub(super) fn begin(&self, by: &Worker) -> Result<Running> {
        let running = Running { by: by.clone(), started_secs: unix_secs() };
        self.write(RUNNING, &running)?;
        let interrupted = self.0.join(INTERRUPTED);
        if interrupted.exists() {
            fs::remove_file(&interrupted).with_context(|| format!("{}: cannot remove", interrupted.display()))?;
        }
        Ok(running)
    }

    /// Records the models with which the unit's results are made.
    pub(super) fn write_models(&self, models: &ModelHashes) -> Result<()> {
        self.write(MODELS, models)
    }

    /// Records that the unit is done.
    pub(super) fn finish(&self, receipt: &Receipt) -> Result<()> {
        self.write(&receipt_name(receipt), receipt)?;
        self.end()
    }

    /// Removes a receipt, which another one replaces.
    pub(super) fn remove_receipt(&self, receipt: &Receipt) -> Result<()> {
        let path = self.0.join(receipt_name(receipt));
        fs::remove_file(&path).with_context(|| format!("{}: cannot remove", path.display()))
    }

    /// Records that the process was interrupted, which is no failure.
    pub(super) fn interrupt(&self, running: &Running) -> Result<()> {
        self.write(INTERRUPTED, running)?;
        self.end()
    }

    /// Records that the unit has failed.
    pub(super) fn fail(&self, failure: &Failure) -> Result<()> {
        self.write(&format!("failed-{}.json", failure.by.file_name_part(failure.started_secs)), failure)?;
        self.end()
    }

    /// Records the failure of the process that began the unit and has neither finished nor ended it.
    fn record_abandoned(&self) -> Result<()> {
        let UnitState { receipts, running: Some(Running { by, started_secs }), .. } = self.read()? else {
            return Ok(());
        };
        // It may have ended between its receipt and the removal of its record.
        if receipts.iter().any(|receipt| (&receipt.by, receipt.started_secs) == (&by, started_secs)) {
            return Ok(());
        }
        let unit = self.0.file_name().unwrap_or_default().to_string_lossy().into_owned();
        // The time of its end is not known.
        self.fail(&Failure { unit, by, started_secs, seconds: 0.0, why: ABANDONED.to_owned() })
    }

    /// Removes the record of [`Self::begin`].
    pub(super) fn end(&self) -> Result<()> {
        let path = self.0.join(RUNNING);
        fs::remove_file(&path).with_context(|| format!("{}: cannot remove", path.display()))
    }

    fn write(&self, name: &str, record: &impl Serialize) -> Result<()> {
        let mut bytes = serde_json::to_vec_pretty(record)?;
        bytes.push(b'\n');
        Ok(write_atomically(&self.0.join(name), &bytes)?)
    }

    fn entries(&self) -> Result<Vec<PathBuf>> {
        Ok(if self.0.exists() { sdg_files::entries(&self.0)? } else { Vec::new() })
    }

    fn lock_file(&self) -> PathBuf {
        self.0.join("lock")
    }
}

fn receipt_name(receipt: &Receipt) -> String {
    format!("done-{}.json", receipt.by.file_name_part(receipt.started_secs))
}

/// A record that a process may remove at any time.
fn read_passing_record<T: DeserializeOwned>(path: &Path) -> Result<Option<T>> {
    match read_record(path) {
        Err(_) if !path.exists() => Ok(None),
        record => record.map(Some),
    }
}

fn read_record<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let bytes = sdg_files::read(path, MAX_RECORD_BYTES)?;
    serde_json::from_slice(&bytes).with_context(|| format!("{}: expected a record of a unit", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn worker() -> Worker {
        Worker { host: "n1".to_owned(), pid: 7, job: None }
    }

    #[test]
    fn a_unit_is_held_by_one_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let unit = UnitFolder::of(folder.path(), "look-pendulum");
        let held = unit.hold(&mut || false).unwrap();
        let mut asked = 0;
        let mut twice = || {
            asked += 1;
            asked < 2
        };
        assert!(held.is_some() && unit.hold(&mut twice).unwrap().is_none());
        assert_eq!(asked, 2);
        unit.begin(&worker()).unwrap();
        let state = unit.read().unwrap();
        assert!(state.running.unwrap().by == worker() && !state.is_abandoned);
        drop(held);
        // The process ended without a record.
        assert!(unit.read().unwrap().is_abandoned);
        assert!(unit.hold(&mut || false).unwrap().is_some());
    }

    #[test]
    fn what_came_of_it_is_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let unit = UnitFolder::of(folder.path(), "look-pendulum");
        assert!(unit.read().unwrap().receipts.is_empty());
        let _held = unit.hold(&mut || false).unwrap();
        let failure = |started_secs, why: &str| Failure {
            unit: "look-pendulum".to_owned(),
            by: worker(),
            started_secs,
            seconds: 1.0,
            why: why.to_owned(),
        };
        for failure in [failure(20, "second"), failure(10, "first")] {
            unit.begin(&worker()).unwrap();
            unit.fail(&failure).unwrap();
        }
        let state = unit.read().unwrap();
        assert!(state.running.is_none() && state.receipts.is_empty());
        assert_eq!(state.failures.iter().map(|failure| failure.why.as_str()).collect::<Vec<_>>(), ["first", "second"]);
        fs::write(folder.path().join("units/look-pendulum/done-x.json"), "{").unwrap();
        assert!(unit.read().unwrap_err().to_string().contains("done-x.json: expected a record of a unit"));
    }
}
