//! One session of the page: the pictures given, what is marked on them, and what was tried.
//!
//! Requests name pictures by their index in a list made here. No path comes from the page.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use sdg_demonstration::{Demonstration, ModelKind};
use tempfile::TempDir;

use crate::advice::advise;
use crate::annotation_file;
use crate::error::{Error, Result};
use crate::live::{LiveDesk, LiveOptions};
use crate::marks::Marks;
use crate::names::{file_name, free_name, free_numbered, safe_stem};
use crate::picture::{Picture, pictures_in, png};
use crate::preview::{Previews, SampleKey};
use crate::session_state::{MarkedPicture, State, TrialPicture};
use crate::teacher::{GraspTeacher, TaughtModel, TeachRequest};
use crate::teaching::{News, Teaching};
use crate::views::{ImageView, Saved, SessionView, TrialPictureView};

/// Pictures to try that one session keeps.
const MAX_TRIAL_PICTURES: usize = 500;
/// The longest name of an object.
const MAX_LABEL_CHARS: usize = 80;

/// What the page is opened with.
#[derive(Debug, Clone, Default)]
pub struct SessionOptions {
    /// Pictures of one object, each with the file of its marks if that has another name than the picture's.
    pub images: Vec<(PathBuf, Option<PathBuf>)>,
    /// Pictures, or folders of pictures, to try a taught model on.
    pub trial_pictures: Vec<PathBuf>,
    /// Where a taught model is written; without it, beside the first picture under the object's name.
    pub model_path: Option<PathBuf>,
    /// A camera to take pictures with; with one, `images` may be empty.
    pub live: Option<LiveOptions>,
}

/// One session.
///
/// It calls teaching and previews, and they never call it. No other lock is taken while that of `state` is held.
pub struct Session {
    teacher: Arc<dyn GraspTeacher>,
    teaching: Arc<Teaching>,
    previews: Previews,
    model_path: Option<PathBuf>,
    /// What is written for the person at the page stands beside this: the first picture, or the first photo to be taken.
    home: PathBuf,
    live: Option<LiveDesk>,
    /// Pictures that came from the page, until one is accepted.
    uploads: TempDir,
    state: Mutex<State>,
}

