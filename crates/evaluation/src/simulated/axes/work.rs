//! Runs the work units of the axes.

use std::ops::ControlFlow;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use anyhow::{Context, Result};
use nalgebra::Isometry3;
use sdg_grasp::{GraspModel, Verification};
use sdg_inputs::one_line;
use sdg_simulation::objects::{LookAlikeKind, ObjectSpec};
use sdg_simulation::views::{Axis, AxisView, PICTURES_PER_AXIS, axis_view};
use sdg_simulation::{AttemptErrors, SimulationError};

use super::matching::{place, tolerance_on};
use super::records::{AxisPicture, AxisRecord, LookAlike};
use super::selection::GraspCondition;
use super::units::{AxesEvaluation, Unit, axis_file, grasps_file, marks_of};
use crate::progress::Progress;
use crate::rehearsal::{Rehearsal, RehearsalErrors};
use crate::simulated::attempting::{go_on, held_of};
use crate::simulated::cell::{Cell, Marks, attempts_of};
use crate::simulated::looking::part_seed;
use crate::simulated::one_unit::{NO_MODEL, do_unit};
use crate::simulated::schedule::run_all;
use crate::simulated::teaching::Teaching;

/// Maximum number of scenes that are tried for a picture.
const MAX_DRAWINGS: u64 = 8;

/// The result of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunEnd {
    /// Number of units that are not in the store.
    pub remaining: usize,
    /// The errors of failed units.
    pub failures: Vec<String>,
}

