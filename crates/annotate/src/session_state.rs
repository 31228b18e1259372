//! The state of a session: the object's name, its pictures with their marks, and the pictures to try.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use sdg_demonstration::{Annotation, Demonstration, ImageFacts, ModelKind};
use sdg_files::is_same_path;
use serde::Serialize;
use serde_json::Value;

use crate::advice::advise;
use crate::annotation_file;
use crate::error::{Error, Result};
use crate::marks::Marks;
use crate::model_versions::{ModelVersions, Version, fingerprint};
use crate::names::{file_name, relative};
use crate::picture::Picture;
use crate::project_file::{Gone, ProjectFile, ProjectPlace, Tried};
use crate::region::{Region, Searched};
use crate::views::{ImageView, ModelView, Saved, TrialPictureView};

/// The note on a picture that keeps the marks that it had before it was added.
const MARKS_KEPT: &str = "This picture was marked before; these marks are kept.";

/// The current label, the object's pictures and the pictures to try, numbered by index; removed ones keep their
/// numbers. Also the versions of the model.
pub struct State {
    pub label: String,
    /// Whether the label was given by the user or by existing marks; otherwise it is a proposal.
    pub is_named: bool,
    pub images: Vec<MarkedPicture>,
    pub trial_pictures: Vec<TrialPicture>,
    pub models: ModelVersions,
    /// Location of the project; `None` for a camera before its first photo.
    pub place: Option<ProjectPlace>,
    /// Names of pictures of the project's folder that were removed in earlier sessions.
    pub removed_earlier: BTreeSet<String>,
    /// Missing files named in the project's file; they may reappear.
    pub gone: Gone,
    /// Files of marks that are not named after their photos, as [`ProjectFile::marks`].
    pub marks_files: BTreeMap<String, String>,
    /// Pictures of the project's folder that were offered, in the order of their first listing: [`State::others`].
    pub offered: Vec<PathBuf>,
    /// The hand's maximum opening in pixels, if a calibrated camera gives it.
    pub max_opening_px: Option<f64>,
    /// Width and height of photos, if a calibrated camera gives them.
    pub photo_size: Option<[u32; 2]>,
    /// Heights of the marks and of the grasp above the table, in metres, if the camera is calibrated.
    pub heights_m: Option<[f64; 2]>,
    /// The region searched by the model in use, and by the next one.
    pub region: Option<Region>,
    /// The file of the model in use cannot be read.
    pub is_model_lost: bool,
}

/// A picture of the object, and its marks.
#[derive(Clone)]
pub struct MarkedPicture {
    pub picture: Picture,
    pub marks: Marks,
    pub file: PathBuf,
    pub note: Option<String>,
    pub saved: Saved,
    /// Whether a file had marks of it when it was opened.
    pub was_marked: bool,
    /// Its marks were read before their file was locked to write those of another photo in the same file.
    pub is_read_unlocked: bool,
    pub is_removed: bool,
}

/// A picture that a taught model is tried on.
#[derive(Clone)]
pub struct TrialPicture {
    pub picture: Picture,
    pub uploaded: bool,
    /// The number of the marked picture that it became, which may have been removed since: [`State::became`].
    pub became: Option<usize>,
    /// The photo's name in the project's file, if the photo is missing now.
    pub missing_photo: Option<String>,
    /// The user stated that the part is not there.
    pub is_absent: bool,
    pub is_removed: bool,
}

impl TrialPicture {
    /// A picture without statements of the user.
    pub fn new(picture: Picture, uploaded: bool) -> Self {
        Self { picture, uploaded, became: None, missing_photo: None, is_absent: false, is_removed: false }
    }
}

impl State {
    pub fn image(&self, id: usize) -> Result<&MarkedPicture> {
        let there = self.images.get(id).filter(|image| !image.is_removed);
        there.ok_or(Error::NoSuchPicture { id, count: self.images.len() })
    }

    pub fn trial_picture(&self, id: usize) -> Result<&TrialPicture> {
        let there = self.trial_pictures.get(id).filter(|trial| !trial.is_removed);
        there.ok_or(Error::NoSuchPicture { id, count: self.trial_pictures.len() })
    }

    /// The marked picture that a tried one became, unless it was removed.
    pub fn became(&self, trial_id: usize) -> Option<usize> {
        self.trial_pictures[trial_id].became.filter(|&id| !self.images[id].is_removed)
    }

