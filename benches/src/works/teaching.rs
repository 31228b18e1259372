//! The work that teaches a validated model from a demonstration, and the work that detects with this model.

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, Result};
use sdg_grasp::{Device, GraspModel, TeachOptions, Verification, teach};

use crate::protocol::{Facts, Work};
use crate::works::demonstration::read_demonstration;
use crate::works::facts::facts;

/// Teaches once and writes the model, which [`grasp`] uses.
pub fn teaching(demonstration: &Path, model: &Path) -> Result<Work> {
    let demonstrations = [read_demonstration(demonstration)?];
    let model = model.to_owned();
    let run = move || {
        let taught = teach(&demonstrations, &TeachOptions::new(1), &mut |_| ControlFlow::Continue(()))?;
        let known = taught.model.facts();
        if let Some(held_back) = known.validation {
            eprintln!(
                "taught in {} steps: {:.0} % found, {:.2} px and {:.2}° off",
                known.steps,
                100.0 * held_back.hit_rate,
                held_back.error_px,
                held_back.error_degrees
            );
        }
        std::fs::write(&model, taught.model.to_bytes()?).with_context(|| model.display().to_string())
    };
    Ok(Work { warm_up: false, ..Work::new(Facts::new(), run) })
}

/// Finds the part in its own photo, verified against the demonstration.
pub fn grasp(demonstration: &Path, model: &Path) -> Result<Work> {
    let photo = read_demonstration(demonstration)?.image;
    let bytes = std::fs::read(model).with_context(|| model.display().to_string())?;
    let model = GraspModel::from_bytes(&bytes, &Device::flex())?;
    let found = model.detect(&photo, Verification::ByShape)?;
    let accepted = found.iter().filter(|detection| detection.is_accepted()).count();
    Ok(Work::new(facts([("accepted", accepted as f64)]), move || {
        std::hint::black_box(model.detect(&photo, Verification::ByShape)?);
        Ok(())
    }))
}
