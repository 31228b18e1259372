//! The session as the page gets it, as JSON.

use serde::Serialize;

use crate::advice::Advice;
use crate::marks::Marks;
use crate::region::Region;
use crate::teacher::TaughtSummary;

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
        /// Whether the file could not be written, so that the same marks may be saved later.
        by_disk: bool,
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
    /// The person said that the part is not there.
    pub is_absent: bool,
}

/// A version of the model, as the page sees it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelView {
    /// Its index in the session.
    pub id: usize,
    /// Its file's name.
    pub file: String,
    /// When it was taught: seconds since 1970.
    pub taught_secs: u64,
    /// What it is and how good it was found to be.
    pub summary: TaughtSummary,
    /// Photos that it was taught from.
    pub photos: usize,
    /// Pictures without the part that it was taught from.
    pub negatives: usize,
    /// Whether it is the one in use.
    pub is_current: bool,
    /// Whether marks, photos or negatives have changed since.
    pub is_stale: bool,
}

/// A picture of the project's folder that is not in the project.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct OtherView {
    /// Its index in the session.
    pub id: usize,
    /// Its file's name.
    pub name: String,
}

/// What two versions found in one picture to try.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparedPicture {
    /// The picture's index.
    pub id: usize,
    /// Its name.
    pub name: String,
    /// Whether the part is there, as far as the person said so.
    pub is_there: Option<bool>,
    /// For each version the number of accepted detections and the best score of all.
    pub found: [(usize, f64); 2],
}

/// All that the page starts from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SessionView {
    /// What the numbers of its pictures hold for: a session that is opened again has another id.
    pub id: String,
    /// The object's name.
    pub label: String,
    /// Whether somebody gave that name; it is a proposal otherwise.
    pub is_named: bool,
    /// Pictures of the folder that are not in the project.
    pub others: Vec<OtherView>,
    /// The pictures of it.
    pub images: Vec<ImageView>,
    /// Pictures to try.
    pub trial_pictures: Vec<TrialPictureView>,
    /// Where a taught model is written.
    pub model_path: String,
    /// Versions of the model, oldest first.
    pub models: Vec<ModelView>,
    /// The part of pictures that is searched; all of them where `None`.
    pub region: Option<Region>,
    /// Whether the camera of the photos is calibrated, so that the part's size is known.
    pub is_calibrated: bool,
    /// The project: its folder, or the file of a photo's; `None` until there is a photo.
    pub project: Option<String>,
    /// Whether the page can leave this project for another.
    pub can_close: bool,
    /// What the person should know of the project; pictures that are gone.
    pub notes: Vec<String>,
    /// The camera's address, if there is one.
    pub camera: Option<String>,
}
