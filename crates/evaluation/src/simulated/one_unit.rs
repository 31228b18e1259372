//! Runs one unit of work: a panic becomes an error, the time is measured, and the result is reported.

use std::fmt::Display;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use anyhow::{Result, anyhow};

use crate::progress::Progress;

/// The text for a unit whose teaching failed while the unit waited.
pub(super) const NO_MODEL: &str = "there is no model";

/// Runs a unit, unless the run is interrupted, and reports its result. `work` returns a description, or `None` if it
/// was interrupted.
///
/// # Errors
/// The errors of `work`; a panic of `work` is an error as well.
pub(super) fn do_unit(
    unit: &impl Display,
    is_interrupted: &(dyn Fn() -> bool + Sync),
    progress: &dyn Progress,
    work: impl FnOnce() -> Result<Option<String>>,
) -> Result<ControlFlow<()>> {
    if is_interrupted() {
        return Ok(ControlFlow::Break(()));
    }
    let started = Instant::now();
    let Some(summary) = caught(work)? else { return Ok(ControlFlow::Break(())) };
    progress.unit_done(&format!("{unit}: {summary} ({:.0} s)", started.elapsed().as_secs_f64()));
    Ok(ControlFlow::Continue(()))
}

/// Converts a panic to an error, which the caller treats like any other error of a unit.
pub(super) fn caught<T>(body: impl FnOnce() -> Result<T>) -> Result<T> {
    // Unwind safety: the data that the closure changes belong to its unit and are dropped with the unit.
    catch_unwind(AssertUnwindSafe(body)).unwrap_or_else(|panic| {
        let message = panic.downcast_ref::<&str>().map(|message| (*message).to_owned());
        let message = message.or_else(|| panic.downcast_ref::<String>().cloned());
        Err(anyhow!("an error in this program: {}", message.unwrap_or_else(|| "it panicked".to_owned())))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_an_error() {
        let error = caught::<()>(|| panic!("index {}", 7)).unwrap_err();
        assert_eq!(error.to_string(), "an error in this program: index 7");
        assert!(caught(|| Ok(1)).is_ok());
    }
}
