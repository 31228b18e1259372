//! A project: photos with their marks beside them, and a file that records the role of each file.
//!
//! ```text
//! DIR/sdg-project.json         photos, tried pictures and the user's statements on them, versions of the model
//!     photo.sdg-project.json   the same for a photo that was opened alone
//!     photo.png .json          a photo of the part, its marks
//!     pendulum.sdg             the model in use
//!     models/                  all versions
//!     tried/                   pictures added on the page
//! ```
//! Names are relative to the project's folder for files in it. A project's folder may contain pictures that its file
//! does not name, because they were added later: such a picture is a photo if it has marks beside it (in a text file:
//! with a grasp), otherwise a picture to try; if its marks cannot be read, it is left out. In a new folder with several
//! pictures and no marks, the user chooses the photo. A photo's own project ignores the other files of the folder.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use sdg_demonstration::PixelFrame;
use sdg_files::{absolute_folder, write_atomically};
use serde::{Deserialize, Serialize};

use crate::annotation_file;
use crate::error::{Error, Result};
use crate::model_versions::Version;
use crate::names::{PROJECT_FILE, file_name, relative};
use crate::picture::{Picture, pictures_in};
use crate::region::Searched;

/// Folder of pictures added on the page.
pub const TRIED_FOLDER: &str = "tried";
/// Maximum number of pictures to try.
pub const MAX_TRIAL_PICTURES: usize = 500;
const FORMAT: u32 = 1;
/// Maximum size of a project's file.
const MAX_BYTES: u64 = 64 << 20;

/// A project's file, and the folder that its names are relative to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProjectPlace {
    pub folder: PathBuf,
    pub file: PathBuf,
    /// Whether the folder was opened, and not a single photo in it.
    pub is_folder: bool,
}

impl ProjectPlace {
    pub fn of_folder(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), file: folder.join(PROJECT_FILE), is_folder: true }
    }

    /// The project of the photo's folder if it names the photo, otherwise the photo's own project.
    ///
    /// # Errors
    /// A file cannot be read or is not a project's file.
    pub fn of_photo(photo: &Path) -> Result<Self> {
        let folder = photo.parent().unwrap_or(Path::new("")).to_owned();
        let whole = Self { folder: folder.clone(), file: folder.join(PROJECT_FILE), is_folder: false };
        let known = ProjectFile::read(&whole)?;
        if known.is_some_and(|file| file.photos.contains(&relative(&folder, photo))) {
            return Ok(whole);
        }
        Ok(Self { folder, file: photo.with_extension(PROJECT_FILE), is_folder: false })
    }

    /// The project's path for display and comparison, the same for every spelling: the folder, or the file of a photo's
    /// project.
    pub fn shown(&self) -> String {
        let folder = absolute_folder(&self.folder);
        match self.file.file_name() {
            Some(name) if name != PROJECT_FILE => folder.join(name).display().to_string(),
            _ => folder.display().to_string(),
        }
    }
}

/// The project's file for an opened photo; it need not exist yet.
///
/// # Errors
/// A file in the photo's folder cannot be read or is not a project's file.
pub fn project_of_photo(photo: &Path) -> Result<PathBuf> {
    Ok(ProjectPlace::of_photo(photo)?.file)
}

/// The names of the pictures in the project of the photo's folder; some of the pictures may be missing.
///
/// # Errors
/// The project's file cannot be read or is not a project's file.
pub fn names_in_project(photo: &Path) -> Result<Vec<String>> {
    let place = ProjectPlace::of_folder(photo.parent().unwrap_or(Path::new("")));
    let ProjectFile { mut photos, tried, .. } = ProjectFile::read(&place)?.unwrap_or_default();
    photos.extend(tried.into_iter().map(|tried| tried.file));
    Ok(photos)
}

/// The versions of the models of all projects in a folder whose files can be read.
pub fn versions_in(folder: &Path) -> Vec<Version> {
    let files = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let files = files.filter(|file| file_name(file).ends_with(PROJECT_FILE));
    let place = |file| ProjectPlace { folder: folder.to_owned(), file, is_folder: false };
    files.filter_map(|file| ProjectFile::read(&place(file)).ok().flatten()).flat_map(|project| project.models).collect()
}

