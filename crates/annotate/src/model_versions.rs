//! The versions of a model: the file of each teaching is kept, under a name with the time of the teaching. The version
//! in use also exists under the model's own name.
//!
//! ```text
//! pendulum.sdg                           the version in use
//! models/pendulum-C-20261123-203107.sdg  a teaching's file
//! models/pendulum-20261120-081500.sdg    the former pendulum.sdg, if no teaching here made it
//! pendulum-2.sdg                         the version in use, if pendulum.sdg is that of another project in this folder
//! ```
//!
//! If the user gives a file in another folder for the model, `models/` is there, too; both folders may be moved. A
//! version is only read and copied, never changed or deleted, so a path in a project's file from elsewhere does no
//! harm.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use sdg_files::{absolute, write_atomically};
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::names::{free_numbered, relative};
use crate::teacher::TaughtSummary;

/// Maximum size of a model file.
const MAX_MODEL_BYTES: u64 = 1 << 30;

/// The model of one teaching.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Version {
    /// File name in the project's folder of versions; for a file elsewhere, its path in the project's folder, or its
    /// absolute path.
    pub file: String,
    /// Time of the teaching: seconds since 1970.
    pub taught_secs: u64,
    /// The model's facts and measured quality.
    pub summary: TaughtSummary,
    /// Number of photos that it was taught from.
    pub photos: usize,
    /// Number of pictures without the part in its teaching.
    pub negatives: usize,
    /// [`fingerprint`] of the teaching's inputs.
    pub material: String,
    /// The settings of its [`TeachRequest`](crate::teacher::TeachRequest); `None` in files of earlier programs.
    #[serde(default)]
    pub symmetry: Option<u32>,
    #[serde(default)]
    pub fixed_height: Option<bool>,
    /// Heights of the marks and of the grasp above the table, in metres; `None` without a calibrated camera, and in
    /// files of earlier programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heights_m: Option<[f64; 2]>,
}

/// All versions, oldest first.
#[derive(Debug, Clone, Default)]
pub struct ModelVersions {
    /// Folder for new versions, beside the model's file.
    pub folder: PathBuf,
    /// The project's folder of versions, used unless the user gives another file for the model.
    pub default_folder: PathBuf,
    pub versions: Vec<Version>,
    pub current: Option<usize>,
}

impl ModelVersions {
    /// # Errors
    /// Unknown version.
    pub fn get(&self, id: usize) -> Result<&Version> {
        self.versions.get(id).ok_or(Error::NoSuchVersion { id, count: self.versions.len() })
    }

    /// Reads a version's file.
    ///
    /// # Errors
    /// Unknown version, or its file cannot be read.
    pub fn read(&self, id: usize) -> Result<Vec<u8>> {
        let path = self.path(self.get(id)?);
        let failed = || Error::file(&path, "cannot read");
        let found = fs::metadata(&path).map_err(failed())?.len();
        if found > MAX_MODEL_BYTES {
            return Err(Error::TooLarge { path, most: MAX_MODEL_BYTES, found });
        }
        fs::read(&path).map_err(failed())
    }

    fn path(&self, version: &Version) -> PathBuf {
        let file = Path::new(&version.file);
        let name = file.file_name().unwrap_or_default();
        // Earlier programs gave no path of a file elsewhere. Only the name is known of a file that was moved.
        let paths = [self.default_folder.join(file), self.project().join(file), self.folder.join(name)];
        let [first, ..] = &paths;
        paths.iter().find(|path| path.exists()).unwrap_or(first).clone()
    }

    /// The absolute path of the project's folder.
    pub fn project(&self) -> PathBuf {
        absolute(&self.default_folder).parent().map(Path::to_owned).unwrap_or_default()
    }

