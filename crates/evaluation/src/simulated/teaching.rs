//! Teaches a network on a part and stores it.

use std::ops::ControlFlow;
use std::time::Duration;

use anyhow::Result;
use sdg_demonstration::Demonstration;
use sdg_grasp::{CameraOverTable, History, Lengths, Preset, StepRecord, TeachOptions, TeachingEvent, seen_from_above};
use sdg_inputs::one_line;
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::views::demonstration_view;

use super::cell::{Cell, Marks};
use super::jitter::{MARKS_JITTER_PX, with_jittered_marks};
use super::looking::part_seed;
use super::one_unit::caught;
use super::records::{LOSS_STEPS, TeachingRecord};
use super::store::Store;
use crate::shipped;
use crate::taught_file::TaughtFile;

/// Places of the part in further photos: near the borders of the picture, where the lines of sight are inclined by 18°.
const FURTHER_PLACES: [(f64, f64, f64); 2] = [(0.5, 0.18, 0.9), (0.5, -0.18, 2.5)];
/// Maximum number of photos from which a part is taught.
pub const MAX_PHOTOS: u32 = 1 + FURTHER_PLACES.len() as u32;

/// The settings for teaching networks.
pub(super) struct Teaching<'a> {
    /// The store for the networks.
    pub store: &'a Store,
    /// Network, training and augmentation, as named in the settings of the store.
    pub preset: Preset,
    /// Number of units that run in parallel.
    pub jobs: usize,
}

impl Teaching<'_> {
    /// Teaches a cell's network and stores it. Returns the result in words, or `None` if interrupted.
    ///
    /// # Errors
    /// Files cannot be written. A teaching run without a model is not an error.
    pub(super) fn teach(
        &self,
        cell: Cell,
        marks: Marks,
        is_interrupted: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<String>> {
        let settings = self.store.settings();
        let object = ObjectSpec::by_name(cell.object)?;
        let shipped = shipped::demonstration(cell.object)?;
        let (demonstrations, lengths) = match marks {
            Marks::Shipped => (vec![shipped], None),
            Marks::Jittered => {
                (vec![with_jittered_marks(&shipped, MARKS_JITTER_PX, part_seed(settings.seed, &object))], None)
            }
            Marks::InPlanView { photos } => {
                let (demonstrations, lengths) = in_plan_view(&object, shipped, photos)?;
                (demonstrations, Some(lengths))
            }
        };
        let mut options = TeachOptions::new(settings.seed);
        options.kind = cell.network().model;
        options.preset = self.preset;
        options.symmetry = object.symmetry;
        options.steps = settings.steps.map(|steps| steps as usize);
        options.time_budget = settings.time_budget.map(|secs| Duration::from_secs(secs.into()));
        options.lengths = lengths;
        // An interrupted teaching keeps the best network so far, which differs from the result of an uninterrupted one.
        let mut interrupted = false;
        let mut observe = |_: &TeachingEvent| {
            interrupted |= is_interrupted();
            if interrupted { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let file = caught(|| Ok(TaughtFile::teach(&demonstrations, &options, &mut observe)?));
        if interrupted {
            return Ok(None);
        }
        let (record, summary) = match file {
            Ok(TaughtFile { taught, bytes, .. }) => {
                // The record is written last, because it states that the model is complete.
                self.store.write_bytes(&cell.model_file(marks), &bytes)?;
                let facts = taught.model.facts().clone();
                let summary = facts.validation.map_or("nothing to train".to_owned(), |validation| {
                    format!("finds the part in {:.0} % of held-out samples", 100.0 * validation.hit_rate)
                });
                let losses = taught.history.as_ref().map_or_else(Vec::new, mean_losses);
                (
                    TeachingRecord::Taught { facts: Box::new(facts), bytes: bytes.len(), jobs: self.jobs, losses },
                    summary,
                )
            }
            Err(error) => {
                self.store.remove(&cell.model_file(marks))?;
                let why = one_line(&error);
                let summary = format!("failed, all its attempts count as failures: {why}");
                (TeachingRecord::Failed { why }, summary)
            }
        };
        self.store.write_made_with(&cell.teaching_file(marks), &settings.teaching(), &record)?;
        Ok(Some(summary))
    }
}

/// The shipped demonstration and further ones, in the plan view of the simulator's camera, which took all of them.
fn in_plan_view(object: &ObjectSpec, shipped: Demonstration, photos: u32) -> Result<(Vec<Demonstration>, Lengths)> {
    let camera = demonstration_view(object)?.view.camera;
    let over_table = CameraOverTable { camera, table_height_m: 0.0, workspace: None };
    let mut demonstrations = vec![shipped];
    for place in FURTHER_PLACES.into_iter().take(photos as usize - 1) {
        demonstrations.push(shipped::demonstration_at(object, place)?);
    }
    Ok(seen_from_above(&demonstrations, &over_table, object.mark_height_m, object.grasp_height_m)?)
}

/// The losses of a teaching run, averaged over groups of steps for storage.
fn mean_losses(history: &History) -> Vec<f64> {
    let mean = |steps: &[StepRecord]| steps.iter().map(|step| step.losses.total()).sum::<f64>() / steps.len() as f64;
    history.steps.chunks(LOSS_STEPS).map(mean).collect()
}