    /// Adds a picture, or restores it if it was removed, and returns its number. Marks that it has already are kept:
    /// the given ones are used only if there are none, or if only the given ones have a grasp, and are not saved yet.
    ///
    /// # Errors
    /// The picture is a photo already, the file beside it contains no marks of it or belongs to another photo, or an
    /// Exif orientation rotates a photo of a calibrated camera or it has another size.
    pub fn add_image(&mut self, picture: Picture, marks: Marks) -> Result<usize> {
        let known = self.image_at(&picture.path);
        let mut image = match known.map(|id| &self.images[id]) {
            Some(image) if !image.is_removed => {
                return Err(Error::Busy("this picture is a demonstration already"));
            }
            Some(removed) => MarkedPicture { is_removed: false, ..removed.clone() },
            None => self.open_photo(picture)?.0,
        };
        image.check_file(self.photos())?;
        if image.marks.has_object() && (image.marks.grasp.is_some() || marks.grasp.is_none()) {
            let note = image.note.get_or_insert_default();
            if !note.starts_with(MARKS_KEPT) {
                *note = format!("{MARKS_KEPT} {note}").trim_end().to_owned();
            }
        } else {
            (image.marks, image.saved) = (marks, Saved::Nothing);
        }
        let Some(id) = known else {
            self.images.push(image);
            return Ok(self.images.len() - 1);
        };
        self.images[id] = image;
        Ok(id)
    }

    /// Opens a photo with its marks, which may be in a file that the project names; also gives the object's name in
    /// that file.
    ///
    /// # Errors
    /// As [`MarkedPicture::of`], or a photo of a calibrated camera has another size.
    pub fn open_photo(&self, picture: Picture) -> Result<(MarkedPicture, Option<String>)> {
        picture.check_size(self.photo_size)?;
        let file = self.marks_file(&picture.path);
        MarkedPicture::of(picture, file.as_deref())
    }

    /// The file of a photo's marks that is not named after the photo.
    pub fn marks_file(&self, photo: &Path) -> Option<PathBuf> {
        let folder = &self.place.as_ref()?.folder;
        self.marks_files.get(&relative(folder, photo)).map(|file| folder.join(file))
    }

    /// The number of the photo with this path, which may have been removed.
    pub fn image_at(&self, path: &Path) -> Option<usize> {
        self.images.iter().position(|image| image.picture.is_at(path))
    }

    /// Reads a photo's marks again and returns whether they differ from the known ones, which they then replace. Marks
    /// that could not be written are kept.
    ///
    /// # Errors
    /// As [`MarkedPicture::of`].
    pub fn read_again(&mut self, id: usize) -> Result<bool> {
        let known = &self.images[id];
        let (now, _) = self.open_photo(known.picture.clone())?;
        let is_kept = matches!(known.saved, Saved::Refused { .. }) || rounded(&now.marks) == rounded(&known.marks);
        if is_kept {
            self.images[id].is_read_unlocked = false;
        } else {
            self.images[id] = MarkedPicture { is_removed: known.is_removed, ..now };
        }
        Ok(!is_kept)
    }

    pub fn save(&mut self, id: usize) {
        let MarkedPicture { picture, marks, file, was_marked, .. } = &self.images[id];
        let written = annotation_file::save(file, marks, &self.label, &picture.name, picture.size, *was_marked);
        self.images[id].saved = match written {
            Ok(true) => Saved::Written { file: file_name(&self.images[id].file) },
            Ok(false) => Saved::Nothing,
            Err(error) => {
                let by_disk = matches!(error, Error::Write(_) | Error::File { .. });
                Saved::Refused { why: error.to_string(), by_disk }
            }
        };
    }

    pub fn image_view(&self, id: usize) -> ImageView {
        let MarkedPicture { picture, marks, note, saved, .. } = &self.images[id];
        let Picture { name, size: [width, height], .. } = picture.clone();
        let advice = advise(marks, picture.size, self.max_opening_px);
        ImageView { id, name, width, height, marks: marks.clone(), saved: saved.clone(), advice, note: note.clone() }
    }

    pub fn trial_picture_view(&self, id: usize) -> TrialPictureView {
        let TrialPicture { picture, is_absent, .. } = &self.trial_pictures[id];
        let Picture { name, size: [width, height], .. } = picture.clone();
        TrialPictureView { id, name, width, height, became: self.became(id), is_absent: *is_absent }
    }

