//! A project's folder: its photos with their marks beside them, and a file that says what is what.
//!
//! ```text
//! DIR/sdg-project.json   photos, tried pictures and what was said of them, versions of the model
//!     photo.png .json    a photo of the part, its marks
//!     pendulum.sdg       the model in use
//!     models/            all versions
//!     tried/             pictures that came from the page
//! ```
//! Names are relative to the folder where they lie in it. A picture that stands in the folder and that the file does not name has
//! come there since: with marks beside it it is a photo, otherwise a picture to try.

use std::collections::BTreeSet;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use sdg_files::write_atomically;
use serde::{Deserialize, Serialize};

use crate::annotation_file;
use crate::error::{Error, Result};
use crate::model_versions::Version;
use crate::picture::{Picture, pictures_in};

const FILE: &str = "sdg-project.json";
/// Where pictures that came from the page are kept.
pub const TRIED_FOLDER: &str = "tried";
const FORMAT: u32 = 1;
/// Larger than any project's file.
const MAX_BYTES: u64 = 64 << 20;

/// What the file says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProjectFile {
    /// Of the file.
    pub format: u32,
    /// The object's name.
    pub label: Option<String>,
    /// Photos of the part.
    pub photos: Vec<String>,
    /// Pictures that a model was tried on.
    pub tried: Vec<Tried>,
    /// Pictures of the folder that are taken out of the project.
    pub removed: BTreeSet<String>,
    /// Versions of the model, oldest first.
    pub models: Vec<Version>,
    /// Index of the one in use.
    pub current_model: Option<usize>,
}

/// A picture that a model was tried on, and what the person said of it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tried {
    pub file: String,
    /// The name for people.
    pub name: String,
    /// The part is not there.
    #[serde(default)]
    pub absent: bool,
    /// The photo that it became.
    #[serde(default)]
    pub became: Option<String>,
}

impl Default for ProjectFile {
    fn default() -> Self {
        Self {
            format: FORMAT,
            label: None,
            photos: Vec::new(),
            tried: Vec::new(),
            removed: BTreeSet::new(),
            models: Vec::new(),
            current_model: None,
        }
    }
}

impl ProjectFile {
    /// Reads a folder's file and adds the pictures that have come there since. Pictures that are gone are left out; their names
    /// come second.
    ///
    /// # Errors
    /// A folder that cannot be read, a file that is no project's, marks that belong to another picture.
    pub fn open(folder: &Path) -> Result<(Self, Vec<String>)> {
        let path = folder.join(FILE);
        let mut file = match fs::metadata(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => Self::default(),
            Err(source) => return Err(Error::file(&path, "cannot read")(source)),
            Ok(metadata) if metadata.len() > MAX_BYTES => {
                return Err(Error::TooLarge { path, most: MAX_BYTES, found: metadata.len() });
            }
            Ok(_) => {
                let bytes = fs::read(&path).map_err(Error::file(&path, "cannot read"))?;
                let read: Self = serde_json::from_slice(&bytes)
                    .map_err(|error| Error::Project { path: path.clone(), found: error.to_string() })?;
                if read.format != FORMAT {
                    return Err(Error::Project { path, found: format!("format {}, expected {FORMAT}", read.format) });
                }
                read
            }
        };
        let mut gone = Vec::new();
        let mut is_there = |name: &String| {
            let there = folder.join(name).is_file();
            if !there {
                gone.push(name.clone());
            }
            there
        };
        file.photos.retain(&mut is_there);
        file.tried.retain(|tried| is_there(&tried.file));
        if file.current_model.is_some_and(|id| id >= file.models.len()) {
            file.current_model = None;
        }
        file.add_new(folder)?;
        Ok((file, gone))
    }

    fn add_new(&mut self, folder: &Path) -> Result<()> {
        for path in pictures_in(folder)? {
            let name = relative(folder, &path);
            let is_known = self.photos.contains(&name)
                || self.removed.contains(&name)
                || self.tried.iter().any(|tried| tried.file == name);
            if is_known {
                continue;
            }
            let picture = Picture::open(&path)?;
            let is_marked = annotation_file::open(&path, None, picture.size)?.marks.has_object();
            if is_marked {
                self.photos.push(name);
            } else {
                self.tried.push(Tried { file: name, name: picture.name, absent: false, became: None });
            }
        }
        // Somewhere the marks must begin.
        if self.photos.is_empty()
            && let Some(first) = self.tried.iter().position(|tried| !tried.absent)
        {
            self.photos.push(self.tried.remove(first).file);
        }
        Ok(())
    }

    /// Writes the file.
    ///
    /// # Errors
    /// A folder that cannot be written to.
    pub fn write(&self, folder: &Path) -> Result<()> {
        let path = folder.join(FILE);
        let text = serde_json::to_vec_pretty(self)
            .map_err(|error| Error::Project { path: path.clone(), found: error.to_string() })?;
        Ok(write_atomically(&path, &text)?)
    }
}

/// The name that the file has for a path: relative to the folder where it lies in it.
pub fn relative(folder: &Path, path: &Path) -> String {
    let inside: PathBuf = path.strip_prefix(folder).map_or_else(|_| absolute(path), Path::to_owned);
    inside.to_string_lossy().into_owned()
}

fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::RgbImage;

    #[test]
    fn pictures_of_a_new_folder_are_sorted_by_their_marks() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["a.png", "b.png", "c.png"] {
            RgbImage::new(60, 40).save(at(name)).unwrap();
        }
        let (file, gone) = ProjectFile::open(folder.path()).unwrap();
        assert_eq!((file.photos, file.tried.len(), gone.len()), (vec!["a.png".to_owned()], 2, 0));
        let labelme = r#"{"imageWidth": 60, "imageHeight": 40, "shapes": [
            {"label": "bar", "shape_type": "rectangle", "points": [[10, 10], [30, 20]]}]}"#;
        fs::write(at("b.json"), labelme).unwrap();
        let (mut file, _) = ProjectFile::open(folder.path()).unwrap();
        assert_eq!(file.photos, ["b.png"]);
        assert_eq!(file.tried.iter().map(|tried| tried.file.as_str()).collect::<Vec<_>>(), ["a.png", "c.png"]);

        file.tried.remove(0);
        file.removed.insert("a.png".into());
        file.tried[0].absent = true;
        file.write(folder.path()).unwrap();
        RgbImage::new(60, 40).save(at("d.png")).unwrap();
        fs::remove_file(at("b.png")).unwrap();
        let (again, gone) = ProjectFile::open(folder.path()).unwrap();
        assert_eq!(gone, ["b.png"]);
        // What was taken out stays out; what is known not to show the part is no photo of it.
        assert_eq!((again.photos, &again.tried), (vec!["d.png".to_owned()], &file.tried));
    }

    #[test]
    fn another_file_is_no_project() {
        let folder = tempfile::tempdir().unwrap();
        for (text, found) in [
            ("[]", "sdg-project.json"),
            ("{", "sdg-project.json"),
            (r#"{"format": 7, "photos": [], "tried": [], "removed": [], "models": []}"#, "format 7"),
        ] {
            fs::write(folder.path().join(FILE), text).unwrap();
            let error = ProjectFile::open(folder.path()).unwrap_err().to_string();
            assert!(error.contains(found), "{error}");
        }
    }
}
