//! Teaches parts that the store does not contain yet, and runs their models on each other's photos.

use std::ops::ControlFlow;

use anyhow::Result;
use image::RgbImage;
use sdg_grasp::TeachOptions;
use serde_json::{Value, json};

use super::cross_check::{CrossCheck, PHOTOS_AT_ONCE};
use super::findings::Findings;
use super::folder::PartDemonstrations;
use super::page::thumbnail;
use super::part_store::{PartOutcome, PartRecord, PartStore};
use super::teach::teach_part;
use crate::progress::Progress;

/// Parts by name with the outcomes of their teaching.
pub type PartOutcomes = Vec<(String, PartOutcome)>;

/// The inputs that all parts have in common.
pub struct PartTeaching<'a> {
    pub store: &'a PartStore,
    /// The options, with the initial weights.
    pub options: &'a TeachOptions,
    /// The SHA-256 of the file of the initial weights, or another name of the initialisation; `None` for the included
    /// weights.
    pub weights_sha256: Option<&'a str>,
    /// Prefixes of the parameters that are initialised randomly in spite of that file.
    pub reinitialized: &'a [String],
}

impl PartTeaching<'_> {
    /// Teaches the parts whose outcome for these inputs is not stored yet. If interrupted, breaks with the name of the
    /// first part without an outcome.
    ///
    /// # Errors
    /// Files cannot be read or written. A part that cannot be taught is an outcome, not an error.
    pub fn run(
        &self,
        parts: &[&PartDemonstrations],
        is_interrupted: &dyn Fn() -> bool,
        progress: &dyn Progress,
    ) -> Result<ControlFlow<String, PartOutcomes>> {
        let mut outcomes = Vec::with_capacity(parts.len());
        for part in parts {
            let key = self.key(part)?;
            let outcome = match self.store.read(&part.name, &key)? {
                Some(outcome) => outcome,
                None => {
                    let Some((model, outcome)) = teach_part(part, self.options, is_interrupted) else {
                        return Ok(ControlFlow::Break(part.name.clone()));
                    };
                    self.store.write(&part.name, model.as_deref(), &PartRecord { key, outcome: outcome.clone() })?;
                    outcome
                }
            };
            progress.unit_done(&format!("teach {}: {}", part.name, outcome.in_words()));
            outcomes.push((part.name.clone(), outcome));
        }
        Ok(ControlFlow::Continue(outcomes))
    }

    /// The inputs that a part's model depends on.
    fn key(&self, part: &PartDemonstrations) -> Result<Value> {
        let options = self.options;
        Ok(json!({
            "files": part.sha256()?,
            "model": options.kind,
            "preset": options.preset.name(),
            "seed": options.seed,
            "steps": options.steps,
            "time_budget": options.time_budget.map(|budget| budget.as_secs_f64()),
            "symmetry": part.symmetry.unwrap_or(options.symmetry),
            "size_tolerance": [options.size_tolerance.start(), options.size_tolerance.end()],
            "base_weights_sha256": self.weights_sha256,
            "reinit": self.reinitialized,
            "version": env!("CARGO_PKG_VERSION"),
        }))
    }

    /// Runs the model of each taught part on the first photos of all taught parts. Returns the findings, and the photos
    /// reduced for the page.
    ///
    /// # Errors
    /// Photos or models cannot be read, or detection fails; or `is_interrupted` returned true.
    pub fn check(
        &self,
        parts: &[&PartDemonstrations],
        outcomes: PartOutcomes,
        left_out: Vec<(String, String)>,
        is_interrupted: &(dyn Fn() -> bool + Sync),
        progress: &dyn Progress,
    ) -> Result<(Findings, Vec<RgbImage>)> {
        let is_taught = |name: &str| {
            outcomes.iter().any(|(known, outcome)| known == name && matches!(outcome, PartOutcome::Taught { .. }))
        };
        let taught: Vec<&PartDemonstrations> = parts.iter().copied().filter(|part| is_taught(&part.name)).collect();
        let further_rounds = taught.len().div_ceil(PHOTOS_AT_ONCE).saturating_sub(1);
        progress.expect(further_rounds * taught.len());
        let mut thumbnails = Vec::with_capacity(taught.len());
        let mut seen = |photo: &RgbImage| thumbnails.push(thumbnail(photo));
        let done = |name: &str, photos: usize| progress.unit_done(&format!("{name}: run on {photos} photos"));
        let check = CrossCheck::run(self.store, &taught, is_interrupted, &mut seen, &done)?;
        Ok((Findings::new(outcomes, check, left_out), thumbnails))
    }
}
