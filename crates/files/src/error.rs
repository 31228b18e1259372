//! Errors of files.

use std::path::PathBuf;

use thiserror::Error;

/// The result of this crate's functions.
pub type Result<T, E = FileError> = std::result::Result<T, E>;

/// A file that could not be read, written or locked; every message names it.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages explain the fields")]
pub enum FileError {
    /// A system call failed.
    #[error("{}: cannot {step}", path.display())]
    System {
        path: PathBuf,
        /// The step, such as `read` or `make this folder`.
        step: &'static str,
        source: std::io::Error,
    },
    /// More bytes than the file may have.
    #[error("{}: expected at most {max_bytes} bytes, found {}", path.display(), found.map_or("more".to_owned(), |found| found.to_string()))]
    TooLarge {
        path: PathBuf,
        max_bytes: u64,
        /// Length of the file, if known.
        found: Option<u64>,
    },
    /// A folder in place of a file.
    #[error("{}: expected a {expected}, found a folder", path.display())]
    Folder {
        path: PathBuf,
        /// The expected kind: `file`, or `file to write`.
        expected: &'static str,
    },
    /// The output path leads to an input.
    #[error("{}: expected an output path that is not an input, found an input of this command", path.display())]
    Input { path: PathBuf },
    /// A file of another kind has the output's name.
    #[error("{}: expected a new name, or {written} to replace, found {found}", path.display())]
    OtherKind {
        path: PathBuf,
        /// The kind of the output.
        written: String,
        /// The kind of the existing file.
        found: String,
    },
    /// The path of a drawing leads to a file that is not a drawing.
    #[error("{}: expected a new name, or an earlier drawing to replace, found another file", path.display())]
    NoDrawing { path: PathBuf },
    /// A drawing that could not be encoded.
    #[error("{}: cannot encode the drawing", path.display())]
    Png { path: PathBuf, source: png::EncodingError },
    /// A picture that could not be encoded.
    #[error("{}: cannot encode the picture", path.display())]
    Picture { path: PathBuf, source: image::ImageError },
    /// A file could not be written; its previous contents, if any, are untouched.
    #[error("cannot write {}: {step} failed: {source}; nothing was changed", path.display())]
    Write {
        path: PathBuf,
        /// The step: creating, writing, flushing or renaming.
        step: &'static str,
        source: std::io::Error,
    },
    /// The path names no file: it ends in `..`, is empty, or is a folder, a device or a pipe.
    #[error("cannot write {}: expected the path of a file, found {found}", path.display())]
    NotAFile {
        path: PathBuf,
        /// The kind of the path.
        found: &'static str,
    },
    /// Another process is writing the file.
    #[error("{}: expected a file that no other process is writing, found it locked by {holder}", path.display())]
    Held {
        path: PathBuf,
        /// The process, as named in its lock file.
        holder: String,
    },
}

impl FileError {
    /// Returns a function for `map_err` that adds the path and the step to the system's error.
    pub(crate) fn at(path: &std::path::Path, step: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::System { path, step, source }
    }
}