    /// Writes a new version under its own name and makes it the one in use, at `path`.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn keep(&mut self, path: &Path, bytes: &[u8], version: Version) -> Result<()> {
        fs::create_dir_all(&self.folder).map_err(Error::file(&self.folder, "cannot make this folder"))?;
        self.keep_foreign(path)?;
        let name = format!("{}-{}-{}.sdg", stem(path), version.summary.model, stamp(version.taught_secs));
        let file = free_numbered(&self.folder.join(name));
        write_atomically(&file, bytes)?;
        write_atomically(path, bytes)?;
        let file = match file.strip_prefix(&self.default_folder) {
            Ok(name) => name.to_string_lossy().into_owned(),
            Err(_) => relative(&self.project(), &absolute(&file)),
        };
        self.versions.push(Version { file, ..version });
        self.current = Some(self.versions.len() - 1);
        Ok(())
    }

    /// Makes a version the one in use, at `path`.
    ///
    /// # Errors
    /// Unknown version, or files cannot be read or written.
    pub fn use_version(&mut self, path: &Path, id: usize) -> Result<Vec<u8>> {
        let bytes = self.read(id)?;
        self.keep_foreign(path)?;
        write_atomically(path, &bytes)?;
        self.current = Some(id);
        Ok(bytes)
    }

    /// Writes the version in use, if it can be read, to `path` as well, unless a file that is no version is there.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_current(&self, path: &Path) -> Result<()> {
        let Some(Ok(bytes)) = self.current.map(|id| self.read(id)) else { return Ok(()) };
        if path.exists() && !fs::read(path).is_ok_and(|standing| self.is_version(&standing)) {
            return Ok(());
        }
        Ok(write_atomically(path, &bytes)?)
    }

    /// Whether a file has the content of a version, the newest first.
    fn is_version(&self, content: &[u8]) -> bool {
        (0..self.versions.len()).rev().any(|id| self.read(id).is_ok_and(|bytes| bytes == content))
    }

    /// `path`, unless a version of another project stands there; then the first numbered path that is free or has a
    /// version of this project. `all` gives the versions of all projects of the folder, which share a folder of
    /// versions.
    ///
    /// # Errors
    /// The file at `path` cannot be read.
    pub fn own_path(&self, path: &Path, all: impl FnOnce() -> Vec<Version>) -> Result<PathBuf> {
        let is_own = |path: &Path| !path.exists() || fs::read(path).is_ok_and(|standing| self.is_version(&standing));
        if is_own(path) {
            return Ok(path.to_owned());
        }
        let standing = fs::read(path).map_err(Error::file(path, "cannot read"))?;
        if !(Self { versions: all(), ..self.clone() }).is_version(&standing) {
            return Ok(path.to_owned());
        }
        let numbered = |number: usize| path.with_file_name(format!("{}-{number}.sdg", stem(path)));
        Ok((2..).map(numbered).find(|path| is_own(path)).expect("numbers do not run out"))
    }

    /// Copies the file at `path` into the folder of versions, unless it is a known version.
    fn keep_foreign(&self, path: &Path) -> Result<()> {
        let Ok(metadata) = fs::metadata(path) else { return Ok(()) };
        let standing = fs::read(path).map_err(Error::file(path, "cannot read"))?;
        if self.is_version(&standing) {
            return Ok(());
        }
        let written = metadata.modified().unwrap_or(UNIX_EPOCH).duration_since(UNIX_EPOCH).unwrap_or_default();
        let name = format!("{}-{}.sdg", stem(path), stamp(written.as_secs()));
        write_atomically(&free_numbered(&self.folder.join(name)), &standing)?;
        Ok(())
    }
}

/// The current time in seconds since 1970.
pub fn now_secs() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since: Duration| since.as_secs())
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Date and time of day in UTC, for file names: 20261123-203107.
///
/// # Source
/// Hinnant, "chrono-Compatible Low-Level Date Algorithms", `civil_from_days`.
fn stamp(secs: u64) -> String {
    let (days, of_day) = (secs / 86_400, secs % 86_400);
    let z = days + 719_468;
    let (era, of_era) = (z / 146_097, z % 146_097);
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted_month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * shifted_month + 2) / 5 + 1;
    let month = if shifted_month < 10 { shifted_month + 3 } else { shifted_month - 9 };
    let year = year_of_era + 400 * era + u64::from(month <= 2);
    format!("{year:04}{month:02}{day:02}-{:02}{:02}{:02}", of_day / 3600, of_day / 60 % 60, of_day % 60)
}

