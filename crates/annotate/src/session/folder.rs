//! The other pictures of a project's folder, which the user can add, and photos added on the page.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use sdg_files::absolute;

use super::Session;
use crate::error::{Error, Result};
use crate::names::{file_name, free_name, relative};
use crate::picture::{Picture, pictures_in};
use crate::session_state::{MarkedPicture, State, TrialPicture};
use crate::views::{ImageView, OtherView, TrialPictureView};

/// Maximum number of offered pictures: a folder with a year's photos is not a part's folder.
const MAX_OFFERED: usize = 500;

impl State {
    /// The pictures of the project's folder that are not in the project. Their numbers are fixed for the session.
    pub fn others(&mut self) -> Vec<OtherView> {
        let Some(place) = &self.place else { return Vec::new() };
        let known = self.known_paths();
        // A folder that cannot be listed offers nothing; the error is reported when it is written to.
        for path in pictures_in(&absolute(&place.folder)).unwrap_or_default() {
            let path = place.folder.join(path.file_name().unwrap_or_default());
            if self.offered.len() < MAX_OFFERED && !self.offered.contains(&path) && is_other(&known, &path) {
                self.offered.push(path);
            }
        }
        let view = |(id, path): (usize, &PathBuf)| {
            let name = file_name(path);
            let is_tried = self.is_tried_copy(path, &name);
            OtherView { id, name, is_tried }
        };
        self.offered.iter().enumerate().filter(|(_, path)| is_other(&known, path)).map(view).collect()
    }

    /// The absolute paths of the session's pictures.
    fn known_paths(&self) -> BTreeSet<PathBuf> {
        let photos = self.photos().map(|image| &image.picture);
        let tried = self.trial_ids().map(|id| &self.trial_pictures[id].picture);
        photos.chain(tried).map(|picture| absolute(&picture.path)).collect()
    }

    /// Whether this file is a copy of a picture to try. A picture from elsewhere is copied into the folder when it
    /// becomes a demonstration; the copy stays when the demonstration is removed. In later sessions, the copy is
    /// recognised only by its name and content.
    fn is_tried_copy(&self, path: &Path, name: &str) -> bool {
        self.trial_ids().map(|id| &self.trial_pictures[id]).any(|trial| {
            let is_copied = trial.became.is_some_and(|id| self.images[id].picture.is_at(path));
            is_copied || (trial.picture.name == name && is_same_file(&trial.picture.path, path))
        })
    }

    fn other(&self, id: usize) -> Result<&Path> {
        let there = self.offered.get(id).filter(|path| is_other(&self.known_paths(), path));
        there.map(PathBuf::as_path).ok_or(Error::NoSuchPicture { id, count: self.offered.len() })
    }
}

/// Whether a file exists and is not among the session's pictures, which are known by their absolute paths.
fn is_other(known: &BTreeSet<PathBuf>, path: &Path) -> bool {
    !known.contains(&absolute(path)) && path.is_file()
}

/// Whether two files can be read and have the same content.
fn is_same_file(one: &Path, other: &Path) -> bool {
    let size = |path: &Path| std::fs::metadata(path).map(|metadata| metadata.len());
    let is_same_size = size(one).is_ok_and(|found| size(other).is_ok_and(|expected| found == expected));
    is_same_size && std::fs::read(one).is_ok_and(|one| std::fs::read(other).is_ok_and(|other| one == other))
}

impl Session {
    /// The number of the offered picture with this name and content. A picture of the folder that is dropped on the
    /// page is thus used without a copy.
    pub(super) fn same_other(&self, name: &str, bytes: &[u8]) -> Option<usize> {
        let mut state = self.state();
        let other = state.others().into_iter().find(|other| other.name == name)?;
        std::fs::read(&state.offered[other.id]).is_ok_and(|content| content == bytes).then_some(other.id)
    }

