//! The session as the page gets it, as JSON.

use serde::Serialize;

use crate::advice::Advice;
use crate::marks::Marks;

/// Whether the marks stand on the disk.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case", tag = "state")]
pub enum Saved {
    /// There is nothing to write.
    Nothing,
    /// The marks were written to the file.
    Written {
        /// The file's name.
        file: String,
    },
    /// The marks were refused.
    Refused {
        /// One line for the person at the page.
        why: String,
    },
}

/// A marked picture as the page sees it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImageView {
    /// Its index in the session.
    pub id: usize,
    /// Its file's name.
    pub name: String,
    /// Width, in pixels.
    pub width: u32,
    /// Height, in pixels.
    pub height: u32,
    /// The marks on it.
    pub marks: Marks,
    /// Whether that stands on the disk.
    pub saved: Saved,
    /// What the marks are good for.
    pub advice: Advice,
    /// What the person should know about the file.
    pub note: Option<String>,
}

/// A picture to try, as the page sees it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TrialPictureView {
    /// Its index in the session.
    pub id: usize,
    /// Its file's name.
    pub name: String,
    /// Width, in pixels.
    pub width: u32,
    /// Height, in pixels.
    pub height: u32,
    /// The number of the marked picture that it became.
    pub became: Option<usize>,
}

/// All that the page starts from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SessionView {
    /// The object's name.
    pub label: String,
    /// The pictures of it.
    pub images: Vec<ImageView>,
    /// Pictures to try.
    pub trial_pictures: Vec<TrialPictureView>,
    /// Where a taught model is written.
    pub model_path: String,
    /// The camera's address, if there is one.
    pub camera: Option<String>,
}
