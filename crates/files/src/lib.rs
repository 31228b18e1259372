//! Files on disk: size-limited reading, atomic writing, locks between processes.
//!
//! ```text
//! path ─ read (size limit, registered as an input) ─ bytes
//! bytes ─ write: no input, no file of another kind is replaced ─ write_atomically: temporary file, sync, rename ─ path
//! path ─ Lock: exclusive or shared, until it is dropped; WriterLock: names the process that writes a file
//! photo ─ marks_of_photo: the possible files of its marks
//! text ─ print_stderr: without the panic of eprintln!
//! ```
//!
//! Errors name the path and the system's reason. Deliberately absent: the meaning of the bytes, options, and texts for
//! users of a single command.
//!
//! ```
//! # fn main() -> Result<(), sdg_files::FileError> {
//! # let folder = std::env::temp_dir().join(format!("sdg-files-example-{}", std::process::id()));
//! sdg_files::prepare_folder(&folder)?;
//! let path = folder.join("result.json");
//! sdg_files::write(&path, b"{}")?;
//! assert_eq!(sdg_files::read(&path, 100)?, b"{}");
//! // The file is now an input, so no output replaces it.
//! assert!(sdg_files::write(&path, b"[]").is_err());
//! # std::fs::remove_dir_all(&folder).ok();
//! # Ok(())
//! # }
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod atomic;
mod bounded;
mod drawing;
mod error;
mod folder;
mod inputs;
mod kind;
mod lock;
mod marks;
mod standard_error;

pub use atomic::{AtomicFile, write_atomically};
pub use bounded::{read, read_bounded};
pub use drawing::{write_drawing, write_png};
pub use error::{FileError, Result};
pub use folder::{absolute, absolute_folder, entries, has_extension, is_same_path, prepare_folder};
pub use inputs::{
    check_extendable, check_readable, check_replaceable, check_writable, create, extend, is_same_file, keep, write,
};
pub use lock::{Access, Lock, WriterLock};
pub use marks::{DATA_YAML, changes_of, data_yaml_of, marks_of_photo, other_npy_of};
pub use standard_error::print_stderr;
