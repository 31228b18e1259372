//! Measures all models on all sets, with every seed.

use std::path::Path;

use anyhow::Result;
use sdg_grasp::ModelKind;
use serde_json::{Value, json};

use super::file::Side;
use super::run::{Measured, ReadySet};
use super::summary::summary;
use crate::progress::Progress;

/// The sides of these sets, each once.
pub fn sides_of(sets: &[ReadySet]) -> Vec<Side> {
    Side::ALL.into_iter().filter(|side| sets.iter().any(|ready| ready.set.side == *side)).collect()
}

/// Teaches and measures one set at a time, because the speed of detection is measured.
///
/// # Errors
/// Teaching or detection fails; pictures or labels cannot be read.
pub fn measure(
    models: &[ModelKind],
    seeds: &[u64],
    sets: &[ReadySet],
    progress: &dyn Progress,
) -> Result<Vec<Measured>> {
    progress.expect(models.len() * seeds.len() * sets.len());
    let mut measured = Vec::with_capacity(models.len());
    for &model in models {
        let mut of_model = Measured { model, seeds: seeds.to_vec(), runs: Vec::new() };
        for &seed in seeds {
            for ready in sets {
                let run = ready.run(model, seed)?;
                progress.unit_done(&format!("model {model}, seed {seed}, {}: {}", ready.set.name, run.in_words()));
                of_model.runs.push(run);
            }
        }
        measured.push(of_model);
    }
    Ok(measured)
}

/// The results of all models as one object; `file` is the split's file.
pub fn results_json(file: &Path, sides: &[Side], measured: &[Measured]) -> Value {
    json!({
        "split": file.display().to_string(),
        "sides": sides,
        "version": env!("CARGO_PKG_VERSION"),
        "models": measured.iter().map(|of_model| summary(of_model, sides)).collect::<Vec<_>>(),
    })
}
