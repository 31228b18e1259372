//! A session of the page: the given pictures, their marks, and the tried pictures.
//!
//! Requests name pictures by their index in a list of the session. The page never sends a path.

mod folder;
mod models;
mod opening;
mod tried;

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use sdg_demonstration::{Demonstration, PixelFrame};
use sdg_files::WriterLock;
use tempfile::TempDir;

use crate::error::{Error, Result};
use crate::live::{LiveDesk, LiveOptions};
use crate::marks::Marks;
use crate::names::{file_name, free_numbered_except, safe_stem};
use crate::picture::{Picture, png};
use crate::preview::{Previews, SampleKey};
use crate::project_file::{ProjectPlace, versions_in};
use crate::session_state::State;
use crate::teacher::GraspTeacher;
use crate::teaching::Teaching;
use crate::views::{ImageView, Saved, SessionView};

/// Maximum length of an object's name.
const MAX_LABEL_CHARS: usize = 80;

/// The inputs of a session.
#[derive(Debug, Clone, Default)]
pub struct SessionOptions {
    /// Pictures of one object, each with the file of its marks if that file is not named after the picture.
    pub images: Vec<(PathBuf, Option<PathBuf>)>,
    /// Pictures, or folders of pictures, to try a taught model on.
    pub trial_pictures: Vec<PathBuf>,
    /// File for a taught model; default: beside the first picture, named after the object.
    pub model_path: Option<PathBuf>,
    /// A camera for taking pictures; with one, `images` may be empty.
    pub live: Option<LiveOptions>,
    /// The folder of a project; `images` are then empty. Without a folder, the project of the first image is used.
    /// The project is opened in its last state.
    pub project: Option<PathBuf>,
    /// The page's token, for a server that the same page must find again; `None` for a new one.
    pub token: Option<String>,
    /// The hand's maximum opening in pixels of a photo, in the part's plane; `None` without a camera's calibration.
    pub max_opening_px: Option<f64>,
    /// Orientation of the pixels of all pictures: the sensor's with a camera's calibration.
    pub pixel_frame: PixelFrame,
    /// Width and height of photos; `None` without a camera's calibration.
    pub photo_size: Option<[u32; 2]>,
    /// Heights of the marks and of the grasp above the table, in metres; `None` without a camera's calibration.
    pub heights_m: Option<[f64; 2]>,
}

