//! The boundary to C: status codes, the last error of each thread, caught panics, copied texts.

use std::cell::RefCell;
use std::ffi::{CStr, OsStr, c_char};
use std::os::unix::ffi::OsStrExt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use sdg_bindings::{Fault, FaultKind, Result};

use crate::types::{SDG_ABI_VERSION, SDG_ERROR_INTERNAL, SDG_OK, sdg_status};

thread_local! {
    static LAST_ERROR: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Runs the work of a call; an error or a panic becomes a status code and the thread's last error.
pub fn status(work: impl FnOnce() -> Result<()>) -> sdg_status {
    // Objects are behind locks that a panic does not make unusable; no other state is shared.
    let (status, text) = match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(())) => return SDG_OK,
        Ok(Err(fault)) => (fault.kind as sdg_status, fault.text),
        Err(_) => (
            SDG_ERROR_INTERNAL,
            "an internal error of libsdg, described on standard error; please report it".to_owned(),
        ),
    };
    // Has no effect in a thread that ends and already runs its destructors.
    _ = LAST_ERROR.try_with(|last| *last.borrow_mut() = text);
    status
}

/// Copies the thread's last error to the buffer, like [`copy_text`].
///
/// # Safety
/// The conditions of [`copy_text`].
pub unsafe fn copy_last_error(buffer: *mut c_char, num_bytes: usize) -> usize {
    let text = LAST_ERROR.try_with(|last| last.borrow().clone()).unwrap_or_default();
    // SAFETY: the caller meets the conditions of `# Safety`.
    unsafe { copy_text(&text, buffer, num_bytes) }
}

/// Copies as much of a text as fits, terminated by a zero byte; returns the size of the complete text with its zero
/// byte.
///
/// # Safety
/// `buffer` is null or writable for `num_bytes`.
pub unsafe fn copy_text(text: &str, buffer: *mut c_char, num_bytes: usize) -> usize {
    if !buffer.is_null() && num_bytes > 0 {
        let copied = text.floor_char_boundary(num_bytes - 1);
        // SAFETY: the caller promises room for `num_bytes`, and `copied` is less; both are bytes, and `text` is Rust's own memory.
        unsafe {
            std::ptr::copy_nonoverlapping(text.as_ptr().cast(), buffer, copied);
            buffer.add(copied).write(0);
        }
    }
    text.len() + 1
}

/// The error for a null pointer.
pub fn null(name: &str) -> Fault {
    Fault::new(FaultKind::Argument, format!("expected a pointer as {name}, found NULL"))
}

/// The path at a pointer from the caller; errors call it `name`.
///
/// # Safety
/// `path` is null or a zero-terminated string that is not changed during the call.
pub unsafe fn path<'a>(path: *const c_char, name: &str) -> Result<&'a Path> {
    if path.is_null() {
        return Err(null(name));
    }
    // SAFETY: not null, and the caller promises the rest.
    let bytes = unsafe { CStr::from_ptr(path) }.to_bytes();
    Ok(Path::new(OsStr::from_bytes(bytes)))
}

/// Checks that the caller's structures have the ABI version of this library.
pub fn check_abi(of: &str, found: u32) -> Result<()> {
    if found == SDG_ABI_VERSION {
        return Ok(());
    }
    Err(Fault::new(
        FaultKind::Version,
        format!(
            "expected {of} of ABI version {SDG_ABI_VERSION}, found {found}: compile the program with this library's sdg.h, and set \
             abi_version to SDG_ABI_VERSION"
        ),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::types::*;

    #[test]
    fn texts_are_cut_between_characters_and_end_with_a_zero_byte() {
        for (room, expected) in [(1, ""), (2, "a"), (3, "a"), (4, "aµ"), (9, "aµb")] {
            let mut buffer = [c_char::MAX; 9];
            // SAFETY: the buffer has room for nine bytes.
            assert_eq!(unsafe { copy_text("aµb", buffer.as_mut_ptr(), room) }, 5);
            // SAFETY: `copy_text` has written a zero byte.
            assert_eq!(unsafe { CStr::from_ptr(buffer.as_ptr()) }.to_str(), Ok(expected));
            assert!(buffer[room..].iter().all(|byte| *byte == c_char::MAX), "{room}");
        }
        // SAFETY: null is allowed.
        assert_eq!(unsafe { copy_text("aµb", std::ptr::null_mut(), 9) }, 5);
    }

    #[test]
    fn a_panic_is_an_error_of_this_library() {
        assert_eq!(status(|| panic!("a fault that a test makes")), SDG_ERROR_INTERNAL);
        // SAFETY: null is allowed.
        assert!(unsafe { copy_last_error(std::ptr::null_mut(), 0) } > 1);
        assert_eq!(status(|| Ok(())), SDG_OK);
    }

    #[test]
    fn statuses_are_the_numbers_of_the_kinds() {
        for (kind, status) in [
            (FaultKind::Argument, SDG_ERROR_ARGUMENT),
            (FaultKind::File, SDG_ERROR_FILE),
            (FaultKind::ModelFile, SDG_ERROR_MODEL_FILE),
            (FaultKind::Picture, SDG_ERROR_PICTURE),
            (FaultKind::Camera, SDG_ERROR_CAMERA),
            (FaultKind::Region, SDG_ERROR_REGION),
            (FaultKind::Teaching, SDG_ERROR_TEACHING),
            (FaultKind::NothingToGrasp, SDG_ERROR_NOTHING_TO_GRASP),
            (FaultKind::Closed, SDG_ERROR_HANDLE),
            (FaultKind::Version, SDG_ERROR_VERSION),
            (FaultKind::Internal, SDG_ERROR_INTERNAL),
            (FaultKind::Forked, SDG_ERROR_FORKED),
        ] {
            assert_eq!(kind as sdg_status, status);
        }
    }
}
