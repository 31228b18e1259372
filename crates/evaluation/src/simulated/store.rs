//! The folder of an evaluation, with a file for every finished unit of work.
//!
//! ```text
//! DIR/settings.json
//! DIR/models/C-pendulum.sdg                   the taught network
//! DIR/cells/C-pendulum.teaching.json          result of teaching
//! DIR/cells/C-pendulum.look.json              unseen pictures, with the part and without
//! DIR/cells/C-pendulum.attempts-verified.json attempts, rewritten after each
//! DIR/cells/C-pendulum.speed.json             seconds per picture
//! DIR/pictures/C-pendulum.png                 one of the unseen pictures, for the page
//! DIR/axes/C-pendulum.tilt.json               pictures of an axis
//! DIR/axes/C-pendulum.attempts-shake.json     attempts under an error
//! DIR/cameras/C-pendulum.tilt.json            pictures of a set for calibrated cameras
//! ```
//!
//! Each JSON file contains the settings with which it was made, and is written atomically. Results of teaching
//! contain only the settings of teaching, so that the protocol and the axes use the same models for any number of
//! attempts or pictures.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use sdg_files::{Access, Lock, write_atomically};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::settings::{Settings, difference};
use crate::error::EvaluationError;
use crate::machine::machine;

/// Maximum size of a record.
const MAX_RECORD_BYTES: u64 = 64 << 20;

/// The folder of an evaluation. The lock on it is either exclusive or shared with other processes.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    settings: Settings,
    /// The process that made the folder; `None` if its version did not store it.
    begun_by: Option<Origin>,
    /// Locked while the store exists.
    _lock: Lock,
}

/// Machine and program of a process.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Origin {
    machine: String,
    version: String,
}

impl Origin {
    /// Those of this process.
    fn this() -> Self {
        Self { machine: machine(), version: format!("sdg {}", env!("CARGO_PKG_VERSION")) }
    }
}

/// The contents of a file in the store.
#[derive(Serialize, Deserialize)]
struct Stored<S, T> {
    settings: S,
    record: T,
}

impl Store {
    /// Opens or creates the folder of an evaluation.
    ///
    /// # Errors
    /// The folder cannot be written, is used by another process, or has models that were taught with other settings.
    pub fn open(folder: &Path, settings: &Settings) -> Result<Self> {
        Self::open_with(folder, settings, Access::Alone)
    }

    /// Like [`Self::open`], for one of several processes, which divide the units among themselves by other means.
    ///
    /// # Errors
    /// The errors of [`Self::open`]; another process is an error only if it has the folder exclusively.
    pub fn open_shared(folder: &Path, settings: &Settings) -> Result<Self> {
        Self::open_with(folder, settings, Access::Shared)
    }

    fn open_with(folder: &Path, settings: &Settings, access: Access) -> Result<Self> {
        sdg_files::prepare_folder(folder)?;
        for inner in ["models", "cells", "pictures", "axes", "cameras"] {
            let inner = folder.join(inner);
            fs::create_dir_all(&inner).with_context(|| format!("{}: cannot make this folder", inner.display()))?;
        }
        let Some(lock) = Lock::take(&folder.join(".lock"), access)? else {
            bail!("{}: another evaluation is running in this folder", folder.display());
        };
        let mut store =
            Self { folder: folder.to_owned(), settings: settings.clone(), begun_by: Some(Origin::this()), _lock: lock };
        let teaching = settings.teaching();
        match store.read_made_with("settings.json", &teaching)? {
            Some(begun_by) => store.begun_by = begun_by,
            None => store.write_made_with("settings.json", &teaching, &store.begun_by)?,
        }
        Ok(store)
    }

    /// Machine and version of this process for a page and, if they differ, those of the process that began the results.
    pub(super) fn origin_facts(&self) -> Vec<(&'static str, String)> {
        let this = Origin::this();
        let other = self.begun_by.as_ref().filter(|begun_by| **begun_by != this);
        let other = other.map(|Origin { machine, version }| ("results begun with", format!("{version} on {machine}")));
        [("machine", this.machine), ("version", this.version)].into_iter().chain(other).collect()
    }

    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The settings of the results of the paper's protocol.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// A stored record of the paper's protocol. `name` is the name of its file.
    ///
    /// # Errors
    /// The file cannot be read, is damaged, or was made with other settings.
    pub fn read<T: DeserializeOwned>(&self, name: &str) -> Result<Option<T>> {
        self.read_made_with(name, &self.settings)
    }

    /// A stored record that depends on `settings`.
    ///
    /// # Errors
    /// The errors of [`Self::read`].
    pub fn read_made_with<T: DeserializeOwned>(&self, name: &str, settings: &impl Serialize) -> Result<Option<T>> {
        self.read_made_with_defaults(name, settings, &[])
    }

    /// Like [`Self::read_made_with`]; `defaults` are the settings of files in which they are missing, by name.
    ///
    /// # Errors
    /// The errors of [`Self::read`].
    pub(super) fn read_made_with_defaults<T: DeserializeOwned>(
        &self,
        name: &str,
        settings: &impl Serialize,
        defaults: &[(&str, Value)],
    ) -> Result<Option<T>> {
        let path = self.folder.join(name);
        let Some((mut made_with, record)) = read_stored(&path)? else { return Ok(None) };
        if let Some(made_with) = made_with.as_object_mut() {
            for (name, value) in defaults {
                made_with.entry(*name).or_insert_with(|| value.clone());
            }
        }
        if let Some(difference) = difference(settings, &made_with)? {
            return Err(EvaluationError::OtherSettings { path, difference }.into());
        }
        Ok(Some(serde_json::from_value(record).with_context(|| not_a_record(&path))?))
    }

