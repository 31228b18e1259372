//! The list of recently opened projects in a file of the user, newest first.

use std::path::{Path, PathBuf};

use sdg_files::write_atomically;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::model_versions::now_secs;

const FORMAT: u32 = 1;
/// Maximum number of projects in the list.
const MAX_PROJECTS: usize = 20;
/// Maximum size of the file.
const MAX_BYTES: u64 = 1 << 20;

/// The file with the list.
#[derive(Debug, Clone)]
pub struct RecentProjects {
    path: PathBuf,
}

/// A recently opened project: its folder, or its photo.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecentProject {
    /// Absolute path.
    pub path: PathBuf,
    /// Time of the last opening: seconds since 1970.
    pub opened_secs: u64,
}

#[derive(Default, Serialize, Deserialize)]
struct RecentFile {
    format: u32,
    projects: Vec<RecentProject>,
}

impl RecentProjects {
    /// The list in this file; the file need not exist yet.
    pub fn at(path: PathBuf) -> Self {
        Self { path }
    }

    fn read(&self) -> Vec<RecentProject> {
        // A missing list, or one of another version, must not prevent opening the page.
        let read = sdg_files::read(&self.path, MAX_BYTES).ok();
        let file: Option<RecentFile> = read.and_then(|bytes| serde_json::from_slice(&bytes).ok());
        file.filter(|file| file.format == FORMAT).map(|file| file.projects).unwrap_or_default()
    }

    /// The projects that still exist, newest first.
    pub fn list(&self) -> Vec<RecentProject> {
        self.read().into_iter().filter(|project| project.path.exists()).collect()
    }

    /// Records that a folder or photo was opened now.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn note(&self, opened: &Path) -> Result<()> {
        let path = std::path::absolute(opened).map_err(Error::file(opened, "cannot be found"))?;
        let mut projects = self.read();
        projects.retain(|known| known.path != path);
        projects.insert(0, RecentProject { path, opened_secs: now_secs() });
        projects.truncate(MAX_PROJECTS);
        if let Some(folder) = self.path.parent() {
            std::fs::create_dir_all(folder).map_err(Error::file(folder, "cannot make this folder"))?;
        }
        let text = serde_json::to_vec_pretty(&RecentFile { format: FORMAT, projects })
            .map_err(|error| Error::Project { path: self.path.clone(), found: error.to_string() })?;
        Ok(write_atomically(&self.path, &text)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_come_first_and_what_is_gone_is_left_out() {
        let folder = tempfile::tempdir().unwrap();
        let recent = RecentProjects::at(folder.path().join("state/recent.json"));
        assert_eq!(recent.list(), []);
        let at = |name: &str| folder.path().join(name);
        for name in ["rod", "lid", "rod"] {
            std::fs::create_dir_all(at(name)).unwrap();
            recent.note(&at(name)).unwrap();
        }
        let paths = || recent.list().into_iter().map(|project| project.path).collect::<Vec<_>>();
        assert_eq!(paths(), [at("rod"), at("lid")]);
        std::fs::remove_dir(at("rod")).unwrap();
        assert_eq!(paths(), [at("lid")]);
        for number in 0..30 {
            recent.note(&at(&format!("{number}"))).unwrap();
        }
        assert_eq!(recent.read().len(), MAX_PROJECTS);
        std::fs::write(folder.path().join("state/recent.json"), "other").unwrap();
        assert_eq!(recent.list(), []);
    }
}