/// A hash of a text, such as a teaching's inputs: FNV-1a, 64 bits.
pub fn fingerprint(text: &str) -> String {
    let hash = text
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
    format!("{hash:016x}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_demonstration::ModelKind;

    fn version(taught_secs: u64) -> Version {
        let summary =
            TaughtSummary { model: ModelKind::S, object: "rod".into(), seconds: 1.0, figures: None, negatives: None };
        Version {
            file: String::new(),
            taught_secs,
            summary,
            photos: 1,
            negatives: 0,
            material: fingerprint("marks"),
            symmetry: None,
            fixed_height: None,
            heights_m: None,
        }
    }

    #[test]
    fn times_are_those_of_the_calendar() {
        assert_eq!(stamp(0), "19700101-000000");
        assert_eq!(stamp(951_782_400), "20000229-000000");
        assert_eq!(stamp(1_795_466_263), "20261123-203743");
    }

    #[test]
    fn no_model_is_written_over() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rod.sdg");
        fs::write(&path, "from elsewhere").unwrap();
        let models = folder.path().join("models");
        let mut versions = ModelVersions { folder: models.clone(), default_folder: models, ..ModelVersions::default() };
        versions.keep(&path, b"first", version(60)).unwrap();
        versions.keep(&path, b"second", version(60)).unwrap();
        let texts = || -> Vec<String> {
            let mut texts: Vec<String> = fs::read_dir(folder.path().join("models"))
                .unwrap()
                .map(|entry| fs::read_to_string(entry.unwrap().path()).unwrap())
                .collect();
            texts.sort();
            texts
        };
        assert_eq!(texts(), ["first", "from elsewhere", "second"]);
        assert_eq!(versions.versions[0].file, "rod-S-19700101-000100.sdg");
        assert_eq!((fs::read_to_string(&path).unwrap().as_str(), versions.current), ("second", Some(1)));
        assert_eq!(versions.use_version(&path, 0).unwrap(), b"first");
        assert_eq!((fs::read_to_string(&path).unwrap().as_str(), versions.current), ("first", Some(0)));
        assert_eq!(texts().len(), 3, "a version that is kept already is not copied again");
        assert!(versions.use_version(&path, 2).unwrap_err().to_string().contains("below 2, found 2"));
    }

    #[test]
    fn the_model_in_use_of_another_project_is_not_written_over() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let versions = || ModelVersions { folder: at("models"), default_folder: at("models"), ..Default::default() };
        let (mut one, mut other) = (versions(), versions());
        // A file that no project names is replaced, although the folder of versions has it, too.
        fs::create_dir(at("models")).unwrap();
        for name in ["rod.sdg", "models/rod-19700101-000000.sdg"] {
            fs::write(at(name), "restored").unwrap();
        }
        assert_eq!(one.own_path(&at("rod.sdg"), Vec::new).unwrap(), at("rod.sdg"));
        one.keep(&at("rod.sdg"), b"first", version(60)).unwrap();
        // A numbered file that is no version is kept.
        fs::write(at("rod-2.sdg"), "the user's").unwrap();
        for bytes in ["second", "third"] {
            let path = other.own_path(&at("rod.sdg"), || one.versions.clone()).unwrap();
            assert_eq!(path, at("rod-3.sdg"));
            other.keep(&path, bytes.as_bytes(), version(60)).unwrap();
        }
        other.use_version(&at("rod-3.sdg"), 0).unwrap();
        let texts = ["rod.sdg", "rod-2.sdg", "rod-3.sdg"].map(|name| fs::read_to_string(at(name)).unwrap());
        assert_eq!(texts, ["first", "the user's", "second"]);
        // A part with another name has its model there, too, unless that is the name of another file.
        other.write_current(&at("bar.sdg")).unwrap();
        other.write_current(&at("rod.sdg")).unwrap();
        let texts = ["bar.sdg", "rod.sdg"].map(|name| fs::read_to_string(at(name)).unwrap());
        assert_eq!(texts, ["second", "first"]);
    }
}
