//! Panics of one unit of work as errors.

use std::panic::{AssertUnwindSafe, catch_unwind};

use anyhow::{Result, anyhow};

/// What there is to say of a unit whose teaching failed while it waited.
pub(super) const NO_MODEL: &str = "there is no model";

/// Turns a panic into an error, so that the units beside it are kept.
pub(super) fn caught<T>(body: impl FnOnce() -> Result<T>) -> Result<T> {
    // Unwind safety: whatever the closure was changing is given up with its unit.
    catch_unwind(AssertUnwindSafe(body)).unwrap_or_else(|panic| {
        let message = panic.downcast_ref::<&str>().map(|message| (*message).to_owned());
        let message = message.or_else(|| panic.downcast_ref::<String>().cloned());
        Err(anyhow!("a mistake in this program: {}", message.unwrap_or_else(|| "it panicked".to_owned())))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_an_error() {
        let error = caught::<()>(|| panic!("index {}", 7)).unwrap_err();
        assert_eq!(error.to_string(), "a mistake in this program: index 7");
        assert!(caught(|| Ok(1)).is_ok());
    }
}
