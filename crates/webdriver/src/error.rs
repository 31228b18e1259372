//! Errors between a test and its browser.

use std::io;
use std::path::PathBuf;

/// The reason why a command of the browser failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages explain the fields")]
pub enum WebDriverError {
    /// ChromeDriver is missing or did not start.
    #[error(
        "cannot start {program} (Debian's packages chromium and chromium-driver; `make test-browser` installs them): {source}"
    )]
    NoDriver { program: &'static str, source: io::Error },
    /// A connection broke, or a file could not be written.
    #[error("{what}: {source}")]
    Io { what: String, source: io::Error },
    /// ChromeDriver rejected the command.
    #[error("{command}: {error}: {message}")]
    Refused {
        command: String,
        /// WebDriver's error code, such as "no such element".
        error: String,
        /// The first line of the driver's explanation.
        message: String,
    },
    /// A response that is not valid in WebDriver.
    #[error("{command}: expected {expected}, found {found}")]
    Unexpected {
        command: String,
        /// The expected form.
        expected: &'static str,
        found: String,
    },
    /// A condition on the page was not met in time.
    #[error("waited {seconds} s for {what}; the page says: {page}")]
    Timeout {
        what: String,
        seconds: f32,
        /// The start of the page's text.
        page: String,
    },
    /// The folder to serve does not exist.
    #[error("{}: expected a folder to serve", .0.display())]
    NoFolder(PathBuf),
}

/// The result of this crate's functions.
pub type Result<T> = std::result::Result<T, WebDriverError>;

impl WebDriverError {
    pub(crate) fn io(what: impl Into<String>) -> impl FnOnce(io::Error) -> Self {
        let what = what.into();
        move |source| Self::Io { what, source }
    }
}
