//! Does the library that was loaded match the structs that were compiled in?

use std::mem::{MaybeUninit, size_of};
use std::ptr;

use crate::bindings::*;

/// The loaded libmujoco is not the one that these bindings describe.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LibraryMismatch {
    /// The library reports another version.
    #[error(
        "libmujoco is version {found}, expected {expected}: install Debian's libmujoco-dev 2.2.2, or rebuild with \
         feature `buildtime_bindgen`"
    )]
    Version {
        /// Version of the headers, as `mjVERSION_HEADER` (222 means 2.2.2).
        expected: i32,
        /// Version that the library reports.
        found: i32,
    },
    /// The library initialises more or fewer bytes of a struct than the bindings hold.
    #[error("libmujoco's {name} takes {found} bytes, expected {expected}: bindings and library differ")]
    StructSize {
        /// Name of the C struct.
        name: &'static str,
        /// Size in the bindings, in bytes.
        expected: usize,
        /// Bytes that the library wrote.
        found: usize,
    },
}

/// Checks the library's version and the size of every struct that MuJoCo initialises for us.
///
/// It costs microseconds; `sdg-simulation` calls it before it touches anything else.
///
/// # Errors
/// [`LibraryMismatch`] with what was expected and what was found.
pub fn check_library() -> Result<(), LibraryMismatch> {
    // SAFETY: `mj_version` takes nothing and returns a constant.
    let found = unsafe { mj_version() };
    let expected = mjVERSION_HEADER as i32;
    if found != expected {
        return Err(LibraryMismatch::Version { expected, found });
    }

    check_size::<mjOption>("mjOption", mj_defaultOption)?;
    check_size::<mjVisual>("mjVisual", mj_defaultVisual)?;
    check_size::<mjvCamera>("mjvCamera", mjv_defaultCamera)?;
    check_size::<mjvOption>("mjvOption", mjv_defaultOption)?;
    check_size::<mjvPerturb>("mjvPerturb", mjv_defaultPerturb)?;
    check_size::<mjvScene>("mjvScene", mjv_defaultScene)?;
    check_size::<mjrContext>("mjrContext", mjr_defaultContext)?;
    Ok(())
}

/// Lets `initialise` write into a buffer larger than `T`, twice and over two different fillings,
/// and takes the last byte that came out equal both times for the end of the struct.
///
/// Trailing padding need not be written, hence the tolerance of one alignment.
fn check_size<T>(name: &'static str, initialise: unsafe extern "C-unwind" fn(*mut T)) -> Result<(), LibraryMismatch> {
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
        return Err(LibraryMismatch::StructSize { name, expected, found });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_installed_library_is_the_one_described() {
        assert_eq!(check_library(), Ok(()));
    }

    #[test]
    fn a_struct_of_another_size_is_noticed() {
        /// Writes a struct of 24 bytes whatever `T` is.
        unsafe extern "C-unwind" fn writes_24_bytes<T>(out: *mut T) {
            // SAFETY: `check_size` hands over room for two `T`s of at least 16 bytes.
            unsafe { ptr::write_bytes(out.cast::<u8>(), 0, 24) };
        }
        assert_eq!(check_size::<[u64; 3]>("same", writes_24_bytes), Ok(()));
        for (result, expected) in [
            (check_size::<[u64; 2]>("short", writes_24_bytes), 16),
            (check_size::<[u64; 4]>("long", writes_24_bytes), 32),
        ] {
            match result {
                Err(LibraryMismatch::StructSize { expected: e, found, .. }) => {
                    assert_eq!((e, found), (expected, 24));
                }
                other => panic!("{other:?}"),
            }
        }
    }
}