/// The name of the part in the project of a folder or photo, if it has one.
pub fn label_of(opened: &Path) -> Option<String> {
    let place = if opened.is_dir() { ProjectPlace::of_folder(opened) } else { ProjectPlace::of_photo(opened).ok()? };
    let file = ProjectFile::read(&place).ok().flatten();
    if let Some(label) = file.as_ref().and_then(|file| file.label.clone()) {
        return Some(label);
    }
    // Without a name in the project's file, the photo's marks give it.
    let first = file.and_then(|file| file.photos.first().map(|name| place.folder.join(name)));
    let photo = if place.is_folder { first? } else { opened.to_owned() };
    let size = Picture::open(&photo, PixelFrame::Upright).ok()?.size;
    annotation_file::open(&photo, None, size).ok()?.label
}

/// The contents of a project's file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProjectFile {
    /// Version of the format.
    pub format: u32,
    /// The object's name.
    pub label: Option<String>,
    /// Photos of the part.
    pub photos: Vec<String>,
    /// Pictures that a model was tried on.
    pub tried: Vec<Tried>,
    /// Pictures of the folder that were removed from the project.
    pub removed: BTreeSet<String>,
    /// Versions of the model, oldest first.
    pub models: Vec<Version>,
    /// Index of the version in use.
    pub current_model: Option<usize>,
    /// Files of the marks that are not named after their photos, by the photos' names.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub marks: BTreeMap<String, String>,
    /// The searched region of pictures; `None` in files without this field: the region of the model in use applies.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub searched: Option<Searched>,
}

/// A picture that a model was tried on, with the user's statements on it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tried {
    pub file: String,
    /// Name for display.
    pub name: String,
    /// The part is not in the picture.
    #[serde(default)]
    pub absent: bool,
    /// The photo that it became.
    #[serde(default)]
    pub became: Option<String>,
}

/// Files named in a project's file that do not exist or cannot be read, for example because their disk is not mounted.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Gone {
    pub photos: Vec<String>,
    pub tried: Vec<Tried>,
    /// The photos that the project's file named, also those that are there. The first one is the reference.
    pub order: Vec<String>,
    /// A sentence for the user about each picture that is left out: these, and unreadable ones that were added to the
    /// folder; and one about those beyond the maximum number.
    pub notes: Vec<String>,
}

impl Gone {
    /// Opens a picture. If it cannot be read, a note says why it is left out.
    pub fn open(&mut self, path: &Path, frame: PixelFrame) -> Option<Picture> {
        Picture::open(path, frame).map_err(|error| self.leave_out(&error)).ok()
    }

    /// Adds a note that a picture is left out.
    fn leave_out(&mut self, error: &Error) {
        self.notes.push(format!("{error}; this picture is left out."));
    }

    /// Like [`Self::leave_out`], with the picture's name unless the error begins with it.
    pub fn leave_out_named(&mut self, name: &str, error: &Error) {
        let text = error.to_string();
        let name = if text.starts_with(name) { String::new() } else { format!("{name}: ") };
        self.notes.push(format!("{name}{text}; this picture is left out."));
    }
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
            marks: BTreeMap::new(),
            searched: None,
        }
    }
}

impl ProjectFile {
    /// Reads a project's file, if it exists.
    ///
    /// # Errors
    /// The file cannot be read or is not a project's file.
    fn read(place: &ProjectPlace) -> Result<Option<Self>> {
        let path = place.file.clone();
        match fs::metadata(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
            Err(source) => Err(Error::file(&path, "cannot read")(source)),
            Ok(metadata) if metadata.len() > MAX_BYTES => {
                Err(Error::TooLarge { path, most: MAX_BYTES, found: metadata.len() })
            }
            Ok(_) => {
                let bytes = fs::read(&path).map_err(Error::file(&path, "cannot read"))?;
                let read: Self = serde_json::from_slice(&bytes)
                    .map_err(|error| Error::Project { path: path.clone(), found: error.to_string() })?;
                if read.format != FORMAT {
                    return Err(Error::Project { path, found: format!("format {}, expected {FORMAT}", read.format) });
                }
                Ok(Some(read.respelled(&place.folder)))
            }
        }
    }