    /// Another picture of the folder.
    ///
    /// # Errors
    /// Unknown picture, or not a picture file.
    pub(crate) fn other_picture(&self, id: usize) -> Result<Picture> {
        let path = self.state().other(id)?.to_owned();
        Picture::open(&path, self.pixel_frame)
    }

    /// Makes another picture of the folder a photo of the part, with the marks beside it.
    ///
    /// # Errors
    /// Unknown picture, marks of another picture or in another photo's file, a photo of a calibrated camera that an
    /// Exif orientation rotates, or the project cannot be written.
    pub fn add_photo(&self, id: usize) -> Result<ImageView> {
        let mut state = self.state();
        let path = state.other(id)?.to_owned();
        // A photo that was removed and is added again keeps its number.
        let id = match state.image_at(&path) {
            Some(id) => {
                state.images[id].check_file(state.photos())?;
                state.images[id].is_removed = false;
                id
            }
            None => {
                let (image, label) = state.open_photo(Picture::open(&path, self.pixel_frame)?)?;
                image.check_file(state.photos())?;
                if let Some(label) = label.filter(|_| !state.is_named) {
                    (state.label, state.is_named) = (label, true);
                }
                state.images.push(image);
                state.images.len() - 1
            }
        };
        // A missing photo that was made from a tried picture has come back.
        let name = state.place.as_ref().map(|place| relative(&place.folder, &path));
        for trial in &mut state.trial_pictures {
            if name.is_some() && trial.missing_photo == name {
                (trial.became, trial.missing_photo) = (Some(id), None);
            }
        }
        // The picture, or the tried one from which it was made, may have been declared to be without the part.
        let is_same = |trial: &TrialPicture| trial.became == Some(id) || trial.picture.is_at(&path);
        state.trial_pictures.iter_mut().filter(|trial| is_same(trial)).for_each(|trial| trial.is_absent = false);
        state.save_project()?;
        Ok(state.image_view(id))
    }

    /// Makes another picture of the folder a picture to try.
    ///
    /// # Errors
    /// Unknown picture, more pictures than a session keeps, or the project cannot be written.
    pub fn add_other_trial(&self, id: usize) -> Result<TrialPictureView> {
        let mut state = self.state();
        let path = state.other(id)?.to_owned();
        state.check_room()?;
        let known = state.trial_pictures.iter().position(|trial| trial.picture.is_at(&path));
        let id = match known {
            Some(id) => {
                state.trial_pictures[id].is_removed = false;
                id
            }
            None => {
                state.trial_pictures.push(TrialPicture::new(Picture::open(&path, self.pixel_frame)?, false));
                state.trial_pictures.len() - 1
            }
        };
        state.save_project()?;
        Ok(state.trial_picture_view(id))
    }

    /// Adds a photo of the part from the page; it is written beside the first photo under an unused name, unless it
    /// lies there already.
    ///
    /// # Errors
    /// The bytes are not a picture, an Exif orientation rotates a photo of a calibrated camera or it has another size,
    /// or the file cannot be written.
    pub fn upload_photo(&self, name: &str, bytes: &[u8]) -> Result<ImageView> {
        let shown = name.rsplit(['/', '\\']).next().unwrap_or(name);
        let size = self.state().photo_size;
        Picture::check_photo(bytes, shown, self.pixel_frame, size)?;
        if let Some(id) = self.same_other(shown, bytes) {
            return self.add_photo(id);
        }
        let extension = Path::new(shown).extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let mut state = self.state();
        let path = free_name(&self.home, shown, if extension.is_empty() { "png" } else { &extension });
        sdg_files::write_atomically(&path, bytes)?;
        let (image, _) = MarkedPicture::of(Picture::open(&path, self.pixel_frame)?, None)?;
        state.images.push(image);
        let id = state.images.len() - 1;
        self.settle_place(&mut state, id)?;
        state.save_project()?;
        Ok(state.image_view(id))
    }
}
