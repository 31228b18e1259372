//! Whether the loaded library matches the compiled-in structs.

use std::mem::{MaybeUninit, size_of};
use std::ptr;

use crate::bindings::mjVERSION_HEADER;
use crate::error::LibraryError;
use crate::library::{self, Functions};

/// Loads libmujoco, once per process, and checks that it matches these bindings.
///
/// # Errors
/// [`LibraryError`] if the library cannot be loaded, has another version, or has structs of other sizes; every later
/// call returns the same error.
pub fn load() -> Result<(), LibraryError> {
    library::load(check)
}

/// Checks the library's version and the sizes of seven structs that MuJoCo initialises for us.
///
/// Takes microseconds.
fn check(functions: &Functions) -> Result<(), LibraryError> {
    // SAFETY: `mj_version` takes nothing and returns a constant.
    let found = unsafe { (functions.mj_version)() };
    let expected = mjVERSION_HEADER as i32;
    if found != expected {
        return Err(LibraryError::Version { expected, found });
    }

    check_size("mjOption", functions.mj_defaultOption)?;
    check_size("mjVisual", functions.mj_defaultVisual)?;
    check_size("mjvCamera", functions.mjv_defaultCamera)?;
    check_size("mjvOption", functions.mjv_defaultOption)?;
    check_size("mjvPerturb", functions.mjv_defaultPerturb)?;
    check_size("mjvScene", functions.mjv_defaultScene)?;
    check_size("mjrContext", functions.mjr_defaultContext)?;
    Ok(())
}

/// Measures the size of a struct: `initialise` writes to two buffers with different contents, both larger than `T`. The
/// last byte in which the buffers then agree is the end of the struct.
///
/// The tolerance is one alignment, because trailing padding may remain unwritten.
fn check_size<T>(name: &'static str, initialise: unsafe extern "C-unwind" fn(*mut T)) -> Result<(), LibraryError> {
    let written = [0x5a_u8, 0xa5].map(|filling| {
        let mut room: Box<[MaybeUninit<T>]> = (0..2).map(|_| MaybeUninit::uninit()).collect();
        let bytes = room.as_mut_ptr().cast::<u8>();
        // SAFETY: the buffer holds two `T`s, is aligned for `T`, and every byte of it is written
        // before it is read; a library whose `T` is at most twice as large stays inside.
        unsafe {
            ptr::write_bytes(bytes, filling, 2 * size_of::<T>());
            initialise(room.as_mut_ptr().cast::<T>());
            std::slice::from_raw_parts(bytes, 2 * size_of::<T>()).to_vec()
        }
    });
    let found = written[0].iter().zip(&written[1]).rposition(|(a, b)| a == b).map_or(0, |last| last + 1);
    let expected = size_of::<T>();
    if found > expected || found + align_of::<T>() <= expected {
        return Err(LibraryError::StructSize { name, expected, found });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_installed_library_is_the_one_described() {
        assert_eq!(load(), Ok(()));
        // A further call returns the same result.
        assert_eq!(load(), Ok(()));
    }

    #[test]
    fn a_struct_of_another_size_is_noticed() {
        /// Writes a struct of 24 bytes for any `T`.
        unsafe extern "C-unwind" fn writes_24_bytes<T>(out: *mut T) {
            // SAFETY: `check_size` passes a buffer for two `T`s of at least 16 bytes.
            unsafe { ptr::write_bytes(out.cast::<u8>(), 0, 24) };
        }
        assert_eq!(check_size::<[u64; 3]>("same", writes_24_bytes), Ok(()));
        for (result, expected) in [
            (check_size::<[u64; 2]>("short", writes_24_bytes), 16),
            (check_size::<[u64; 4]>("long", writes_24_bytes), 32),
        ] {
            match result {
                Err(LibraryError::StructSize { expected: e, found, .. }) => {
                    assert_eq!((e, found), (expected, 24));
                }
                other => panic!("{other:?}"),
            }
        }
    }
}