    /// Names every picture as [`relative`] does, once. Earlier programs named a picture of the folder as it was given,
    /// such as `./a.png`, and could list it twice.
    fn respelled(mut self, folder: &Path) -> Self {
        let name = |name: &String| relative(folder, &folder.join(name));
        let mut photos = BTreeSet::new();
        self.photos = self.photos.iter().map(name).filter(|photo| photos.insert(photo.clone())).collect();
        self.removed = self.removed.iter().map(name).collect();
        self.marks = self.marks.iter().map(|(photo, file)| (name(photo), name(file))).collect();
        let mut tried = BTreeSet::new();
        for one in std::mem::take(&mut self.tried) {
            let one = Tried { file: name(&one.file), became: one.became.as_ref().map(name), ..one };
            // A photo is among the pictures to try only if it was made from one of them.
            let is_kept = one.became.is_some() || !photos.contains(&one.file);
            if is_kept && tried.insert(one.file.clone()) {
                self.tried.push(one);
            }
        }
        self
    }

    /// Reads a project's file and, for a folder, adds pictures that were added later. Missing pictures are removed and
    /// returned separately; pictures that cannot be read, or whose marks cannot, and those beyond the maximum number of
    /// pictures to try are not added.
    ///
    /// # Errors
    /// The folder cannot be read, the file is not a project's file, or an Exif orientation rotates a marked photo of a
    /// calibrated camera.
    pub fn open(place: &ProjectPlace, frame: PixelFrame) -> Result<(Self, Gone)> {
        let read = Self::read(place)?;
        let is_new = read.is_none();
        let mut file = read.unwrap_or_default();
        let folder = &place.folder;
        let is_there = |name: &String| folder.join(name).is_file();
        let order = file.photos.clone();
        let (photos, gone_photos) = file.photos.drain(..).partition(is_there);
        let (tried, gone_tried) = file.tried.drain(..).partition(|tried: &Tried| is_there(&tried.file));
        let mut gone = Gone { photos: gone_photos, tried: gone_tried, order, notes: Vec::new() };
        let names = gone.photos.iter().chain(gone.tried.iter().map(|tried| &tried.file));
        gone.notes = names.map(|name| format!("{name} does not exist now; the project still names it.")).collect();
        (file.photos, file.tried) = (photos, tried);
        if file.current_model.is_some_and(|id| id >= file.models.len()) {
            file.current_model = None;
        }
        if place.is_folder {
            file.add_new(folder, is_new, frame, &mut gone)?;
            // A missing photo may come back; until then, no picture replaces it.
            if gone.photos.is_empty() {
                file.choose_only_photo();
            }
        }
        Ok((file, gone))
    }

    /// Adds the names of the missing files, so that the project still contains them: photos at their earlier places.
    /// Removed files, which may have come back before, are left out.
    pub fn keep_missing(&mut self, gone: &Gone) {
        let place = |name: &String| gone.order.iter().position(|known| known == name).unwrap_or(usize::MAX);
        for name in &gone.photos {
            if !self.photos.contains(name) && !self.removed.contains(name) {
                let next = self.photos.iter().position(|other| place(other) > place(name));
                self.photos.insert(next.unwrap_or(self.photos.len()), name.clone());
            }
        }
        let is_new = |tried: &&Tried| {
            !self.removed.contains(&tried.file) && self.tried.iter().all(|known| known.file != tried.file)
        };
        let tried: Vec<Tried> = gone.tried.iter().filter(is_new).cloned().collect();
        self.tried.extend(tried);
    }

