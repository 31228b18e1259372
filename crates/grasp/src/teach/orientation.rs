//! Model A's first network: the orientation CNN.

use std::ops::ControlFlow;

use sdg_demonstration::Demonstration;
use sdg_orientation::OrientationCnn;
use sdg_training::Ending;
use sdg_training::orientation::{self, OrientationEvent};

use super::event::TeachingEvent;
use super::options::TeachOptions;
use super::preset::OrientationTeaching;
use crate::decimal::decimal;
use crate::error::{GraspError, Result};
use crate::facts::OrientationFacts;

/// Fraction of a time budget for the orientation CNN; the detector has the rest. Chosen by hand, not measured.
const TIME_SHARE: f64 = 0.3;

/// Teaches the orientation CNN from the demonstrations.
pub(super) fn teach(
    demonstrations: &[Demonstration],
    teaching: &OrientationTeaching,
    options: &TeachOptions,
    observe: &mut dyn FnMut(&TeachingEvent) -> ControlFlow<()>,
) -> Result<(OrientationCnn, OrientationFacts)> {
    let mut training = teaching.training.clone();
    training.time_budget = options.time_budget.map(|budget| budget.mul_f64(TIME_SHARE));
    let start = options.start.weights().and_then(|weights| weights.orientation.as_ref());
    let taught =
        orientation::teach(demonstrations, &teaching.network, start, &training, &options.device, &mut |event| {
            match *event {
                OrientationEvent::Step { step, planned_steps, loss, elapsed_secs } => {
                    observe(&TeachingEvent::OrientationStep { step, planned_steps, loss, elapsed_secs })
                }
                _ => ControlFlow::Continue(()),
            }
        })?;
    if taught.ending == Ending::Interrupted {
        return Err(GraspError::StoppedTooEarly);
    }
    let facts = OrientationFacts {
        crops: taught.steps * training.batch_size,
        steps: taught.steps,
        hit_rate: decimal(taught.errors.hit_rate()),
        error_degrees: decimal(taught.errors.median_degrees()),
    };
    Ok((taught.network, facts))
}
