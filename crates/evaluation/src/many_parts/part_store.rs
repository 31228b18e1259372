//! Stores the results of each part: the model file, and a record of the inputs and the outcome of teaching.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use sdg_files::write_atomically;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::held_back::{HeldBackFigures, failure_of};
use crate::statistics::Share;

/// Maximum size of a record.
const MAX_RECORD_BYTES: u64 = 1 << 20;

/// The folder of the models and records.
#[derive(Debug, Clone)]
pub struct PartStore(PathBuf);

/// The record of a part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PartRecord<O = PartOutcome> {
    /// The inputs of teaching: files, arguments, version.
    pub key: Value,
    pub outcome: O,
}

/// The outcome of a teaching run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PartOutcome {
    Taught {
        seconds: f64,
        /// Number of held-out samples in which the part was found.
        found: usize,
        /// Number of held-out samples with the part.
        parts: usize,
        /// Number of wrong detections.
        wrong: usize,
        /// Number of samples without the part in which a detection was accepted.
        false_alarms: usize,
        /// Number of samples without the part.
        without_part: usize,
        /// Median errors of the found parts: distance in pixels of the photo, and angle in degrees.
        median: Option<[f64; 2]>,
        /// Numbers of the photos, from 1, whose grasp points in another direction than that of the first photo.
        turned_photos: Vec<usize>,
    },
    Failed {
        /// The reason of the failure, on one line.
        why: String,
    },
}

impl PartOutcome {
    /// The outcome with the results on held-out samples.
    pub fn taught(seconds: f64, figures: &HeldBackFigures) -> Self {
        let (found, false_alarms) = (figures.found(), figures.false_alarms());
        Self::Taught {
            seconds,
            found: found.count,
            parts: found.of,
            wrong: figures.wrong(),
            false_alarms: false_alarms.count,
            without_part: false_alarms.of,
            median: figures.median_errors(),
            turned_photos: figures.turned().iter().map(|turned| turned.photo).collect(),
        }
    }

    /// The reason why the model is unusable, by the rule of [`HeldBackFigures::failure`]; `None` without a model.
    pub fn failure(&self) -> Option<String> {
        let &Self::Taught { found, parts, false_alarms, without_part, .. } = self else { return None };
        failure_of(Share { count: found, of: parts }, Share { count: false_alarms, of: without_part })
    }

    /// The outcome as a short text.
    pub fn in_words(&self) -> String {
        match self {
            Self::Taught { seconds, found, parts, .. } => {
                format!("finds the part in {found} of {parts} held-out samples ({seconds:.1} s)")
            }
            Self::Failed { why } => format!("failed: {why}"),
        }
    }
}

impl PartStore {
    /// Opens or creates a folder.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn open(folder: &Path) -> Result<Self> {
        for inner in [folder.to_owned(), folder.join("models"), folder.join("parts")] {
            sdg_files::prepare_folder(&inner)?;
        }
        Ok(Self(folder.to_owned()))
    }

    /// The path of a part's model.
    pub fn model_file(&self, part: &str) -> PathBuf {
        self.0.join("models").join(format!("{part}.sdg"))
    }

    fn record_file(&self, part: &str) -> PathBuf {
        self.0.join("parts").join(format!("{part}.json"))
    }

    /// The stored outcome of a part for this key; `None` if no outcome is stored, or only one for another key or with
    /// other fields, as in a record from before `turned_photos`, or if the model file is missing.
    ///
    /// # Errors
    /// The record cannot be read, or the file is not a record: it may be the marks of a photo, and is not replaced.
    pub fn read(&self, part: &str, key: &Value) -> Result<Option<PartOutcome>> {
        let path = self.record_file(part);
        if !path.exists() {
            return Ok(None);
        }
        let record: PartRecord<Value> = serde_json::from_slice(&sdg_files::read(&path, MAX_RECORD_BYTES)?)
            .with_context(|| format!("{}: expected the record of a part", path.display()))?;
        let Ok(outcome) = serde_json::from_value::<PartOutcome>(record.outcome) else { return Ok(None) };
        let is_missing = matches!(outcome, PartOutcome::Taught { .. }) && !self.model_file(part).exists();
        Ok((record.key == *key && !is_missing).then_some(outcome))
    }

    /// Stores the outcome of a part. Without a model, an earlier model of the part is renamed to `NAME.sdg.before`. The
    /// record is written last, because it states that the model is complete.
    ///
    /// # Errors
    /// Files cannot be written or renamed.
    pub fn write(&self, part: &str, model: Option<&[u8]>, record: &PartRecord) -> Result<()> {
        let path = self.model_file(part);
        match model {
            Some(bytes) => write_atomically(&path, bytes)?,
            None => match fs::rename(&path, path.with_extension("sdg.before")) {
                Err(error) if error.kind() != ErrorKind::NotFound => {
                    return Err(error).with_context(|| format!("{}: cannot rename", path.display()));
                }
                _ => {}
            },
        }
        let mut bytes = serde_json::to_vec_pretty(record)?;
        bytes.push(b'\n');
        Ok(write_atomically(&self.record_file(part), &bytes)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn an_outcome_without_a_field_is_not_used_and_another_file_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let store = PartStore::open(folder.path()).unwrap();
        fs::write(store.model_file("lever"), b"model").unwrap();
        let read = |record: &Value| {
            fs::write(store.record_file("lever"), record.to_string()).unwrap();
            store.read("lever", &Value::Null)
        };
        let mut record = json!({"key": null, "outcome": {"taught": {
            "seconds": 1.5, "found": 19, "parts": 20, "wrong": 0, "false_alarms": 0, "without_part": 5,
            "median": [0.5, 0.25],
        }}});
        assert_eq!(read(&record).unwrap(), None);
        record["outcome"]["taught"]["turned_photos"] = json!([2]);
        let Some(PartOutcome::Taught { turned_photos, .. }) = read(&record).unwrap() else { panic!("not used") };
        assert_eq!(turned_photos, [2]);
        let error = read(&json!({"images": [], "annotations": []})).unwrap_err().to_string();
        assert!(error.ends_with("lever.json: expected the record of a part"), "{error}");
    }

    #[test]
    fn a_failed_teaching_renames_the_earlier_model() {
        let folder = tempfile::tempdir().unwrap();
        let store = PartStore::open(folder.path()).unwrap();
        let outcome = PartOutcome::Failed { why: "nothing learnt".to_owned() };
        let record = PartRecord { key: Value::Null, outcome: outcome.clone() };
        for model in [None, Some(&b"model"[..]), None] {
            store.write("lever", model, &record).unwrap();
            assert_eq!(store.model_file("lever").exists(), model.is_some());
        }
        assert_eq!(fs::read(store.model_file("lever").with_extension("sdg.before")).unwrap(), b"model");
        assert_eq!(store.read("lever", &Value::Null).unwrap(), Some(outcome));
    }
}
