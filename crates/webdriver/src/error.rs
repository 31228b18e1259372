//! What can go wrong between a test and its browser.

use std::io;
use std::path::PathBuf;

/// Why the browser did not do what it was asked for.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum WebDriverError {
    /// ChromeDriver is not there or did not start.
    #[error(
        "cannot start {program} (Debian's packages chromium and chromium-driver; `make test-browser` installs them): {source}"
    )]
    NoDriver { program: &'static str, source: io::Error },
    /// A connection that broke, or a file that could not be written.
    #[error("{what}: {source}")]
    Io { what: String, source: io::Error },
    /// ChromeDriver refused.
    #[error("{command}: {error}: {message}")]
    Refused {
        command: String,
        /// WebDriver's word for it, such as "no such element".
        error: String,
        /// The first line of the driver's explanation.
        message: String,
    },
    /// An answer that WebDriver does not know.
    #[error("{command}: expected {expected}, found {found}")]
    Unexpected {
        command: String,
        /// What the specification has there.
        expected: &'static str,
        found: String,
    },
    /// The page did not become as expected in time.
    #[error("waited {seconds} s for {what}; the page says: {page}")]
    Timeout {
        what: String,
        seconds: f32,
        /// The start of the page's text.
        page: String,
    },
    /// A folder to be served that is not there.
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