    fn add_new(&mut self, folder: &Path, is_new: bool, frame: PixelFrame, gone: &mut Gone) -> Result<()> {
        let most = MAX_TRIAL_PICTURES.max(self.tried.len());
        for path in pictures_in(folder)? {
            let name = relative(folder, &path);
            let is_known = self.photos.contains(&name)
                || self.removed.contains(&name)
                || self.tried.iter().any(|tried| tried.file == name);
            if is_known {
                continue;
            }
            let Some(picture) = gone.open(&path, frame) else { continue };
            let is_photo = match annotation_file::open(&path, None, picture.size) {
                Ok(opened) => opened.is_of_photo(),
                Err(error) => {
                    // The marks of a photo that an Exif orientation rotates may name its upright size.
                    picture.check_is_markable()?;
                    gone.leave_out_named(&picture.name, &error);
                    continue;
                }
            };
            if is_photo {
                self.photos.push(name);
            } else {
                self.tried.push(Tried { file: name, name: picture.name, absent: false, became: None });
            }
        }
        if is_new && self.photos.is_empty() && self.tried.len() > 1 {
            // Only the user knows which of them is the photo; until it is chosen, none is added.
            self.removed.extend(self.tried.drain(..).map(|tried| tried.file));
        }
        if self.tried.len() > most {
            let count = self.tried.split_off(most).len();
            gone.notes.push(format!(
                "Pictures of this folder that are left out, because at most {most} can be tried: {count}. “From this \
                 folder” offers them."
            ));
        }
        Ok(())
    }

    /// If there is no photo, the first picture that may show the part becomes one, such as the only picture of a new
    /// folder.
    fn choose_only_photo(&mut self) {
        if self.photos.is_empty()
            && let Some(first) = self.tried.iter().position(|tried| !tried.absent)
        {
            self.photos.push(self.tried.remove(first).file);
        }
    }

    /// Whether the project only consists of a photo, which needs no file.
    fn is_bare(&self) -> bool {
        let Self { label, tried, removed, models, photos, marks, searched, .. } = self;
        let is_set = matches!(searched, Some(Searched::Part(_)));
        let has_files = photos.len() > 1 || !(tried.is_empty() && removed.is_empty() && marks.is_empty());
        label.is_none() && models.is_empty() && !has_files && !is_set
    }

    /// Writes the file. For a photo without any work on it, no file is written.
    ///
    /// # Errors
    /// The folder cannot be written to.
    pub fn write(&self, place: &ProjectPlace) -> Result<()> {
        let path = &place.file;
        if !place.is_folder && self.is_bare() && !path.exists() {
            return Ok(());
        }
        let text = serde_json::to_vec_pretty(self)
            .map_err(|error| Error::Project { path: path.clone(), found: error.to_string() })?;
        Ok(write_atomically(path, &text)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::RgbImage;

    fn open(folder: &Path) -> (ProjectFile, Vec<String>) {
        let (file, gone) = ProjectFile::open(&ProjectPlace::of_folder(folder), PixelFrame::Upright).unwrap();
        let tried = gone.tried.into_iter().map(|tried| tried.file);
        (file, gone.photos.into_iter().chain(tried).collect())
    }

    const MARKED: &str = r#"{"imageWidth": 60, "imageHeight": 40, "shapes": [
            {"label": "bar", "shape_type": "rectangle", "points": [[10, 10], [30, 20]]}]}"#;

    #[test]
    fn pictures_of_a_new_folder_are_sorted_by_their_marks() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["a.png", "b.png", "c.png"] {
            RgbImage::new(60, 40).save(at(name)).unwrap();
        }
        // Without marks, the user chooses.
        let (file, gone) = open(folder.path());
        assert_eq!((file.photos.len(), file.tried.len(), gone.len()), (0, 0, 0));
        assert_eq!(file.removed.len(), 3);
        fs::write(at("b.json"), MARKED).unwrap();
        let (mut file, _) = open(folder.path());
        assert_eq!(file.photos, ["b.png"]);
        assert_eq!(file.tried.iter().map(|tried| tried.file.as_str()).collect::<Vec<_>>(), ["a.png", "c.png"]);

