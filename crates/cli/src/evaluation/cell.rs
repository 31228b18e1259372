//! One model on one part: its name, and what the store has of it.

use anyhow::{Result, anyhow};
use sdg_grasp::{Device, GraspModel, ModelKind, Verification};

use super::records::{AttemptRecord, AttemptsRecord, LookRecord, SpeedRecord, TeachingRecord};
use super::store::Store;
use crate::files;

/// One model on one part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cell<'a> {
    /// The model.
    pub model: ModelKind,
    /// The part's name.
    pub object: &'a str,
}

impl Cell<'_> {
    /// The cell whose network this one's model reads.
    pub fn network(self) -> Self {
        Self { model: self.model.taught_as(), ..self }
    }

    /// A file of this cell.
    pub(super) fn file(self, what: &str) -> String {
        format!("cells/{self}.{what}.json")
    }

    /// Where its network lies.
    pub(super) fn model_file(self) -> String {
        format!("models/{}.sdg", self.network())
    }

    /// Where a picture of its detections lies.
    pub fn picture_file(self) -> String {
        format!("pictures/{self}.png")
    }

    /// How the teaching of its network ended, if it has.
    pub fn teaching(self, store: &Store) -> Result<Option<TeachingRecord>> {
        store.read(&self.network().file("teaching"))
    }

    /// What it said of pictures, if it was shown them.
    pub fn look(self, store: &Store) -> Result<Option<LookRecord>> {
        store.read(&self.file("look"))
    }

    /// Its attempts so far.
    pub fn attempts(self, verification: Verification, store: &Store) -> Result<Vec<AttemptRecord>> {
        let record: Option<AttemptsRecord> = store.read(&self.file(&attempts_of(verification)))?;
        Ok(record.unwrap_or_default().attempts)
    }

    /// How fast it is, if that was measured.
    pub fn speed(self, store: &Store) -> Result<Option<SpeedRecord>> {
        store.read(&self.file("speed"))
    }

    /// Its model; `None` where teaching led to none.
    pub(super) fn read_model(self, store: &Store) -> Result<Option<GraspModel>> {
        match self.teaching(store)? {
            Some(TeachingRecord::Taught { .. }) => {}
            Some(TeachingRecord::Failed { .. }) => return Ok(None),
            None => return Err(anyhow!("{self}: expected a taught model, found none")),
        }
        let path = store.path(&self.model_file());
        let model = files::read_model(&path, &Device::flex())?.read_as(self.model);
        Ok(Some(model.ok_or_else(|| anyhow!("{}: expected model {}", path.display(), self.network().model))?))
    }
}

impl std::fmt::Display for Cell<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}-{}", self.model, self.object)
    }
}

/// The name of a cell's file of attempts.
pub(super) fn attempts_of(verification: Verification) -> String {
    let way = match verification {
        Verification::ByShape => "verified",
        Verification::Off => "alone",
    };
    format!("attempts-{way}")
}
