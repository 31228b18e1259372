//! Errors, most with the expected and the found value.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

/// Result of this crate's functions.
pub type Result<T> = std::result::Result<T, Error>;

/// Error of the caller's grasp model.
pub type TeacherError = Box<dyn std::error::Error + Send + Sync>;

/// Why the page could not be opened, or a request could not be answered.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum Error {
    /// There is nothing to mark.
    #[error("expected at least one image to mark, or a camera to take it with, found none")]
    NoImage,
    /// A file could not be read or written.
    #[error("{}: {action}: {source}", path.display())]
    File { path: PathBuf, action: &'static str, source: io::Error },
    /// A file exceeds the maximum size.
    #[error("{}: expected at most {most} bytes, found {found}", path.display())]
    TooLarge { path: PathBuf, most: u64, found: u64 },
    /// A picture or its marks are invalid.
    #[error("{name}: {source}")]
    Demonstration {
        name: String,
        /// The reason.
        source: sdg_demonstration::Error,
    },
    /// A file could not be read or written by [`sdg_files`].
    #[error(transparent)]
    Write(#[from] sdg_files::FileError),
    /// Marks needed for the request are missing.
    #[error("{name}: expected {expected}, found {found}")]
    NotMarked { name: String, expected: &'static str, found: &'static str },
    /// Another photo has its marks in the same file.
    #[error("{name}: expected a file of its own for the marks, found {}, the file of {other}", path.display())]
    SharedMarks { name: String, path: PathBuf, other: String },
    /// A picture has another size than those of the calibrated camera.
    #[error(
        "{name}: expected {} × {} pixels, as the camera was calibrated, found {} × {}",
        expected[0], expected[1], found[0], found[1]
    )]
    OtherSize { name: String, expected: [u32; 2], found: [u32; 2] },
    /// No picture of that number.
    #[error("expected a picture numbered below {count} that is still there, found {id}")]
    NoSuchPicture { id: usize, count: usize },
    /// No version of that number.
    #[error("expected a version of the model numbered below {count}, found {id}")]
    NoSuchVersion { id: usize, count: usize },
    /// A file is not a project's file.
    #[error("{}: expected a project's file as the annotation page writes it, found {found}", path.display())]
    Project { path: PathBuf, found: String },
    /// The file of the page's token contains no valid token.
    #[error(
        "{}: expected a token of at least 16 letters or digits, found {found} characters (delete the file to renew it)",
        path.display()
    )]
    NotAToken {
        path: PathBuf,
        /// Number of characters in it.
        found: usize,
    },
    /// More pictures than the maximum of a session.
    #[error("expected at most {most} pictures to try, found one more")]
    TooManyPictures { most: usize },
    /// The page was opened without a camera.
    #[error("expected a page with a camera, found none")]
    NoCamera,
    /// A frame that was not shown, or is no longer kept.
    #[error("expected a frame that was shown lately, found frame {number}")]
    NoSuchFrame { number: u64 },
    /// The camera's state does not allow the request.
    #[error("expected {expected}, found {found}")]
    Camera { expected: &'static str, found: String },
    /// An invalid request.
    #[error("{what}: expected {expected}, found {found}")]
    Request { what: &'static str, expected: String, found: String },
    /// The page's state does not allow the request.
    #[error("{0}")]
    Busy(&'static str),
    /// Another program changed the marks of a photo; they were read again.
    #[error("another program changed these marks; they were read again, without the change here")]
    MarksChanged,
    /// Nothing has been taught yet.
    #[error("expected a taught model, found none: teach one first")]
    NotTaught,
    /// Error of the grasp model.
    #[error("{0}")]
    Teacher(TeacherError),
    /// The operating system gave no random bytes for the token.
    #[error("no random token from the operating system: {0}")]
    Random(getrandom::Error),
    /// The page's port could not be opened or served.
    #[error("port {port} on 127.0.0.1: {source}")]
    Port {
        /// The port asked for; 0 for any.
        port: u16,
        source: io::Error,
    },
}

impl Error {
    /// For `map_err` on an operation that reads or writes `path`.
    pub(crate) fn file(path: &std::path::Path, action: &'static str) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::File { path: path.to_owned(), action, source }
    }
}