    /// Numbers of the object's pictures that are not removed.
    pub fn image_ids(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.images.len()).filter(|&id| !self.images[id].is_removed)
    }

    /// The object's pictures that are not removed.
    pub fn photos(&self) -> impl Iterator<Item = &MarkedPicture> + '_ {
        self.image_ids().map(|id| &self.images[id])
    }

    /// Numbers of the pictures to try that are not removed.
    pub fn trial_ids(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.trial_pictures.len()).filter(|&id| !self.trial_pictures[id].is_removed)
    }

    /// The photos for teaching `model`. Pictures without any mark are left out.
    ///
    /// # Errors
    /// No picture is marked, or a picture has marks but lacks some that `model` needs.
    pub fn demonstrated(&self, model: ModelKind) -> Result<Vec<MarkedPicture>> {
        let marked: Vec<_> = self.photos().filter(|image| image.marks != Marks::default()).cloned().collect();
        if marked.is_empty() {
            let first = self.photos().next();
            let name = first.map_or_else(|| "no photo yet".to_owned(), |image| image.picture.name.clone());
            return Err(Error::NotMarked { name, expected: "a box and a grasp", found: "no marks" });
        }
        for MarkedPicture { picture, marks, .. } in &marked {
            let advice = advise(marks, picture.size, self.max_opening_px);
            let lacks = advice.models.iter().find(|advice| advice.model == model).map(|advice| &advice.lacks);
            if let Some(&missing) = lacks.and_then(|lacks| lacks.first()) {
                return Err(Error::NotMarked { name: picture.name.clone(), expected: missing, found: "none" });
            }
        }
        Ok(marked)
    }

    /// Pictures without the part.
    pub fn negatives(&self) -> impl Iterator<Item = &Picture> + '_ {
        self.trial_ids().map(|id| &self.trial_pictures[id]).filter(|trial| trial.is_absent).map(|trial| &trial.picture)
    }

    /// [`fingerprint`] of the inputs that a teaching would have now. Pictures are named as in the project's file, so
    /// that it does not depend on the folder's path. Coordinates are [`rounded`].
    pub fn material(&self) -> String {
        // Without a project there is neither a photo nor a model.
        let folder = self.place.as_ref().map_or(Path::new(""), |place| &place.folder);
        let name = |picture: &Picture| relative(folder, &picture.path);
        let marked = self.photos().filter(|image| image.marks != Marks::default());
        let marked: Vec<_> = marked.map(|image| (name(&image.picture), &image.marks)).collect();
        let negatives: Vec<_> = self.negatives().map(name).collect();
        fingerprint(&rounded(&(marked, negatives)).to_string())
    }

    /// Whether a version was taught with other heights above the table; their last digits may differ after reading.
    fn has_other_heights(&self, version: &Version) -> bool {
        let heights = version.heights_m.zip(self.heights_m);
        heights.is_some_and(|(taught, now)| taught.iter().zip(now).any(|(taught, now)| (taught - now).abs() > 1e-6))
    }

    pub fn model_views(&self) -> Vec<ModelView> {
        let material = self.material();
        let view = |(id, version): (usize, &Version)| ModelView {
            id,
            file: version.file.clone(),
            taught_secs: version.taught_secs,
            summary: version.summary.clone(),
            photos: version.photos,
            negatives: version.negatives,
            is_current: self.models.current == Some(id) && !self.is_model_lost,
            is_stale: version.material != material || self.has_other_heights(version),
            symmetry: version.symmetry,
            fixed_height: version.fixed_height,
        };
        self.models.versions.iter().enumerate().map(view).collect()
    }

    /// Writes the project's file, if the session has a project.
    ///
    /// # Errors
    /// The folder cannot be written to.
    pub fn save_project(&self) -> Result<()> {
        let Some(place) = &self.place else { return Ok(()) };
        let folder = &place.folder;
        let name = |picture: &Picture| relative(folder, &picture.path);
        let mut file = ProjectFile {
            label: self.is_named.then(|| self.label.clone()),
            photos: self.image_ids().map(|id| name(&self.images[id].picture)).collect(),
            removed: self.removed_earlier.clone(),
            models: self.models.versions.clone(),
            current_model: self.models.current,
            marks: self.marks_files.clone(),
            searched: Some(Searched::of(self.region)),
            ..ProjectFile::default()
        };
        for id in self.trial_ids() {
            let trial = &self.trial_pictures[id];
            let became = self.became(id).map(|id| name(&self.images[id].picture));
            file.tried.push(Tried {
                file: name(&trial.picture),
                name: trial.picture.name.clone(),
                absent: trial.is_absent,
                became: became.or_else(|| trial.missing_photo.clone()),
            });
        }
        file.removed.extend(self.images.iter().filter(|i| i.is_removed).map(|i| name(&i.picture)));
        file.removed.extend(self.trial_pictures.iter().filter(|t| t.is_removed).map(|t| name(&t.picture)));
        file.keep_missing(&self.gone);
        // A picture that was removed and added again under the same name is not listed as removed.
        for there in file.photos.iter().chain(file.tried.iter().map(|tried| &tried.file)) {
            file.removed.remove(there);
        }
        file.write(place)
    }
}