        file.tried.remove(0);
        file.removed.insert("a.png".into());
        file.tried[0].absent = true;
        file.write(&ProjectPlace::of_folder(folder.path())).unwrap();
        RgbImage::new(60, 40).save(at("d.png")).unwrap();
        fs::remove_file(at("b.png")).unwrap();
        let (again, gone) = open(folder.path());
        assert_eq!(gone, ["b.png"]);
        // Removed pictures stay removed, and no picture takes the place of a missing photo.
        assert_eq!((again.photos.len(), again.tried.len(), &again.tried[0]), (0, 2, &file.tried[0]));
    }

    #[test]
    fn a_picture_of_the_folder_is_listed_once_however_its_path_was_spelled() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.png", "b.png"] {
            RgbImage::new(60, 40).save(folder.path().join(name)).unwrap();
        }
        let absolute = folder.path().join("a.png").display().to_string();
        let tried = |file: &str| Tried { file: file.to_owned(), name: file.to_owned(), absent: false, became: None };
        let photos = vec!["./a.png".to_owned(), absolute];
        let file = ProjectFile { photos, tried: vec![tried("a.png"), tried("./b.png")], ..ProjectFile::default() };
        file.write(&ProjectPlace::of_folder(folder.path())).unwrap();
        let (file, _) = open(folder.path());
        assert_eq!(
            (file.photos, &file.tried[0].file, file.tried.len()),
            (vec!["a.png".to_owned()], &"b.png".to_owned(), 1)
        );
    }

    #[test]
    fn a_photo_has_a_project_of_its_own_unless_the_folder_names_it() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["a.png", "b.png"] {
            RgbImage::new(60, 40).save(at(name)).unwrap();
        }
        let place = ProjectPlace::of_photo(&at("a.png")).unwrap();
        assert_eq!(place.file, at("a.sdg-project.json"));
        // No other file of the folder is added, and a photo alone needs no project's file.
        let open = |place: &ProjectPlace| ProjectFile::open(place, PixelFrame::Upright).unwrap().0;
        assert_eq!(open(&place), ProjectFile::default());
        let bare = ProjectFile { photos: vec!["a.png".into()], ..ProjectFile::default() };
        bare.write(&place).unwrap();
        assert!(!place.file.exists());
        let named = ProjectFile { label: Some("rod".into()), ..bare };
        named.write(&place).unwrap();
        assert_eq!(open(&place), named);

        let whole = ProjectFile { photos: vec!["b.png".into()], ..ProjectFile::default() };
        whole.write(&ProjectPlace::of_folder(folder.path())).unwrap();
        let place = ProjectPlace::of_photo(&at("b.png")).unwrap();
        assert_eq!((place.file.clone(), open(&place)), (at(PROJECT_FILE), whole));
        assert_eq!(ProjectPlace::of_photo(&at("a.png")).unwrap().file, at("a.sdg-project.json"));
    }

    #[test]
    fn a_project_is_compared_by_its_absolute_path() {
        let here = std::env::current_dir().unwrap();
        let photo = ProjectPlace::of_photo(Path::new("photo.png")).unwrap();
        assert_eq!(photo.shown(), here.join("photo.sdg-project.json").display().to_string());
        for folder in ["rod", "rod/", "./rod"] {
            let place = ProjectPlace::of_folder(Path::new(folder));
            assert_eq!(place.shown(), here.join("rod").display().to_string(), "{folder}");
        }
    }

    #[test]
    fn another_file_is_no_project() {
        let folder = tempfile::tempdir().unwrap();
        for (text, found) in [
            ("[]", "sdg-project.json"),
            ("{", "sdg-project.json"),
            (r#"{"format": 7, "photos": [], "tried": [], "removed": [], "models": []}"#, "format 7"),
        ] {
            fs::write(folder.path().join(PROJECT_FILE), text).unwrap();
            let place = ProjectPlace::of_folder(folder.path());
            let error = ProjectFile::open(&place, PixelFrame::Upright).unwrap_err().to_string();
            assert!(error.contains(found), "{error}");
        }
    }
}