fn locked(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The file of the model in use, named after the part, beside `home`.
fn model_file(home: &Path, label: &str) -> PathBuf {
    home.with_file_name(format!("{}.sdg", safe_stem(label)))
}

/// The given file of the model in use, or [`model_file`], with a number if another project uses that.
///
/// # Errors
/// A file of that name cannot be read.
fn model_path(given: Option<&Path>, home: &Path, state: &State) -> Result<PathBuf> {
    match given {
        Some(path) => Ok(path.to_owned()),
        None => {
            let all = || versions_in(&state.models.project());
            state.models.own_path(&model_file(home, &state.label), all)
        }
    }
}

/// The name of a part without surrounding spaces.
///
/// # Errors
/// The name is empty, too long, or contains control characters.
pub(crate) fn check_label(label: &str) -> Result<&str> {
    let label = label.trim();
    let count = label.chars().count();
    if count == 0 || count > MAX_LABEL_CHARS || label.chars().any(char::is_control) {
        return Err(Error::Request {
            what: "name",
            expected: format!("1 to {MAX_LABEL_CHARS} letters"),
            found: if count > MAX_LABEL_CHARS { format!("{count}") } else { format!("{label:?}") },
        });
    }
    Ok(label)
}

/// A session of the page.
///
/// The session calls teaching and previews, which never call the session. While the lock on `state` is held, only the
/// locks on `locks` and those of the teaching are taken, never the reverse.
pub struct Session {
    teacher: Arc<dyn GraspTeacher>,
    teaching: Arc<Teaching>,
    previews: Previews,
    model_path: Option<PathBuf>,
    /// The user's files are written beside this path: the first picture, or the first photo to be taken.
    home: PathBuf,
    /// Orientation of the pixels of all pictures.
    pixel_frame: PixelFrame,
    live: Option<LiveDesk>,
    /// Names in the project of the camera's folder. A new photo does not get the name of a missing one, whose project
    /// would be written over.
    taken_names: Vec<String>,
    /// Folder for pictures added on the page before there is a photo.
    temporary: Option<TempDir>,
    /// Locks that keep other programs from writing the same files.
    locks: Mutex<Vec<WriterLock>>,
    state: Arc<Mutex<State>>,
    /// Number of the photo that was opened.
    shown: usize,
    id: String,
    token: Option<String>,
    notes: Vec<String>,
}

impl Session {
    /// The page's token, if one was given.
    pub(crate) fn token(&self) -> Option<&str> {
        self.token.as_deref()
    }

    /// Identifier of the session; picture numbers are valid within it.
    pub(crate) fn id(&self) -> &str {
        &self.id
    }

    /// Keeps locks for the lifetime of the session, or until the project is closed.
    pub fn holding(self, locks: Vec<WriterLock>) -> Self {
        self.locks().extend(locks);
        self
    }

    /// Locks the marks of a photo against other processes before they are written, unless this session has locked them.
    /// Returns whether another process has changed them since they were read without the lock; they are then read
    /// again.
    ///
    /// # Errors
    /// Another process has locked the file, too many files are open, or changed marks cannot be read.
    fn lock_marks(&self, state: &mut State, photo: &Path) -> Result<bool> {
        let file = state.marks_file(photo).unwrap_or_else(|| photo.with_extension("json"));
        let id = state.image_at(photo);
        if self.locks().iter().any(|lock| lock.is_of(&file)) {
            let unlocked = id.filter(|&id| state.images[id].is_read_unlocked);
            return unlocked.map_or(Ok(false), |id| state.read_again(id));
        }
        let Some(lock) = WriterLock::take(&file)? else { return Ok(false) };
        let is_changed = id.map_or(Ok(false), |id| state.read_again(id))?;
        for other in (0..state.images.len()).filter(|&other| Some(other) != id) {
            let is_of_file = state.marks_file(&state.images[other].picture.path).as_ref() == Some(&file);
            state.images[other].is_read_unlocked |= is_of_file;
        }
        self.locks().push(lock);
        Ok(is_changed)
    }

    fn locks(&self) -> MutexGuard<'_, Vec<WriterLock>> {
        self.locks.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Closes the project and releases its locks: the session may remain in use by a running search, and the same
    /// project can be opened again at once.
    ///
    /// # Errors
    /// A teaching is running.
    pub(crate) fn close(&self) -> Result<()> {
        self.teaching.close()?;
        self.locks().clear();
        Ok(())
    }

    fn state(&self) -> MutexGuard<'_, State> {
        locked(&self.state)
    }

    /// The data with which the page starts.
    pub fn view(&self) -> SessionView {
        let mut state = self.state();
        let others = state.others();
        SessionView {
            id: self.id.clone(),
            label: state.label.clone(),
            is_named: state.is_named,
            others,
            images: state.image_ids().map(|id| state.image_view(id)).collect(),
            shown: state.image_ids().position(|id| id == self.shown).unwrap_or(0),
            trial_pictures: state.trial_ids().map(|id| state.trial_picture_view(id)).collect(),
            models: state.model_views(),
            region: state.region,
            is_calibrated: state.max_opening_px.is_some(),
            project: state.place.as_ref().map(ProjectPlace::shown),
            can_close: false,
            notes: self.notes.clone(),
            camera: self.live.as_ref().map(|desk| desk.options.address.clone()),
        }
    }

    /// A picture of the object, for the page.
    ///
    /// # Errors
    /// Unknown picture.
    pub(crate) fn image_view(&self, id: usize) -> Result<ImageView> {
        let state = self.state();
        state.image(id)?;
        Ok(state.image_view(id))
    }

    /// Stores new marks of a picture, and writes them to the file if they are valid.
    ///
    /// # Errors
    /// Unknown picture, or another process has locked its marks. [`Error::MarksChanged`] if another process has changed
    /// them: [`Self::image_view`] then has the marks of the file.
    pub fn set_marks(&self, id: usize, marks: Marks) -> Result<ImageView> {
        let mut state = self.state();
        state.image(id)?;
        if self.lock_marks_of(&mut state, id)? {
            return Err(Error::MarksChanged);
        }
        state.images[id].marks = marks;
        state.save(id);
        Ok(state.image_view(id))
    }

    /// Renames the object, also in all files already written. The model in use is also written under the new name,
    /// unless another file has that name.
    ///
    /// # Errors
    /// The name is empty, too long or contains control characters, the model or the project cannot be written, or
    /// another process has locked the marks of a photo; then no file has the new name.
    pub fn set_label(&self, label: &str) -> Result<SessionView> {
        let label = check_label(label)?;
        let mut state = self.state();
        let is_written = |id: &usize| matches!(state.images[*id].saved, Saved::Written { .. });
        let ids: Vec<usize> = state.image_ids().filter(is_written).collect();
        // The locks of all photos of a large project would be more files than a process can open.
        let num_locks = self.locks().len();
        for &id in &ids {
            self.lock_marks_of(&mut state, id)?;
            self.locks().truncate(num_locks);
        }
        if self.model_path.is_none() && !state.is_model_lost {
            state.models.write_current(&model_file(&self.home, label))?;
        }
        label.clone_into(&mut state.label);
        state.is_named = true;
        state.save_project()?;
        for id in ids {
            self.lock_marks_of(&mut state, id)?;
            state.save(id);
            self.locks().truncate(num_locks);
        }
        drop(state);
        Ok(self.view())
    }

    fn lock_marks_of(&self, state: &mut State, id: usize) -> Result<bool> {
        let photo = state.images[id].picture.path.clone();
        self.lock_marks(state, &photo)
    }

    /// A marked picture's file.
    ///
    /// # Errors
    /// Unknown picture.
    pub fn picture(&self, id: usize) -> Result<Picture> {
        Ok(self.state().image(id)?.picture.clone())
    }

    /// The marks on a picture.
    ///
    /// # Errors
    /// Unknown picture.
    pub fn marks(&self, id: usize) -> Result<Marks> {
        Ok(self.state().image(id)?.marks.clone())
    }

    /// Removes a photo from the session. Its file and its marks are kept.
    ///
    /// # Errors
    /// Unknown picture, or the project cannot be written.
    pub fn remove_image(&self, id: usize) -> Result<()> {
        let mut state = self.state();
        state.image(id)?;
        state.images[id].is_removed = true;
        state.save_project()
    }

    /// Restores a photo that was removed in this session. A tried picture from which it was made becomes a
    /// demonstration again.
    ///
    /// # Errors
    /// Unknown picture, its marks' file belongs to another photo now, or the project cannot be written.
    pub fn put_back_image(&self, id: usize) -> Result<()> {
        let mut state = self.state();
        let count = state.images.len();
        state.images.get(id).ok_or(Error::NoSuchPicture { id, count })?.check_file(state.photos())?;
        state.images[id].is_removed = false;
        state.trial_pictures.iter_mut().filter(|trial| trial.became == Some(id)).for_each(|t| t.is_absent = false);
        state.save_project()
    }

    /// The camera.
    ///
    /// # Errors
    /// [`Error::NoCamera`].
    pub(crate) fn live_desk(&self) -> Result<&LiveDesk> {
        self.live.as_ref().ok_or(Error::NoCamera)
    }

    /// Path of the next photo.
    ///
    /// # Errors
    /// [`Error::NoCamera`].
    pub(crate) fn next_photo(&self) -> Result<PathBuf> {
        Ok(free_numbered_except(&self.live_desk()?.options.photo_path, &self.taken_names))
    }

    /// Writes a shown frame as PNG, under an unused name, and makes it a photo of the object.
    ///
    /// # Errors
    /// No camera, or a camera with a fault that makes its picture unusable; the frame is no longer kept; the file
    /// cannot be written.
    pub fn take_photo(&self, number: u64) -> Result<ImageView> {
        let frame = self.live_desk()?.photo(number)?;
        let bytes = png(&frame)?;
        // The lock is held until the photo is written, so that the next photo gets another name.
        let mut state = self.state();
        let path = self.next_photo()?;
        sdg_files::write_atomically(&path, &bytes)?;
        let size = [frame.width(), frame.height()];
        let picture = Picture { name: file_name(&path), path, size, frame: self.pixel_frame };
        let id = state.add_image(picture, Marks::default())?;
        self.settle_place(&mut state, id)?;
        state.save_project()?;
        Ok(state.image_view(id))
    }

    /// A picture with its marks, in the form for teaching.
    ///
    /// # Errors
    /// Unknown picture, no marks, or marks unsuitable for teaching.
    pub fn demonstration(&self, id: usize) -> Result<Demonstration> {
        let (label, marked) = {
            let state = self.state();
            (state.label.clone(), state.image(id)?.clone())
        };
        marked.demonstration(&label)
    }

    /// Sample `index` of `seed` of a marked picture as JPEG, with the transformed grasp drawn on it.
    ///
    /// # Errors
    /// Unknown picture, or marks unsuitable for teaching.
    pub fn sample(&self, id: usize, seed: u64, index: u64) -> Result<Vec<u8>> {
        let (label, marked) = {
            let state = self.state();
            (state.label.clone(), state.image(id)?.clone())
        };
        let key = SampleKey { image_id: id, marks: marked.marks.clone(), seed };
        self.previews.sample(key, || marked.demonstration(&label), index)
    }
}
