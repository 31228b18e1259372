//! A cell, which is one model on one part: its name, and its files in the store.

use anyhow::{Context, Result, anyhow};
use sdg_grasp::{CheckConfig, Device, GraspModel, ModelKind, Verification};
use serde::Serialize;

use super::records::{AttemptRecord, AttemptsRecord, LookRecord, SpeedRecord, TeachingRecord};
use super::store::Store;

/// One model on one part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cell<'a> {
    pub model: ModelKind,
    pub object: &'a str,
}

impl Cell<'_> {
    /// The cell whose network is used by this cell's model.
    pub fn network(self) -> Self {
        Self { model: self.model.taught_as(), ..self }
    }

    /// Whether the cell's teaching failed; there is then no model to test.
    pub(super) fn is_without_model(self, marks: Marks, store: &Store) -> Result<bool> {
        Ok(matches!(self.teaching_from(marks, store)?, Some(TeachingRecord::Failed { .. })))
    }

    /// The path of a file of this cell.
    pub(super) fn file(self, what: &str) -> String {
        format!("cells/{self}.{what}.json")
    }

    /// The path of the network's file.
    pub(super) fn model_file(self, marks: Marks) -> String {
        format!("models/{}{}.sdg", self.network(), marks.suffix())
    }

    /// The path of the file with the outcome of teaching.
    pub(super) fn teaching_file(self, marks: Marks) -> String {
        self.network().file(&format!("teaching{}", marks.suffix()))
    }

    /// The path of the picture with the detections.
    pub fn picture_file(self) -> String {
        format!("pictures/{self}.png")
    }

    /// The stored outcome of teaching the network from the shipped demonstration.
    pub fn teaching(self, store: &Store) -> Result<Option<TeachingRecord>> {
        self.teaching_from(Marks::Shipped, store)
    }

    /// The stored outcome of teaching the network from these marks.
    pub fn teaching_from(self, marks: Marks, store: &Store) -> Result<Option<TeachingRecord>> {
        store.read_made_with(&self.teaching_file(marks), &store.settings().teaching())
    }

    /// The stored detections in pictures.
    pub fn look(self, store: &Store) -> Result<Option<LookRecord>> {
        store.read(&self.file("look"))
    }

    /// The stored attempts, in order.
    pub fn attempts(self, verification: Verification, store: &Store) -> Result<Vec<AttemptRecord>> {
        read_attempts(store, &self.file(&attempts_of(verification)), store.settings())
    }

    /// The stored speed.
    pub fn speed(self, store: &Store) -> Result<Option<SpeedRecord>> {
        store.read(&self.file("speed"))
    }

    /// The model; `None` if teaching gave none.
    pub(super) fn read_model(self, marks: Marks, store: &Store) -> Result<Option<GraspModel>> {
        match self.teaching_from(marks, store)? {
            Some(TeachingRecord::Taught { .. }) => {}
            Some(TeachingRecord::Failed { .. }) => return Ok(None),
            None => return Err(anyhow!("{self}: expected a taught model, found none")),
        }
        let path = store.path(&self.model_file(marks));
        let model = sdg_inputs::read_model(&path, &Device::flex())?.read_as(self.model);
        Ok(Some(model.ok_or_else(|| anyhow!("{}: expected model {}", path.display(), self.network().model))?))
    }

    /// The model for a camera that is always at the height of the photo, as in the paper's protocol.
    pub(super) fn read_model_at_fixed_height(self, store: &Store) -> Result<Option<GraspModel>> {
        let at_fixed_height = |model: GraspModel| model.with_size_tolerance(CheckConfig::FIXED_HEIGHT_TOLERANCE);
        Ok(self.read_model(Marks::Shipped, store)?.map(at_fixed_height).transpose()?)
    }
}

impl std::fmt::Display for Cell<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}-{}", self.model, self.object)
    }
}

/// The marks from which a network is taught.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Marks {
    /// The marks of the shipped demonstration.
    Shipped,
    /// The marks of the shipped demonstration, moved by `MARKS_JITTER_PX`.
    Jittered,
    /// The marks of the shipped demonstration, and of further photos by the same camera, in its plan view.
    InPlanView {
        /// Number of all photos.
        photos: u32,
    },
}

impl Marks {
    /// Suffix in file names.
    fn suffix(self) -> String {
        match self {
            Self::Shipped => String::new(),
            Self::Jittered => "-jittered-marks".to_owned(),
            Self::InPlanView { photos: 1 } => "-plan-view".to_owned(),
            Self::InPlanView { photos } => format!("-plan-view-{photos}-photos"),
        }
    }
}

/// The attempts stored in a file; empty if there is no file. Attempts recorded by another version are ignored, so that
/// they are made again.
///
/// # Errors
/// The errors of [`Store::read_made_with`].
pub(super) fn read_attempts(store: &Store, name: &str, settings: &impl Serialize) -> Result<Vec<AttemptRecord>> {
    let record: Option<serde_json::Value> = store.read_made_with(name, settings)?;
    let Some(record) = record.filter(|record| record["version"] == AttemptsRecord::VERSION) else {
        return Ok(Vec::new());
    };
    let record: AttemptsRecord =
        serde_json::from_value(record).with_context(|| format!("{}: expected attempts", store.path(name).display()))?;
    Ok(record.attempts)
}

/// The name of the file with a cell's attempts.
pub(super) fn attempts_of(verification: Verification) -> String {
    let way = match verification {
        Verification::ByShape => "verified",
        Verification::Off => "alone",
    };
    format!("attempts-{way}")
}
