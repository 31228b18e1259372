//! Teaches one of many parts.

use std::ops::ControlFlow;

use anyhow::Result;
use sdg_grasp::{TeachOptions, TeachingEvent};
use sdg_inputs::one_line;

use super::folder::PartDemonstrations;
use super::part_store::PartOutcome;
use crate::taught_file::TaughtFile;

/// Teaches a part. A failure is an outcome as well; `None` if interrupted.
pub fn teach_part(
    part: &PartDemonstrations,
    options: &TeachOptions,
    is_interrupted: &dyn Fn() -> bool,
) -> Option<(Option<Vec<u8>>, PartOutcome)> {
    let mut options = options.clone();
    if let Some(symmetry) = part.symmetry {
        options.symmetry = symmetry;
    }
    let attempt = || -> Result<(Vec<u8>, PartOutcome)> {
        let demonstrations = part.read()?;
        let mut observe = |_: &TeachingEvent| {
            if is_interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let file = TaughtFile::teach(&demonstrations, &options, &mut observe)?;
        let figures = file.figures(&demonstrations, options.seed)?;
        Ok((file.bytes, PartOutcome::taught(file.model.facts().seconds, &figures)))
    };
    let ended = attempt();
    if is_interrupted() {
        return None;
    }
    Some(match ended {
        Ok((bytes, outcome)) => (Some(bytes), outcome),
        Err(error) => (None, PartOutcome::Failed { why: one_line(&error) }),
    })
}