impl Session {
    /// Opens pictures and their marks.
    ///
    /// # Errors
    /// Neither picture nor camera, a picture that cannot be read, or marks that belong to another.
    pub fn open(options: &SessionOptions, teacher: Arc<dyn GraspTeacher>) -> Result<Self> {
        let first = options.images.first().map(|(path, _)| path);
        let home = first.or(options.live.as_ref().map(|live| &live.photo_path)).ok_or(Error::NoImage)?.clone();
        let mut label = None;
        let mut images = Vec::new();
        for (path, annotation) in &options.images {
            let picture = Picture::open(path)?;
            let opened = annotation_file::open(&picture.path, annotation.as_deref(), picture.size)?;
            // Where they stand, not where changes will go: that file may not be there yet.
            let found = opened.found.filter(|_| opened.marks.has_object());
            let saved = found.map_or(Saved::Nothing, |path| Saved::Written { file: file_name(&path) });
            label = label.or(opened.label);
            images.push(MarkedPicture { picture, marks: opened.marks, file: opened.path, note: opened.note, saved });
        }
        let mut trial_pictures = Vec::new();
        for path in &options.trial_pictures {
            let paths = if path.is_dir() { pictures_in(path)? } else { vec![path.clone()] };
            for path in paths {
                let taken = images.iter().any(|image| image.picture.path == path);
                if !taken {
                    trial_pictures.push(TrialPicture { picture: Picture::open(&path)?, uploaded: false, became: None });
                }
            }
        }
        if trial_pictures.len() > MAX_TRIAL_PICTURES {
            return Err(Error::TooManyPictures { most: MAX_TRIAL_PICTURES });
        }
        let uploads = tempfile::Builder::new()
            .prefix("sdg-annotate-")
            .tempdir()
            .map_err(Error::file(&std::env::temp_dir(), "cannot make a folder in it"))?;
        let state = State { label: label.unwrap_or_else(|| "part".to_owned()), images, trial_pictures };
        Ok(Self {
            teacher,
            teaching: Arc::default(),
            previews: Previews::default(),
            model_path: options.model_path.clone(),
            home,
            live: options.live.clone().map(LiveDesk::new),
            uploads,
            state: Mutex::new(state),
        })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// All that the page starts from.
    pub fn view(&self) -> SessionView {
        let state = self.state();
        SessionView {
            label: state.label.clone(),
            images: (0..state.images.len()).map(|id| state.image_view(id)).collect(),
            trial_pictures: (0..state.trial_pictures.len()).map(|id| state.trial_picture_view(id)).collect(),
            model_path: self.model_path(&state).display().to_string(),
            camera: self.live.as_ref().map(|desk| desk.options.address.clone()),
        }
    }

    fn model_path(&self, state: &State) -> PathBuf {
        self.model_path.clone().unwrap_or_else(|| {
            let name = format!("{}.sdg", safe_stem(&state.label));
            self.home.with_file_name(name)
        })
    }

    /// Takes new marks for a picture and writes them, if they are fit to be written; kept they are in any case.
    ///
    /// # Errors
    /// No such picture.
    pub fn set_marks(&self, id: usize, marks: Marks) -> Result<ImageView> {
        let mut state = self.state();
        state.image(id)?;
        state.images[id].marks = marks;
        state.save(id);
        Ok(state.image_view(id))
    }

    /// Renames the object, in every file that is written already.
    ///
    /// # Errors
    /// An empty or endless name.
    pub fn set_label(&self, label: &str) -> Result<SessionView> {
        let label = label.trim();
        let count = label.chars().count();
        if count == 0 || count > MAX_LABEL_CHARS || label.chars().any(char::is_control) {
            return Err(Error::Request {
                what: "name",
                expected: format!("1 to {MAX_LABEL_CHARS} letters"),
                found: if count > MAX_LABEL_CHARS { format!("{count}") } else { format!("{label:?}") },
            });
        }
        let mut state = self.state();
        label.clone_into(&mut state.label);
        for id in 0..state.images.len() {
            if matches!(state.images[id].saved, Saved::Written { .. }) {
                state.save(id);
            }
        }
        drop(state);
        Ok(self.view())
    }

    /// A marked picture's file.
    ///
    /// # Errors
    /// No such picture.
    pub fn picture(&self, id: usize) -> Result<Picture> {
        Ok(self.state().image(id)?.picture.clone())
    }

    /// What is marked on a picture.
    ///
    /// # Errors
    /// No such picture.
    pub fn marks(&self, id: usize) -> Result<Marks> {
        Ok(self.state().image(id)?.marks.clone())
    }

    /// A picture to try.
    ///
    /// # Errors
    /// No such picture.
    pub(crate) fn trial_picture(&self, id: usize) -> Result<TrialPicture> {
        Ok(self.state().trial_picture(id)?.clone())
    }

    /// Takes a picture that came from the page; it is kept in a folder of this session.
    ///
    /// # Errors
    /// Bytes that are no picture, more pictures than a session keeps.
    pub fn add_trial_picture(&self, name: &str, bytes: &[u8]) -> Result<TrialPictureView> {
        let count = self.state().trial_pictures.len();
        if count >= MAX_TRIAL_PICTURES {
            return Err(Error::TooManyPictures { most: MAX_TRIAL_PICTURES });
        }
        // The name is for people; the file's own is ours.
        let extension = if bytes.starts_with(b"\x89PNG") { "png" } else { "jpg" };
        let shown: String = name.rsplit(['/', '\\']).next().unwrap_or(name).chars().take(MAX_LABEL_CHARS).collect();
        let file = tempfile::Builder::new()
            .suffix(&format!(".{extension}"))
            .tempfile_in(self.uploads.path())
            .map_err(Error::file(self.uploads.path(), "cannot make a file in it"))?;
        std::fs::write(file.path(), bytes).map_err(Error::file(file.path(), "cannot write"))?;
        let picture = Picture::open(file.path()).map_err(|error| match error {
            Error::Demonstration { source, .. } => Error::Demonstration { name: shown.clone(), source },
            other => other,
        })?;
        let kept = file.into_temp_path().keep().map_err(|error| Error::File {
            path: self.uploads.path().to_owned(),
            action: "cannot keep a file in it",
            source: error.error,
        })?;
        let mut state = self.state();
        state.trial_pictures.push(TrialPicture {
            picture: Picture { path: kept, name: shown, ..picture },
            uploaded: true,
            became: None,
        });
        let id = state.trial_pictures.len() - 1;
        Ok(state.trial_picture_view(id))
    }

    /// Makes a tried picture a demonstration with these marks. One that came from the page gets a place beside the first
    /// picture, under a name of its own.
    ///
    /// # Errors
    /// No such picture, one that is a demonstration already, a file that cannot be written.
    pub fn accept(&self, trial_id: usize, marks: Marks) -> Result<ImageView> {
        let mut state = self.state();
        let trial = state.trial_picture(trial_id)?.clone();
        if trial.became.is_some() {
            return Err(Error::Busy("this picture is a demonstration already"));
        }
        let mut picture = trial.picture;
        if trial.uploaded {
            let extension = picture.path.extension().unwrap_or_default().to_string_lossy();
            let target = free_name(&self.home, &picture.name, &extension);
            let bytes = std::fs::read(&picture.path).map_err(Error::file(&picture.path, "cannot read"))?;
            sdg_report::write_atomically(&target, &bytes)?;
            picture.name = file_name(&target);
            picture.path = target;
        }
        let id = state.add_image(picture, marks)?;
        state.trial_pictures[trial_id].became = Some(id);
        state.save(id);
        Ok(state.image_view(id))
    }

    /// The camera.
    ///
    /// # Errors
    /// [`Error::NoCamera`].
    pub(crate) fn live_desk(&self) -> Result<&LiveDesk> {
        self.live.as_ref().ok_or(Error::NoCamera)
    }

    /// The file that the next photo goes to.
    ///
    /// # Errors
    /// [`Error::NoCamera`].
    pub(crate) fn next_photo(&self) -> Result<PathBuf> {
        Ok(free_numbered(&self.live_desk()?.options.photo_path))
    }

    /// Writes a frame that was shown as PNG, under a name that is not taken, and makes it a photo of the object.
    ///
    /// # Errors
    /// No camera, or one that shows something else than what is before it; a frame that is not kept any more; a file that
    /// cannot be written.
    pub fn take_photo(&self, number: u64) -> Result<ImageView> {
        let frame = self.live_desk()?.photo(number)?;
        let bytes = png(&frame)?;
        // Held until the photo is written: the next one finds its name taken.
        let mut state = self.state();
        let path = self.next_photo()?;
        sdg_report::write_atomically(&path, &bytes)?;
        let picture = Picture { name: file_name(&path), path, size: [frame.width(), frame.height()] };
        let id = state.add_image(picture, Marks::default())?;
        Ok(state.image_view(id))
    }

    /// Makes a frame that was shown a picture to try.
    ///
    /// # Errors
    /// No camera, a frame that is not kept any more, more pictures than a session keeps.
    pub fn keep_frame(&self, number: u64) -> Result<TrialPictureView> {
        let bytes = png(&*self.live_desk()?.frame(number)?)?;
        self.add_trial_picture(&format!("live-{number}.png"), &bytes)
    }

    /// One picture with its marks, as teaching takes it.
    ///
    /// # Errors
    /// No such picture, nothing marked on it, or marks that cannot be taught.
    pub fn demonstration(&self, id: usize) -> Result<Demonstration> {
        let (label, marked) = {
            let state = self.state();
            (state.label.clone(), state.image(id)?.clone())
        };
        marked.demonstration(&label)
    }

    /// Sample `index` of `seed` of a marked picture, with the grasp drawn where the marks went, as JPEG.
    ///
    /// # Errors
    /// No such picture, marks that cannot be taught.
    pub fn sample(&self, id: usize, seed: u64, index: u64) -> Result<Vec<u8>> {
        let (label, marked) = {
            let state = self.state();
            (state.label.clone(), state.image(id)?.clone())
        };
        let key = SampleKey { image_id: id, marks: marked.marks.clone(), seed };
        self.previews.sample(key, || marked.demonstration(&label), index)
    }

    /// Starts to teach from all marked pictures; [`teaching_news`](Self::teaching_news) tells how it goes.
    ///
    /// # Errors
    /// A request without sense, a teaching that goes on already, marks that do not suffice.
    pub fn start_teaching(&self, request: TeachRequest) -> Result<News> {
        request.check()?;
        self.teaching.check_idle()?;
        let demonstrations = self.demonstrations(request.model)?;
        let model_path = self.model_path(&self.state());
        self.teaching.start(Arc::clone(&self.teacher), request, demonstrations, model_path)
    }

    /// State of the teaching, for the page.
    pub fn teaching_news(&self) -> News {
        self.teaching.news()
    }

    /// Asks a running teaching to end with what there is.
    pub fn stop_teaching(&self) {
        self.teaching.stop();
    }

    /// The model taught last.
    ///
    /// # Errors
    /// [`Error::NotTaught`].
    pub fn taught_model(&self) -> Result<Arc<dyn TaughtModel>> {
        self.teaching.model()
    }

    /// Every picture that is marked for `model`. Pictures without any mark are left out.
    ///
    /// # Errors
    /// None is marked, or one only in part.
    pub fn demonstrations(&self, model: ModelKind) -> Result<Vec<Demonstration>> {
        let (label, marked) = {
            let state = self.state();
            (state.label.clone(), state.images.clone())
        };
        let begun: Vec<_> = marked.iter().filter(|image| image.marks != Marks::default()).collect();
        if begun.is_empty() {
            let name = marked.first().map_or_else(|| "no photo yet".to_owned(), |image| image.picture.name.clone());
            return Err(Error::NotMarked { name, expected: "a box and a grasp", found: "no marks" });
        }
        for image in &begun {
            let advice = advise(&image.marks, image.picture.size);
            let lacks = advice.models.iter().find(|advice| advice.model == model).map(|advice| &advice.lacks);
            if let Some(&missing) = lacks.and_then(|lacks| lacks.first()) {
                let name = image.picture.name.clone();
                return Err(Error::NotMarked { name, expected: missing, found: "none" });
            }
        }
        begun.into_iter().map(|image| image.demonstration(&label)).collect()
    }
}
