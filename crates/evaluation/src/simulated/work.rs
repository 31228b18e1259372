//! Runs the work units of the protocol.

use std::ops::ControlFlow;

use anyhow::{Context, Result};
use sdg_grasp::Verification;
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::views::{TestView, test_views};

use super::attempting::{go_on, held_of};
use super::cell::{Cell, Marks, attempts_of};
use super::looking::{observe_picture, part_seed, picture_seed, scene_without};
use super::one_unit::{NO_MODEL, do_unit};
use super::records::{LookRecord, SpeedRecord};
use super::schedule::run_all;
use super::teaching::Teaching;
use super::units::{Evaluation, Unit};
use crate::progress::Progress;
use crate::rehearsal::{Rehearsal, RehearsalErrors};
use crate::trial::try_view;

/// Number of pictures on which speed is measured, for each part.
const SPEED_VIEWS: usize = 3;

impl Evaluation<'_> {
    /// Runs the remaining units until `is_interrupted` returns true, and keeps all finished units.
    ///
    /// # Errors
    /// Files cannot be read or written, or the simulator fails. A failed teaching run is not an error.
    pub fn run(&self, is_interrupted: &(dyn Fn() -> bool + Sync), progress: &dyn Progress) -> Result<ControlFlow<()>> {
        let tasks = self.tasks()?;
        let without_speed = self.without_speed()?;
        progress.expect(tasks.len() + without_speed.len());
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let work = |unit: &Unit| {
            do_unit(unit, is_interrupted, progress, || self.work(*unit, is_interrupted))
                .with_context(|| unit.to_string())
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

    pub(super) fn work(&self, unit: Unit, is_interrupted: &(dyn Fn() -> bool + Sync)) -> Result<Option<String>> {
        match unit {
            Unit::Teach(cell) => {
                let teaching = Teaching { store: self.store, preset: self.preset, jobs: self.jobs };
                teaching.teach(cell, Marks::Shipped, is_interrupted)
            }
            Unit::Look(object) => self.look(object, is_interrupted),
            Unit::Attempts(cell, object, way) => self.attempt(cell, object, way, is_interrupted),
        }
    }

    /// Runs all models that have not been run yet on a part's pictures, which are the same for every model.
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
            summary.push(format!("{}: {right} correct, {false_alarms} false alarms", cell.model));
        }
        Ok(Some(if summary.is_empty() { NO_MODEL.to_owned() } else { summary.join("; ") }))
    }

    /// Continues a cell's attempts.
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
            place: None,
        };
        let attempts = go_on(&rehearsal, self.store, &cell.file(&attempts_of(verification)), settings, is_interrupted)?;
        Ok(attempts.map(|attempts| held_of(&attempts)))
    }

    /// Measures the duration of detections on all cores, without other work in this process.
    pub(super) fn measure_speed(&self, object: &ObjectSpec, cores: usize) -> Result<()> {
        let seed = picture_seed(self.store.settings().seed, object, 0);
        let pictures: Vec<TestView> = test_views(object, true, SPEED_VIEWS, seed).collect::<Result<_, _>>()?;
        for cell in self.cells(object) {
            if cell.speed(self.store)?.is_some() {
                continue;
            }
            let Some(model) = cell.read_model(Marks::Shipped, self.store)? else { continue };
            let timed = |verification: Verification| -> Result<Vec<f64>> {
                // The first detection takes longer, because it packs weights and fills caches.
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
