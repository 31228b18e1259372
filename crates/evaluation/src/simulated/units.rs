//! The work units of the protocol, with their dependencies. `work.rs` runs them.

use anyhow::Result;
use sdg_grasp::{ModelKind, Preset, Verification};
use sdg_simulation::objects::ObjectSpec;

use super::cell::{Cell, Marks};
use super::schedule::Task;
use super::store::Store;

/// A piece of work for one worker.
#[derive(Debug, Clone, Copy)]
pub(super) enum Unit<'a> {
    /// A network is taught on a part.
    Teach(Cell<'a>),
    /// All models search a part's pictures; each picture is rendered once.
    Look(&'a ObjectSpec),
    /// A model grasps a part; each attempt is stored on its own.
    Attempts(Cell<'a>, &'a ObjectSpec, Verification),
}

/// Models, parts, and the folder for the results.
pub struct Evaluation<'a> {
    pub models: &'a [ModelKind],
    pub objects: &'a [ObjectSpec],
    /// Network, training and augmentation, as named in the settings of the store.
    pub preset: Preset,
    pub store: &'a Store,
    /// Whether grasps of models with a network are also tried without the check against the demonstration.
    pub unverified: bool,
    /// Number of parallel units.
    pub jobs: usize,
}

impl Evaluation<'_> {
    /// Number of units that are not in the store yet.
    pub fn remaining(&self) -> Result<usize> {
        Ok(self.tasks()?.len() + self.without_speed()?.len())
    }

    /// The verifications to measure: with the check against the demonstration, and without it if requested.
    fn ways(&self, model: ModelKind) -> impl Iterator<Item = Verification> {
        let alone = self.unverified && model.has_network();
        std::iter::once(Verification::ByShape).chain(alone.then_some(Verification::Off))
    }

    pub(super) fn cells<'s>(&'s self, object: &'s ObjectSpec) -> impl Iterator<Item = Cell<'s>> {
        self.models.iter().map(|&model| Cell { model, object: &object.name })
    }

    /// The remaining units, part by part, so that an interrupted evaluation has results for complete parts. Attempts
    /// without the check come last.
    pub(super) fn tasks(&self) -> Result<Vec<Task<Unit<'_>>>> {
        let (store, mut tasks, mut last) = (self.store, Vec::<Task<Unit>>::new(), Vec::new());
        for object in self.objects {
            let mut teachings: Vec<(ModelKind, usize)> = Vec::new();
            for cell in self.cells(object).map(Cell::network) {
                let known = teachings.iter().any(|(network, _)| *network == cell.model);
                if !known && cell.teaching(store)?.is_none() {
                    teachings.push((cell.model, tasks.len()));
                    tasks.push(Task { unit: Unit::Teach(cell), after: Vec::new() });
                }
            }
            let teaching = |cell: Cell| {
                let of_its_network = |(network, _): &&(ModelKind, usize)| *network == cell.network().model;
                teachings.iter().find(of_its_network).map(|(_, task)| *task)
            };
            let mut not_shown = Vec::new();
            for cell in self.cells(object) {
                if self.is_usable(cell)? && cell.look(store)?.is_none() {
                    not_shown.push(cell);
                }
            }
            if !not_shown.is_empty() {
                let after = not_shown.iter().filter_map(|cell| teaching(*cell)).collect();
                tasks.push(Task { unit: Unit::Look(object), after });
            }
            for cell in self.cells(object) {
                for way in self.ways(cell.model) {
                    let done = cell.attempts(way, store)?.len();
                    if self.is_usable(cell)? && done < store.settings().attempts as usize {
                        let after = teaching(cell).into_iter().collect();
                        let task = Task { unit: Unit::Attempts(cell, object, way), after };
                        if way == Verification::ByShape { tasks.push(task) } else { last.push(task) }
                    }
                }
            }
        }
        tasks.extend(last);
        Ok(tasks)
    }

    /// Whether a cell has a model or is still to be taught; false if its teaching has failed.
    fn is_usable(&self, cell: Cell) -> Result<bool> {
        Ok(!cell.is_without_model(Marks::Shipped, self.store)?)
    }

    pub(super) fn without_speed(&self) -> Result<Vec<&ObjectSpec>> {
        let mut without = Vec::new();
        for object in self.objects {
            for cell in self.cells(object) {
                if self.is_usable(cell)? && cell.speed(self.store)?.is_none() {
                    without.push(object);
                    break;
                }
            }
        }
        Ok(without)
    }
}

impl std::fmt::Display for Unit<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Teach(cell) => write!(f, "teach {} {}", cell.model, cell.object),
            Self::Look(object) => write!(f, "look {}", object.name),
            Self::Attempts(cell, _, Verification::ByShape) => write!(f, "grasp {} {}", cell.model, cell.object),
            Self::Attempts(cell, _, Verification::Off) => write!(f, "grasp {} {} unverified", cell.model, cell.object),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{AttemptRecord, AttemptsRecord, LookRecord, Settings, TeachingRecord};

    #[test]
    fn models_that_share_a_network_wait_for_one_teaching() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), &Settings::for_test(1, 2, 1)).unwrap();
        let objects = [ObjectSpec::by_name("pendulum").unwrap(), ObjectSpec::by_name("rod_end").unwrap()];
        let evaluation = Evaluation {
            models: &[ModelKind::B, ModelKind::C],
            objects: &objects,
            preset: Preset::Edge,
            store: &store,
            unverified: true,
            jobs: 1,
        };
        let listed = |tasks: &[Task<Unit>]| -> Vec<String> {
            tasks.iter().map(|task| format!("{} {:?}", task.unit, task.after)).collect()
        };
        let tasks = listed(&evaluation.tasks().unwrap());
        assert_eq!(
            tasks[..4],
            ["teach C pendulum []", "look pendulum [0, 0]", "grasp B pendulum [0]", "grasp C pendulum [0]"]
        );
        assert_eq!(
            tasks[8..],
            [
                "grasp B pendulum unverified [0]",
                "grasp C pendulum unverified [0]",
                "grasp B rod_end unverified [4]",
                "grasp C rod_end unverified [4]"
            ]
        );

        // Finished units are not done again, and a part whose teaching failed needs no further work.
        let failed = TeachingRecord::Failed { why: "nothing learnt".into() };
        store.write("cells/C-pendulum.teaching.json", &failed).unwrap();
        let attempt = |number| AttemptRecord::failed(number, "detect", "not found".into());
        let done = AttemptsRecord::new(vec![attempt(1), attempt(2)]);
        store.write("cells/C-rod_end.attempts-verified.json", &done).unwrap();
        store.write("cells/B-rod_end.look.json", &LookRecord::default()).unwrap();
        assert_eq!(
            listed(&evaluation.tasks().unwrap()),
            [
                "teach C rod_end []",
                "look rod_end [0]",
                "grasp B rod_end [0]",
                "grasp B rod_end unverified [0]",
                "grasp C rod_end unverified [0]"
            ]
        );
        assert_eq!(evaluation.remaining().unwrap(), 5 + 1);
    }
}