    /// Writes a record of the paper's protocol atomically.
    pub fn write<T: Serialize>(&self, name: &str, record: &T) -> Result<()> {
        self.write_made_with(name, &self.settings, record)
    }

    /// Writes a record that depends on `settings` atomically.
    pub fn write_made_with(&self, name: &str, settings: &impl Serialize, record: &impl Serialize) -> Result<()> {
        let stored = Stored { settings, record };
        let mut bytes = serde_json::to_vec_pretty(&stored)?;
        bytes.push(b'\n');
        self.write_bytes(name, &bytes)
    }

    /// Writes any file of the folder atomically.
    pub fn write_bytes(&self, name: &str, bytes: &[u8]) -> Result<()> {
        Ok(write_atomically(&self.folder.join(name), bytes)?)
    }

    /// The path of a file in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Removes an obsolete file, if it exists.
    pub fn remove(&self, name: &str) -> Result<()> {
        let path = self.folder.join(name);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                Err(error).with_context(|| format!("{}: cannot remove", path.display()))
            }
            _ => Ok(()),
        }
    }
}

/// The settings and the record in a file of any store; `None` if there is no such file.
///
/// # Errors
/// The file cannot be read or is damaged.
pub(super) fn read_stored(path: &Path) -> Result<Option<(Value, Value)>> {
    if !path.exists() {
        return Ok(None);
    }
    let bytes = sdg_files::read(path, MAX_RECORD_BYTES)?;
    let stored: Stored<Value, Value> = serde_json::from_slice(&bytes).with_context(|| not_a_record(path))?;
    Ok(Some((stored.settings, stored.record)))
}

fn not_a_record(path: &Path) -> String {
    format!("{}: expected a record of an evaluation", path.display())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_inputs::one_line;

    fn settings(seed: u64) -> Settings {
        Settings::for_test(seed, 2, 1)
    }

    #[test]
    fn what_was_written_is_there_when_opened_again() {
        let folder = tempfile::tempdir().unwrap();
        {
            let store = Store::open(folder.path(), &settings(1)).unwrap();
            assert_eq!(store.read::<u32>("cells/a.json").unwrap(), None);
            store.write("cells/a.json", &7u32).unwrap();
        }
        let store = Store::open(folder.path(), &settings(1)).unwrap();
        assert_eq!(store.read::<u32>("cells/a.json").unwrap(), Some(7));
    }

    #[test]
    fn other_settings_are_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        drop(Store::open(folder.path(), &settings(1)).unwrap());
        let refused = one_line(&Store::open(folder.path(), &settings(2)).unwrap_err());
        assert!(refused.contains("settings.json: made with other settings (seed: expected 2, found 1)"), "{refused}");
        // A file copied from another evaluation has other settings as well.
        let elsewhere = tempfile::tempdir().unwrap();
        Store::open(elsewhere.path(), &settings(3)).unwrap().write("cells/a.json", &7u32).unwrap();
        fs::copy(elsewhere.path().join("cells/a.json"), folder.path().join("cells/a.json")).unwrap();
        let store = Store::open(folder.path(), &settings(1)).unwrap();
        assert!(one_line(&store.read::<u32>("cells/a.json").unwrap_err()).contains("seed: expected 1, found 3"));
    }

    #[test]
    fn results_that_another_process_began_name_its_machine_and_version() {
        let folder = tempfile::tempdir().unwrap();
        let names = || -> Vec<&str> {
            let store = Store::open(folder.path(), &settings(1)).unwrap();
            store.origin_facts().iter().map(|(name, _)| *name).collect()
        };
        assert_eq!([names(), names()], [["machine", "version"]; 2]);
        let path = folder.path().join("settings.json");
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, text.replace(&machine(), "2 cores, x86_64 linux")).unwrap();
        assert_eq!(names(), ["machine", "version", "results begun with"]);
        // A version that did not store them.
        let store = Store::open(folder.path(), &settings(1)).unwrap();
        store.write_made_with("settings.json", &store.settings().teaching(), &()).unwrap();
        drop(store);
        assert_eq!(names(), ["machine", "version"]);
    }

    #[test]
    fn damaged_records_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), &settings(1)).unwrap();
        fs::write(folder.path().join("cells/a.json"), "{\"settings\": {").unwrap();
        let refused = one_line(&store.read::<u32>("cells/a.json").unwrap_err());
        assert!(refused.contains("a.json: expected a record of an evaluation"), "{refused}");
    }

    #[test]
    fn two_at_once_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let _first = Store::open(folder.path(), &settings(1)).unwrap();
        let refused = Store::open(folder.path(), &settings(1)).unwrap_err().to_string();
        assert!(refused.contains("another evaluation is running"), "{refused}");
    }

    #[test]
    fn many_share_a_folder_and_keep_those_out_who_work_alone() {
        let folder = tempfile::tempdir().unwrap();
        let shared = [1, 2].map(|_| Store::open_shared(folder.path(), &settings(1)).unwrap());
        let refused = Store::open(folder.path(), &settings(1)).unwrap_err().to_string();
        assert!(refused.contains("another evaluation is running"), "{refused}");
        drop(shared);
        let _alone = Store::open(folder.path(), &settings(1)).unwrap();
        assert!(Store::open_shared(folder.path(), &settings(1)).is_err());
    }
}