/// A value with coordinates rounded to a thousandth of a pixel: after reading from a file their last digits differ.
fn rounded(value: &impl Serialize) -> Value {
    let mut value = serde_json::to_value(value).unwrap_or_default();
    round(&mut value);
    value
}

/// Rounds all numbers to thousandths.
fn round(value: &mut Value) {
    match value {
        Value::Number(number) => {
            // Adding 0 turns −0 into 0.
            let rounded = number.as_f64().map(|number| (1e3 * number).round() / 1e3 + 0.0);
            *value = rounded.map_or(Value::Null, Value::from);
        }
        Value::Array(values) => values.iter_mut().for_each(round),
        Value::Object(fields) => fields.values_mut().for_each(round),
        Value::Null | Value::Bool(_) | Value::String(_) => {}
    }
}

impl MarkedPicture {
    /// A picture with marks that are in no file.
    pub fn unsaved(picture: Picture, marks: Marks) -> Self {
        let (file, saved) = (PathBuf::new(), Saved::Nothing);
        let [was_marked, is_read_unlocked, is_removed] = [false; 3];
        Self { picture, marks, file, note: None, saved, was_marked, is_read_unlocked, is_removed }
    }

    /// A picture with the marks in the file beside it, or in `annotation`, and the object's name in that file.
    ///
    /// # Errors
    /// The marks belong to another picture, or an Exif orientation rotates a photo of a calibrated camera.
    pub fn of(picture: Picture, annotation: Option<&Path>) -> Result<(Self, Option<String>)> {
        picture.check_is_markable()?;
        let opened = annotation_file::open(&picture.path, annotation, picture.size)?;
        // The file that was read, not the file for changes, which may not exist yet.
        let found = opened.found.filter(|_| opened.marks.has_object());
        let was_marked = found.is_some();
        let saved = found.map_or(Saved::Nothing, |path| Saved::Written { file: file_name(&path) });
        let (marks, file, note) = (opened.marks, opened.path, opened.note);
        let [is_read_unlocked, is_removed] = [false; 2];
        Ok((Self { picture, marks, file, note, saved, was_marked, is_read_unlocked, is_removed }, opened.label))
    }

    /// Checks that no other photo has its marks in the same file, as `part.png` and `part.jpg` would.
    ///
    /// # Errors
    /// [`Error::SharedMarks`].
    pub fn check_file<'a>(&self, mut photos: impl Iterator<Item = &'a Self>) -> Result<()> {
        match photos.find(|other| is_same_path(&other.file, &self.file) && !other.picture.is_at(&self.picture.path)) {
            Some(other) => Err(Error::SharedMarks {
                name: self.picture.name.clone(),
                path: self.file.clone(),
                other: other.picture.name.clone(),
            }),
            None => Ok(()),
        }
    }

    /// The picture with its marks, in the form for teaching.
    ///
    /// # Errors
    /// No marks, or marks unsuitable for teaching.
    pub fn demonstration(&self, label: &str) -> Result<Demonstration> {
        let Self { picture, marks, .. } = self;
        let [width, height] = picture.size;
        let facts = ImageFacts { width, height, file_name: Some(&picture.name) };
        let complain = |source| Error::Demonstration { name: picture.name.clone(), source };
        let coco = marks.to_coco(label, &facts).map_err(complain)?;
        let mut objects = Annotation::read(coco.as_bytes(), &facts).map_err(complain)?;
        // Reading rejects a file without an object, so there is one.
        Ok(Demonstration { image: picture.pixels()?, annotation: objects.remove(0) })
    }
}
