//! Grasp attempts of a model on a part, stored one by one.

use anyhow::Result;
use sdg_inputs::one_line;
use serde::Serialize;

use super::cell::read_attempts;
use super::records::{AttemptRecord, AttemptsRecord};
use super::store::Store;
use crate::rehearsal::{Rehearsal, is_of_physics};

/// Continues the attempts in a file of the store for these settings; `None` if interrupted.
///
/// # Errors
/// Errors of files, OpenGL and settings. An attempt whose physics fails is a failed attempt.
pub(super) fn go_on(
    rehearsal: &Rehearsal,
    store: &Store,
    name: &str,
    settings: &impl Serialize,
    is_interrupted: &(dyn Fn() -> bool + Sync),
) -> Result<Option<Vec<AttemptRecord>>> {
    let mut record = AttemptsRecord::new(read_attempts(store, name, settings)?);
    for number in record.attempts.len() + 1..=rehearsal.attempts as usize {
        if is_interrupted() {
            return Ok(None);
        }
        record.attempts.push(match rehearsal.attempt(number, None) {
            Ok(attempted) => AttemptRecord::new(&attempted),
            Err(error) if is_of_physics(&error) => {
                AttemptRecord::failed(number, AttemptRecord::SIMULATION, one_line(&error))
            }
            Err(error) => return Err(error),
        });
        store.write_made_with(name, settings, &record)?;
    }
    Ok(Some(record.attempts))
}

/// The number of attempts that held the part, as text.
pub(super) fn held_of(attempts: &[AttemptRecord]) -> String {
    let held = attempts.iter().filter(|attempt| attempt.success).count();
    format!("held in {held} of {}", attempts.len())
}