impl AxesEvaluation<'_> {
    /// Runs the remaining units until `is_interrupted` returns true, and keeps finished units. A failed unit does not
    /// end other units, so that hours of work do not depend on one part: the error is printed, and the unit is tried
    /// again in the next run.
    ///
    /// # Errors
    /// The store cannot be read. A teaching run without a model is not an error.
    pub fn run(&self, is_interrupted: &(dyn Fn() -> bool + Sync), progress: &dyn Progress) -> Result<RunEnd> {
        let tasks = self.tasks()?;
        progress.expect(tasks.len());
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let failures = Mutex::new(Vec::new());
        let work = |unit: &Unit| {
            do_unit(unit, is_interrupted, progress, || self.work(*unit, is_interrupted)).or_else(|error| {
                let failure = format!("{unit}: {}", one_line(&error));
                progress.unit_done(&format!("failed: {failure}"));
                failures.lock().unwrap_or_else(PoisonError::into_inner).push(failure);
                Ok(ControlFlow::Continue(()))
            })
        };
        run_all(&tasks, self.jobs, (cores / self.jobs.max(1)).max(1), &work)?;
        let failures = failures.into_inner().unwrap_or_else(PoisonError::into_inner);
        Ok(RunEnd { remaining: self.remaining()?, failures })
    }

    fn work(&self, unit: Unit, is_interrupted: &(dyn Fn() -> bool + Sync)) -> Result<Option<String>> {
        match unit {
            Unit::Teach(cell, marks) => {
                let teaching = Teaching { store: self.store, preset: self.preset, jobs: self.jobs };
                teaching.teach(cell, marks, is_interrupted)
            }
            Unit::Pictures(object, axis) => self.detect_in_pictures(object, axis, is_interrupted),
            Unit::Grasps(cell, object, condition) => self.grasp(cell, object, condition, is_interrupted),
        }
    }

    /// The model of a cell, with this evaluation's number of search points.
    fn model(&self, cell: Cell, marks: Marks) -> Result<Option<GraspModel>> {
        let model = cell.read_model(marks, self.store)?;
        Ok(match (model, self.search_points) {
            (Some(model), Some(points)) if !cell.model.has_network() => {
                Some(model.with_search_points(points as usize)?)
            }
            (model, _) => model,
        })
    }

    /// Runs every model that has not been run yet on a part's pictures of an axis.
    fn detect_in_pictures(
        &self,
        object: &ObjectSpec,
        axis: Axis,
        is_interrupted: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<String>> {
        let mut shown = Vec::new();
        for &model in self.models {
            let cell = Cell { model, object: &object.name };
            if self.axis_record(cell, axis)?.is_none()
                && let Some(model) = self.model(cell, Marks::Shipped)?
            {
                shown.push((cell, model, AxisRecord { pictures: Vec::new(), seconds: 0.0 }));
            }
        }
        if shown.is_empty() {
            return Ok(Some(NO_MODEL.to_owned()));
        }
        let num_shown = shown.len() as f64;
        for number in 0..u64::from(self.axis_views) {
            if is_interrupted() {
                return Ok(None);
            }
            let started = Instant::now();
            let view = draw(object, axis, (number, u64::from(self.axis_views)), self.store.settings().seed)?;
            let drawing_secs = started.elapsed().as_secs_f64();
            for (_, model, record) in &mut shown {
                let started = Instant::now();
                record.pictures.push(ask(model, object, number, &view)?);
                record.seconds += started.elapsed().as_secs_f64() + drawing_secs / num_shown;
            }
        }
        let mut summary = Vec::new();
        for (cell, _, record) in shown {
            self.store.write_made_with(&axis_file(cell, axis), &self.axis_settings(), &record)?;
            let found: usize = record
                .pictures
                .iter()
                .map(|picture| (0..picture.visible.len()).filter(|&i| picture.verified.has_found(i)).count())
                .sum();
            let wrong: usize = record.pictures.iter().map(|picture| picture.verified.num_wrong()).sum();
            summary.push(format!("{} found {found}, {wrong} wrong", cell.model));
        }
        Ok(Some(summary.join("; ")))
    }

    /// Continues a cell's attempts under an error.
    fn grasp(
        &self,
        cell: Cell,
        object: &ObjectSpec,
        condition: GraspCondition,
        is_interrupted: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<String>> {
        let Some(model) = self.model(cell, marks_of(condition))? else { return Ok(Some(NO_MODEL.to_owned())) };
        let settings = self.store.settings();
        let rehearsal = Rehearsal {
            model: &model,
            object,
            attempts: settings.attempts,
            // The scenes are those of the paper's protocol, so that only the error differs.
            seed: part_seed(settings.seed, object),
            verification: Verification::ByShape,
            errors: errors_of(condition),
            camera: None,
            place: None,
        };
        let attempts = if self.is_in_protocol(condition) {
            let file = cell.file(&attempts_of(Verification::ByShape));
            go_on(&rehearsal, self.store, &file, settings, is_interrupted)?
        } else {
            go_on(&rehearsal, self.store, &grasps_file(cell, condition), &self.grasp_settings(), is_interrupted)?
        };
        Ok(attempts.map(|attempts| held_of(&attempts)))
    }
}

/// The errors in the attempts of a condition.
fn errors_of(condition: GraspCondition) -> RehearsalErrors {
    let workcell =
        |errors: fn(u64) -> AttemptErrors| RehearsalErrors { of_workcell: Some(errors), ..RehearsalErrors::default() };
    match condition {
        // Jittered marks are an error of teaching.
        GraspCondition::NoError | GraspCondition::Marks => RehearsalErrors::default(),
        GraspCondition::MarkHeight => RehearsalErrors { mark_height_m: 0.003, ..RehearsalErrors::default() },
        GraspCondition::HandEye => workcell(AttemptErrors::hand_eye),
        GraspCondition::Friction => workcell(AttemptErrors::friction),
        GraspCondition::Shake => workcell(AttemptErrors::shake),
    }
}

/// Renders picture `number` (of `of`) of an axis. If a scene has no room for camera, cover or instances, another scene
/// for the same stratum of the axis is tried.
pub(crate) fn draw(object: &ObjectSpec, axis: Axis, (number, of): (u64, u64), seed: u64) -> Result<AxisView> {
    let mut impossible = None;
    for round in 0..MAX_DRAWINGS {
        // Complete rounds, so that the stratum is the same.
        let further = round * PICTURES_PER_AXIS * 1000;
        match axis_view(object, axis, (number + further, of + further), seed) {
            Err(error @ SimulationError::Configuration { .. }) => impossible = Some(error),
            drawn => return drawn.with_context(|| format!("picture {number}")),
        }
    }
    Err(impossible.map_or_else(|| anyhow::anyhow!("no picture"), Into::into))
        .with_context(|| format!("picture {number}, drawn {MAX_DRAWINGS} times"))
}

/// A model's detections in a picture, with the check and without.
fn ask(model: &GraspModel, object: &ObjectSpec, number: u64, view: &AxisView) -> Result<AxisPicture> {
    let instances: Vec<Isometry3<f64>> = view.truths.iter().map(|truth| truth.grasp.base_from_object).collect();
    let answer = |verification| -> Result<_> {
        let detections = model.detect(&view.view.image, verification)?;
        Ok(place(object, &view.view.camera, &detections, &instances, tolerance_on(view.axis)))
    };
    Ok(AxisPicture {
        number,
        parameter: view.parameter.value,
        unit: view.parameter.unit.to_owned(),
        visible: view.truths.iter().map(|truth| truth.visible_share).collect(),
        look_alike: view.look_alike.map(look_alike),
        verified: answer(Verification::ByShape)?,
        alone: if model.kind().has_network() { Some(answer(Verification::Off)?) } else { None },
    })
}

fn look_alike(kind: LookAlikeKind) -> LookAlike {
    LookAlike { kind: kind.to_string(), differs_in_size_alone: matches!(kind, LookAlikeKind::Scaled { .. }) }
}
