//! MuJoCo's error and warning handlers, made safe for Rust.
//!
//! By default MuJoCo writes its errors to a file and ends the process. With these handlers, an error unwinds from the
//! handler through MuJoCo to [`guarded`], which converts it to a [`SimulationError::MuJoCo`]. For this purpose, MuJoCo
//! is built with unwind tables, and its functions are bound as `C-unwind`. Memory that MuJoCo allocated during the call
//! is leaked, and the structs that the call was writing are incomplete. Callers return the error and do not use these
//! structs again.

use std::any::Any;
use std::cell::RefCell;
use std::ffi::{CStr, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::OnceLock;

use sdg_mujoco_sys as mj;

use crate::error::{Result, SimulationError};

/// The payload with which the error handler unwinds.
struct MuJoCoError(String);

thread_local! {
    /// MuJoCo's warnings on this thread since the last [`take_warnings`].
    static WARNINGS: RefCell<Vec<String>> = const { RefCell::new(Vec::new()) };
}

/// Loads the library and installs the handlers, once per process.
///
/// # Errors
/// [`SimulationError::Library`] if libmujoco is missing, or if its version differs from that of the bindings.
pub(crate) fn initialise() -> Result<()> {
    static INITIALISED: OnceLock<std::result::Result<(), mj::LibraryError>> = OnceLock::new();
    INITIALISED
        .get_or_init(|| {
            mj::load()?;
            // SAFETY: this runs once (`get_or_init`) and before any function of MuJoCo, because every constructor of
            // this crate calls `initialise` first.
            unsafe { mj::set_handlers(on_error, on_warning) };
            Ok(())
        })
        .clone()
        .map_err(SimulationError::from)
}

/// Runs a call of MuJoCo and converts the unwinding of its error handler to an error.
pub(crate) fn guarded<T>(call: &'static str, body: impl FnOnce() -> T) -> Result<T> {
    // Unwind safety: an error leaves only C memory in an undefined state, and the caller no longer uses it.
    catch_unwind(AssertUnwindSafe(body)).map_err(|payload: Box<dyn Any + Send>| {
        match payload.downcast::<MuJoCoError>() {
            Ok(error) => SimulationError::MuJoCo { call, message: error.0 },
            Err(panic) => resume_unwind(panic),
        }
    })
}

/// Removes and returns MuJoCo's warnings on this thread.
pub(crate) fn take_warnings() -> Vec<String> {
    WARNINGS.with_borrow_mut(std::mem::take)
}

unsafe extern "C-unwind" fn on_error(message: *const c_char) {
    // SAFETY: MuJoCo passes a string that ends in NUL and lives during this call.
    let message = unsafe { CStr::from_ptr(message) }.to_string_lossy().into_owned();
    // `panic!` would print a message, but this is an ordinary error.
    resume_unwind(Box::new(MuJoCoError(message)));
}

unsafe extern "C-unwind" fn on_warning(message: *const c_char) {
    // SAFETY: MuJoCo passes a string that ends in NUL and lives during this call.
    let message = unsafe { CStr::from_ptr(message) }.to_string_lossy().into_owned();
    WARNINGS.with_borrow_mut(|warnings| warnings.push(message));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_inside_mujoco_comes_back_as_an_error() {
        initialise().unwrap();
        let result = guarded("mju_error", || {
            // SAFETY: the string ends in NUL.
            unsafe { mj::mju_error(c"the stack overflowed".as_ptr()) }
        });
        assert_eq!(result, Err(SimulationError::MuJoCo { call: "mju_error", message: "the stack overflowed".into() }));
    }

    #[test]
    fn a_panic_of_ours_stays_a_panic() {
        let outcome = catch_unwind(|| guarded("x", || resume_unwind(Box::new("ours"))).is_ok());
        assert_eq!(*outcome.unwrap_err().downcast::<&str>().unwrap(), "ours");
    }
}
