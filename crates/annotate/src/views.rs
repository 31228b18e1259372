//! The JSON views of the session for the page.

use serde::Serialize;

use crate::advice::Advice;
use crate::marks::Marks;
use crate::region::Region;
use crate::teacher::TaughtSummary;

/// Whether the marks are saved.
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
    /// The marks could not be saved.
    Refused {
        /// One line for the user.
        why: String,
        /// Whether writing the file failed; the same marks may be saved later.
        by_disk: bool,
    },
}

/// A marked picture, for the page.
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
    /// Whether the marks are saved.
    pub saved: Saved,
    /// Result of checking the marks.
    pub advice: Advice,
    /// A note about the file for the user.
    pub note: Option<String>,
}

/// A picture to try, for the page.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TrialPictureView {
    /// Its index in the session.
    pub id: usize,
    /// Its name for display.
    pub name: String,
    /// Width, in pixels.
    pub width: u32,
    /// Height, in pixels.
    pub height: u32,
    /// The number of the marked picture that it became.
    pub became: Option<usize>,
    /// The user stated that the part is not there.
    pub is_absent: bool,
}

/// A version of the model, for the page.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelView {
    /// Its index in the session.
    pub id: usize,
    /// Its file's name, or the path of a file outside the project's folder of versions.
    pub file: String,
    /// Time of the teaching: seconds since 1970.
    pub taught_secs: u64,
    /// The model's facts and measured quality.
    pub summary: TaughtSummary,
    /// Number of photos that it was taught from.
    pub photos: usize,
    /// Number of pictures without the part in its teaching.
    pub negatives: usize,
    /// Whether this version is in use.
    pub is_current: bool,
    /// Whether marks, photos, negatives or heights above the table have changed since its teaching.
    pub is_stale: bool,
    /// Number of equivalent turns in a full rotation, 0 for any turn; `None` if an earlier program taught it.
    pub symmetry: Option<u32>,
    /// Whether it was taught for a camera at a constant distance; `None` if an earlier program taught it.
    pub fixed_height: Option<bool>,
}

/// A picture of the project's folder that is not in the project.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct OtherView {
    /// Its index in the session.
    pub id: usize,
    /// Its file's name.
    pub name: String,
    /// Whether a picture to try has the same name and content: a demonstration made from it was removed.
    pub is_tried: bool,
}

/// The detections of one version in a picture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VersionFound {
    /// The best score of all detections.
    pub best: f64,
    /// The marks of the accepted detections, without outlines, the best first.
    pub accepted: Vec<Marks>,
}

/// The detections of two versions in one picture to try.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparedPicture {
    /// The picture's index.
    pub id: usize,
    /// Its name.
    pub name: String,
    /// Whether the part is there, if the user stated it.
    pub is_there: Option<bool>,
    /// The detections of each version; `None` if the picture cannot be searched.
    pub found: Option<[VersionFound; 2]>,
    /// Why it cannot be searched.
    pub failed: Option<String>,
}

/// The data with which the page starts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SessionView {
    /// Identifier for which the picture numbers are valid; a reopened session has another.
    pub id: String,
    /// The object's name.
    pub label: String,
    /// Whether the user or existing marks gave that name; otherwise it is a proposal.
    pub is_named: bool,
    /// Pictures of the folder that are not in the project.
    pub others: Vec<OtherView>,
    /// Photos of the object.
    pub images: Vec<ImageView>,
    /// Index in `images` of the photo that was opened.
    pub shown: usize,
    /// Pictures to try.
    pub trial_pictures: Vec<TrialPictureView>,
    /// Versions of the model, oldest first.
    pub models: Vec<ModelView>,
    /// The searched region; `None` for the whole picture.
    pub region: Option<Region>,
    /// Whether the camera of the photos is calibrated; the part's size is then known.
    pub is_calibrated: bool,
    /// Absolute path of the project's folder, or of the file of a photo's project; `None` for a camera before its first
    /// photo.
    pub project: Option<String>,
    /// Whether the page can close this project and choose another.
    pub can_close: bool,
    /// Notes about the project for the user, for example on missing pictures.
    pub notes: Vec<String>,
    /// The camera's address, if there is one.
    pub camera: Option<String>,
}
