//! The units of work, and how each is done.

use std::ops::ControlFlow;
use std::time::Instant;

use anyhow::{Context, Result};
use sdg_grasp::{ModelKind, Preset, Verification};
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::scene::{TestView, test_views};

use super::attempting::go_on;
use super::caught::{NO_MODEL, caught};
use super::cell::{Cell, Marks, attempts_of};
use super::looking::{observe_picture, part_seed, picture_seed, scene_without};
use super::records::{LookRecord, SpeedRecord};
use super::schedule::{Task, run_all};
use super::store::Store;
use super::teaching::Teaching;
use crate::progress::EvaluationProgress;
use crate::rehearsal::{Rehearsal, RehearsalErrors};
use crate::trial::try_view;

/// Pictures on which speed is measured, for each part.
const SPEED_VIEWS: usize = 3;

/// What is kept or lost as a whole.
#[derive(Debug, Clone, Copy)]
enum Unit<'a> {
    /// A network is taught on a part.
    Teach(Cell<'a>),
    /// All models look at a part's pictures: each picture is drawn once.
    Look(&'a ObjectSpec),
    /// A model grasps a part; kept attempt by attempt.
    Attempts(Cell<'a>, &'a ObjectSpec, Verification),
}

/// Models, parts, and the folder for what becomes of them.
pub struct Evaluation<'a> {
    pub models: &'a [ModelKind],
    pub objects: &'a [ObjectSpec],
    /// Network, training and augmentation: what the store's settings name.
    pub preset: Preset,
    pub store: &'a Store,
    /// Whether every grasp is also tried without the check against the demonstration.
    pub unverified: bool,
    /// Units side by side.
    pub jobs: usize,
}

