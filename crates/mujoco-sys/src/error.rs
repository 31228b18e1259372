//! Errors of loading libmujoco.

/// libmujoco is missing, or it is not the version of these bindings.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LibraryError {
    /// No library with the expected name, or a function is missing in it.
    #[error(
        "MuJoCo could not be loaded ({reason}): expected version 2.2.2, on Debian 12 the package libmujoco2.2.2; elsewhere \
         LD_LIBRARY_PATH may name the folder of libmujoco.so.2.2.2"
    )]
    Missing {
        /// The message of the system's loader.
        reason: String,
    },
    /// The library reports another version.
    #[error(
        "libmujoco is version {found}, expected {expected}: install Debian's libmujoco2.2.2, or rebuild with \
         feature `buildtime_bindgen`"
    )]
    Version {
        /// Version of the headers, as `mjVERSION_HEADER` (222 means 2.2.2).
        expected: i32,
        /// Version reported by the library.
        found: i32,
    },
    /// The library initialises more or fewer bytes of a struct than the bindings have.
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
