//! Progress of the units in a folder, for `--watch`.

use std::collections::HashMap;
use std::fmt;
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use serde::Serialize;

use super::unit_folder::{ABANDONED, UnitFolder};
use super::unit_list::{SavedUnit, UnitKind, UnitList};
use super::worker::{Worker, unix_secs};

/// Number of failures after which a unit is not tried again: unit_job.sh requeues a failed unit once.
const MAX_TRIES: usize = 2;
/// Maximum number of running units, and of failed units, in the list.
const MAX_LISTED: usize = 12;

/// Watches a folder. Finished units are not read again.
#[derive(Debug)]
pub struct Watch {
    folder: PathBuf,
    /// Duration in seconds of each finished unit, and the number of its files: further models add files to a unit.
    done: HashMap<String, (f64, usize)>,
}

/// Progress of the units in a folder.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Progress {
    pub units: usize,
    pub done: usize,
    pub running: Vec<RunningUnit>,
    pub failed: Vec<FailedUnit>,
    /// Units whose process was interrupted, as by the time limit of its task, and that have not begun again.
    pub interrupted: Vec<InterruptedUnit>,
    /// Number of units that are neither done nor begun.
    pub waiting: usize,
    /// Estimated remaining seconds with the current number of running units; `None` before the first unit is done.
    pub seconds_left: Option<f64>,
    /// Number of finished units and of all units of each kind.
    pub kinds: Vec<KindProgress>,
    /// Whether the progress is final unless units are submitted again: all units are done, have failed twice, were
    /// interrupted, or wait for such a unit.
    pub is_settled: bool,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KindProgress {
    pub kind: UnitKind,
    pub done: usize,
    pub units: usize,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunningUnit {
    pub unit: String,
    pub by: Worker,
    /// Seconds since the start.
    pub seconds: u64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FailedUnit {
    pub unit: String,
    pub by: Worker,
    pub why: String,
    /// Number of failures.
    pub tries: usize,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InterruptedUnit {
    pub unit: String,
    pub by: Worker,
}

impl Watch {
    /// Watches the units in a folder.
    ///
    /// # Errors
    /// The folder has no units.
    pub fn new(folder: &Path) -> Result<Self> {
        if UnitList::read_all(folder)?.units.is_empty() {
            bail!("{}: expected a folder in which units of an evaluation are done, found no plan", folder.display());
        }
        Ok(Self { folder: folder.to_owned(), done: HashMap::new() })
    }

    /// The current progress.
    ///
    /// # Errors
    /// Records cannot be read.
    pub fn progress(&mut self) -> Result<Progress> {
        let plan = UnitList::read_all(&self.folder)?;
        let (mut running, mut failed, mut waiting) = (Vec::new(), Vec::new(), Vec::new());
        let mut interrupted: Vec<InterruptedUnit> = Vec::new();
        for unit in &plan.units {
            if self.done.get(&unit.name).is_some_and(|(_, num_files)| *num_files == unit.files.len()) {
                continue;
            }
            self.done.remove(&unit.name);
            let state = UnitFolder::of(&self.folder, &unit.name).read()?;
            let tries = state.failures.len() + usize::from(state.is_abandoned);
            let name = unit.name.clone();
            let receipt = state.receipts.iter().find(|receipt| receipt.covers(&unit.files));
            match (receipt, state.running, state.failures.last()) {
                (Some(receipt), ..) => {
                    self.done.insert(name, (receipt.seconds, unit.files.len()));
                }
                (None, Some(now), _) if !state.is_abandoned => {
                    let seconds = unix_secs().saturating_sub(now.started_secs);
                    running.push(RunningUnit { unit: name, by: now.by, seconds });
                }
                (None, Some(last), _) => {
                    failed.push(FailedUnit { unit: name, by: last.by, why: ABANDONED.to_owned(), tries });
                }
                (None, None, _) if state.interrupted.is_some() => {
                    interrupted.extend(state.interrupted.map(|last| InterruptedUnit { unit: name, by: last.by }));
                }
                (None, None, Some(failure)) => {
                    let (by, why) = (failure.by.clone(), failure.why.clone());
                    failed.push(FailedUnit { unit: name, by, why, tries });
                }
                (None, None, None) => waiting.push(unit),
            }
        }
        let is_lost = |name: &str| {
            failed.iter().any(|failed| failed.unit == name && failed.tries >= MAX_TRIES)
                || interrupted.iter().any(|interrupted| interrupted.unit == name)
        };
        let can_change = |name: &str, after: &[String]| !is_lost(name) && !after.iter().any(|before| is_lost(before));
        let of_name: HashMap<&str, &SavedUnit> = plan.units.iter().map(|unit| (unit.name.as_str(), unit)).collect();
        let is_settled = running.is_empty()
            && !waiting.iter().any(|unit| can_change(&unit.name, &unit.after))
            && !failed.iter().any(|unit| can_change(&unit.unit, &of_name[unit.unit.as_str()].after));
        let count = |kind: UnitKind| KindProgress {
            kind,
            done: self.done.keys().filter(|name| UnitKind::of(name) == Some(kind)).count(),
            units: plan.units.iter().filter(|unit| UnitKind::of(&unit.name) == Some(kind)).count(),
        };
        Ok(Progress {
            units: plan.units.len(),
            done: self.done.len(),
            waiting: waiting.len(),
            seconds_left: self.seconds_left(&plan, running.len()),
            kinds: UnitKind::ALL.map(count).to_vec(),
            is_settled,
            running,
            failed,
            interrupted,
        })
    }

    /// Estimates the remaining seconds from the durations of finished units of the same kind, or of all finished units
    /// if there are none of that kind.
    fn seconds_left(&self, plan: &UnitList, running: usize) -> Option<f64> {
        let mean = |kind: Option<UnitKind>| {
            let of_kind = self.done.iter().filter(|(name, _)| kind.is_none() || UnitKind::of(name) == kind);
            let seconds: Vec<f64> = of_kind.map(|(_, (seconds, _))| *seconds).collect();
            (!seconds.is_empty()).then(|| seconds.iter().sum::<f64>() / seconds.len() as f64)
        };
        let of_all = mean(None)?;
        let means = UnitKind::ALL.map(|kind| mean(Some(kind)).unwrap_or(of_all));
        let left = plan.units.iter().filter(|unit| !self.done.contains_key(&unit.name));
        let seconds: f64 = left.filter_map(|unit| UnitKind::of(&unit.name)).map(|kind| means[kind as usize]).sum();
        Some(seconds / running.max(1) as f64)
    }
}

impl fmt::Display for Progress {
    /// The text of a screen. Its first line is complete by itself.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} of {} units done, {} running, {} failed, {} waiting",
            self.done,
            self.units,
            self.running.len(),
            self.failed.len(),
            self.waiting
        )?;
        if !self.interrupted.is_empty() {
            write!(f, ", {} interrupted", self.interrupted.len())?;
        }
        match self.seconds_left {
            Some(seconds) if self.done < self.units => writeln!(f, "; about {} left", duration(seconds))?,
            _ => writeln!(f)?,
        }
        let kinds = self.kinds.iter().filter(|kind| kind.units > 0);
        let kinds: Vec<String> = kinds.map(|kind| format!("{} {} of {}", kind.kind, kind.done, kind.units)).collect();
        writeln!(f, "{}", kinds.join(", "))?;
        if !self.running.is_empty() {
            writeln!(f, "running:")?;
        }
        for unit in self.running.iter().take(MAX_LISTED) {
            writeln!(f, "  {}  on {} for {}", unit.unit, unit.by, duration(unit.seconds as f64))?;
        }
        more(f, self.running.len())?;
        if !self.failed.is_empty() {
            writeln!(f, "failed:")?;
        }
        for unit in self.failed.iter().take(MAX_LISTED) {
            let tries = if unit.tries == 1 { "once".to_owned() } else { format!("{} times", unit.tries) };
            writeln!(f, "  {}  {tries}, last on {}: {}", unit.unit, unit.by, unit.why)?;
        }
        more(f, self.failed.len())?;
        if !self.interrupted.is_empty() {
            writeln!(f, "interrupted:")?;
        }
        for unit in self.interrupted.iter().take(MAX_LISTED) {
            writeln!(f, "  {}  on {}", unit.unit, unit.by)?;
        }
        more(f, self.interrupted.len())
    }
}

/// A line for the units that are not listed.
fn more(f: &mut fmt::Formatter<'_>, listed: usize) -> fmt::Result {
    if listed > MAX_LISTED { writeln!(f, "  and {} more", listed - MAX_LISTED) } else { Ok(()) }
}

fn duration(seconds: f64) -> String {
    let seconds = seconds.round() as u64;
    match seconds {
        0..60 => format!("{seconds} s"),
        60..3600 => format!("{} min {} s", seconds / 60, seconds % 60),
        _ => format!("{} h {} min", seconds / 3600, seconds / 60 % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_whose_process_was_killed_twice_is_settled() {
        let folder = tempfile::tempdir().unwrap();
        let saved = SavedUnit { name: "look-pendulum".to_owned(), after: Vec::new(), files: Vec::new() };
        UnitList { units: vec![saved] }.save(folder.path()).unwrap();
        let unit = UnitFolder::of(folder.path(), "look-pendulum");
        for tries in 1..=MAX_TRIES {
            let held = unit.hold(&mut || false).unwrap();
            unit.begin(&Worker::this()).unwrap();
            // The process ends without a record.
            drop(held);
            let progress = Watch::new(folder.path()).unwrap().progress().unwrap();
            assert_eq!((progress.failed[0].tries, progress.is_settled), (tries, tries == MAX_TRIES));
        }
    }

    #[test]
    fn an_interrupted_unit_is_settled_until_it_begins_again() {
        let folder = tempfile::tempdir().unwrap();
        let saved = |name: &str, after: &[&str]| SavedUnit {
            name: name.to_owned(),
            after: after.iter().map(|&name| name.to_owned()).collect(),
            files: Vec::new(),
        };
        let units = vec![saved("teach-S-pendulum", &[]), saved("look-pendulum", &["teach-S-pendulum"])];
        UnitList { units }.save(folder.path()).unwrap();
        let progress = || Watch::new(folder.path()).unwrap().progress().unwrap();
        assert!(!progress().is_settled);
        let unit = UnitFolder::of(folder.path(), "teach-S-pendulum");
        let _held = unit.hold(&mut || false).unwrap();
        let running = unit.begin(&Worker::this()).unwrap();
        unit.interrupt(&running).unwrap();
        let interrupted = progress();
        assert!(interrupted.is_settled && interrupted.failed.is_empty() && interrupted.waiting == 1);
        let text = interrupted.to_string();
        assert!(text.starts_with("0 of 2 units done, 0 running, 0 failed, 1 waiting, 1 interrupted\n"), "{text}");
        assert!(text.ends_with(&format!("interrupted:\n  teach-S-pendulum  on {}\n", Worker::this())), "{text}");
        unit.begin(&Worker::this()).unwrap();
        let again = progress();
        assert!(!again.is_settled && again.interrupted.is_empty() && again.running.len() == 1);
    }
}