impl Evaluation<'_> {
    /// Does what is not in the store yet; breaks when `is_interrupted` says so, with everything kept that has ended.
    ///
    /// # Errors
    /// Files that cannot be read or written, and errors of the simulator itself. A teaching that fails is a result.
    pub fn run(
        &self,
        is_interrupted: &(dyn Fn() -> bool + Sync),
        progress: &EvaluationProgress,
    ) -> Result<ControlFlow<()>> {
        let tasks = self.tasks()?;
        let without_speed = self.without_speed()?;
        progress.expect(tasks.len() + without_speed.len());
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let work = |unit: &Unit| {
            if is_interrupted() {
                return Ok(ControlFlow::Break(()));
            }
            caught(|| self.work(*unit, is_interrupted, progress)).with_context(|| unit.to_string())
        };
        run_all(&tasks, self.jobs, (cores / self.jobs.max(1)).max(1), &work)?;
        for object in without_speed {
            if is_interrupted() {
                break;
            }
            self.measure_speed(object, cores)?;
            progress.unit_done(&format!("time {}: done", object.name));
        }
        Ok(if self.remaining()? > 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
    }

    /// How many units are not in the store yet.
    pub fn remaining(&self) -> Result<usize> {
        Ok(self.tasks()?.len() + self.without_speed()?.len())
    }

    /// With the check against the demonstration; and without it where that is asked for.
    fn ways(&self, model: ModelKind) -> impl Iterator<Item = Verification> {
        let alone = self.unverified && model.has_network();
        std::iter::once(Verification::ByShape).chain(alone.then_some(Verification::Off))
    }

    fn cells<'s>(&'s self, object: &'s ObjectSpec) -> impl Iterator<Item = Cell<'s>> {
        self.models.iter().map(|&model| Cell { model, object: &object.name })
    }

    /// What is not in the store yet, part by part, so that an interrupted evaluation has whole parts to show. Attempts
    /// without the check come last of all.
    fn tasks(&self) -> Result<Vec<Task<Unit<'_>>>> {
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

    /// Not so once its teaching has failed: then there is nothing left to do for it.
    fn is_usable(&self, cell: Cell) -> Result<bool> {
        Ok(!cell.is_without_model(Marks::Shipped, self.store)?)
    }

    fn without_speed(&self) -> Result<Vec<&ObjectSpec>> {
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

    fn work(
        &self,
        unit: Unit,
        is_interrupted: &(dyn Fn() -> bool + Sync),
        progress: &EvaluationProgress,
    ) -> Result<ControlFlow<()>> {
        let started = Instant::now();
        let summary = match unit {
            Unit::Teach(cell) => {
                let teaching = Teaching { store: self.store, preset: self.preset, jobs: self.jobs };
                teaching.teach(cell, Marks::Shipped, is_interrupted)?
            }
            Unit::Look(object) => self.look(object, is_interrupted)?,
            Unit::Attempts(cell, object, way) => self.attempt(cell, object, way, is_interrupted)?,
        };
        let Some(summary) = summary else { return Ok(ControlFlow::Break(())) };
        progress.unit_done(&format!("{unit}: {summary} ({:.0} s)", started.elapsed().as_secs_f64()));
        Ok(ControlFlow::Continue(()))
    }

    /// Shows every model of a part that has not seen them the same pictures.
    fn look(&self, object: &ObjectSpec, is_interrupted: &(dyn Fn() -> bool + Sync)) -> Result<Option<String>> {
        let settings = self.store.settings();
        let mut looks = Vec::new();
        for cell in self.cells(object) {
            if cell.look(self.store)?.is_none()
                && let Some(model) = cell.read_model_at_fixed_height(self.store)?
            {
                looks.push((cell, model, LookRecord::default(), None));
            }
        }
        for number in 0..u64::from(settings.views) {
            let seed = picture_seed(settings.seed, object, number);
            let seen = test_views(object, true, 1, seed).next().context("a picture")??;
            if is_interrupted() {
                return Ok(None);
            }
            for (_, model, record, drawn) in &mut looks {
                let (picture_record, trial) = observe_picture(model, object, &seen, seed, None)?;
                record.present.push(picture_record);
                drawn.get_or_insert(trial.drawn);
            }
        }
        for number in 0..u64::from(settings.scenes) {
            let seed = picture_seed(settings.seed, object, number);
            let (seen, other_part) = scene_without(object, number, seed)?;
            if is_interrupted() {
                return Ok(None);
            }
            for (_, model, record, _) in &mut looks {
                record.absent.push(observe_picture(model, object, &seen, seed, other_part)?.0);
            }
        }
        let mut summary = Vec::new();
        for (cell, _, record, drawn) in looks {
            if let Some(drawn) = drawn {
                let mut png = std::io::Cursor::new(Vec::new());
                drawn.write_to(&mut png, image::ImageFormat::Png)?;
                self.store.write_bytes(&cell.picture_file(), &png.into_inner())?;
            }
            self.store.write(&cell.file("look"), &record)?;
            let right = record.present.iter().filter(|p| p.verified.is_right()).count();
            let false_alarms = record.absent.iter().filter(|p| p.verified.is_accepted()).count();
            summary.push(format!("{} right on {right}, {false_alarms} false alarms", cell.model));
        }
        Ok(Some(if summary.is_empty() { NO_MODEL.to_owned() } else { summary.join("; ") }))
    }

    /// Goes on with a cell's attempts.
    fn attempt(
        &self,
        cell: Cell,
        object: &ObjectSpec,
        verification: Verification,
        is_interrupted: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<String>> {
        let settings = self.store.settings();
        let Some(model) = cell.read_model_at_fixed_height(self.store)? else { return Ok(Some(NO_MODEL.to_owned())) };
        let seed = part_seed(settings.seed, object);
        let rehearsal = Rehearsal {
            model: &model,
            object,
            attempts: settings.attempts,
            seed,
            verification,
            errors: RehearsalErrors::default(),
            camera: None,
        };
        let attempts = go_on(&rehearsal, self.store, &cell.file(&attempts_of(verification)), settings, is_interrupted)?;
        Ok(attempts.map(|attempts| {
            let held = attempts.iter().filter(|attempt| attempt.success).count();
            format!("held in {held} of {}", attempts.len())
        }))
    }

    /// Times detections with nothing of ours beside them, on all cores.
    fn measure_speed(&self, object: &ObjectSpec, cores: usize) -> Result<()> {
        let seed = picture_seed(self.store.settings().seed, object, 0);
        let pictures: Vec<TestView> = test_views(object, true, SPEED_VIEWS, seed).collect::<Result<_, _>>()?;
        for cell in self.cells(object) {
            if cell.speed(self.store)?.is_some() {
                continue;
            }
            let Some(model) = cell.read_model(Marks::Shipped, self.store)? else { continue };
            let timed = |verification: Verification| -> Result<Vec<f64>> {
                // The first one packs weights and fills caches.
                model.detect(&pictures[0].view.image, verification)?;
                pictures.iter().map(|seen| Ok(try_view(&model, object, seen, verification)?.seconds)).collect()
            };
            let record = SpeedRecord {
                cores,
                verified_secs: timed(Verification::ByShape)?,
                alone_secs: if cell.model.has_network() { timed(Verification::Off)? } else { Vec::new() },
            };
            self.store.write(&cell.file("speed"), &record)?;
        }
        Ok(())
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
    use crate::evaluation::{AttemptRecord, AttemptsRecord, Settings, TeachingRecord};

    fn settings() -> Settings {
        Settings {
            protocol: Settings::PROTOCOL,
            preset: "edge".into(),
            steps: None,
            seed: 1,
            attempts: 2,
            views: 1,
            scenes: 1,
        }
    }

    #[test]
    fn models_that_share_a_network_wait_for_one_teaching() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), &settings()).unwrap();
        let objects = [ObjectSpec::by_name("pendulum").unwrap(), ObjectSpec::by_name("rod_end").unwrap()];
        let evaluation = Evaluation {
            models: &[ModelKind::B, ModelKind::C],
            objects: &objects,
            preset: Preset::Edge,
            store: &store,
            unverified: true,
            jobs: 1,
        };
        let told = |tasks: &[Task<Unit>]| -> Vec<String> {
            tasks.iter().map(|task| format!("{} {:?}", task.unit, task.after)).collect()
        };
        let tasks = told(&evaluation.tasks().unwrap());
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

        // What is there is not done again; a part whose teaching failed needs nothing more.
        let failed = TeachingRecord::Failed { why: "nothing learnt".into() };
        store.write("cells/C-pendulum.teaching.json", &failed).unwrap();
        let attempt = |number| AttemptRecord::failed(number, "detect", "not found".into());
        let done = AttemptsRecord::new(vec![attempt(1), attempt(2)]);
        store.write("cells/C-rod_end.attempts-verified.json", &done).unwrap();
        store.write("cells/B-rod_end.look.json", &LookRecord::default()).unwrap();
        assert_eq!(
            told(&evaluation.tasks().unwrap()),
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
