//! Opening a session: the project in its last state, the given pictures, and the model in use.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use sdg_files::absolute;

use super::{Session, SessionOptions};
use crate::annotation_file;
use crate::error::{Error, Result};
use crate::guard::new_token;
use crate::live::LiveDesk;
use crate::model_versions::ModelVersions;
use crate::names::{free_numbered, proposed_label, relative};
use crate::picture::{Picture, pictures_in};
use crate::preview::Previews;
use crate::project_file::{Gone, MAX_TRIAL_PICTURES, ProjectFile, ProjectPlace, TRIED_FOLDER, names_in_project};
use crate::region::Searched;
use crate::session_state::{MarkedPicture, State, TrialPicture};
use crate::teacher::GraspTeacher;
use crate::teaching::Teaching;
use crate::views::Saved;

impl Session {
    /// Opens pictures, their marks and their project.
    ///
    /// # Errors
    /// Neither picture nor camera, a given picture that cannot be read, marks of a given picture that belong to another
    /// picture or are in the file of another photo, a given photo of another size than those of the calibrated camera,
    /// another file in the place of a project's, or a photo of a calibrated camera that an Exif orientation rotates.
    /// Unreadable pictures of the project or of a folder, and photos of the project with these faults of marks and
    /// size, are left out; the notes for the user name them.
    pub fn open(options: &SessionOptions, teacher: Arc<dyn GraspTeacher>) -> Result<Self> {
        let place = match (&options.project, options.images.first()) {
            (Some(folder), _) => Some(ProjectPlace::of_folder(folder)),
            (None, Some((photo, _))) => Some(ProjectPlace::of_photo(photo)?),
            (None, None) => None,
        };
        let (project, mut gone) = match &place {
            Some(place) => ProjectFile::open(place, options.pixel_frame)?,
            None => (ProjectFile::default(), Gone::default()),
        };
        let folder = place.as_ref().map_or(Path::new(""), |place| &place.folder).to_owned();
        let mut photos = options.images.clone();
        photos.extend(project.photos.iter().map(|name| (folder.join(name), None)));
        // A picture with two spellings of its path is one photo.
        let mut names = BTreeSet::new();
        photos.retain(|(path, _)| names.insert(relative(&folder, path)));
        let mut marks_files = project.marks.clone();
        // Without the recorded file, the marks are those beside the photo. A missing photo may come back with its file.
        marks_files.retain(|photo, file| {
            let files = annotation_file::files_of(&folder.join(photo), &folder.join(file));
            gone.photos.contains(photo) || files.iter().any(|file| file.exists())
        });
        for (path, marks) in &options.images {
            if let Some(marks) = marks {
                marks_files.insert(relative(&folder, path), relative(&folder, marks));
            }
        }
        let first = photos.first().map(|(path, _)| path.clone());
        let of_camera = || options.live.as_ref().map(|live| live.photo_path.clone());
        let home = match &options.project {
            Some(folder) => folder.join("photo.png"),
            None => first.clone().or_else(of_camera).ok_or(Error::NoImage)?,
        };
        let mut label = project.label.clone();
        let mut images = Vec::new();
        let mut notes = Vec::new();
        for (path, annotation) in &photos {
            let is_given = options.images.iter().any(|(given, _)| given == path);
            let name = relative(&folder, path);
            let recorded = marks_files.get(&name).filter(|_| annotation.is_none());
            let annotation = annotation.clone().or_else(|| recorded.map(|file| folder.join(file)));
            let frame = options.pixel_frame;
            let opened = if is_given { Some(Picture::open(path, frame)?) } else { gone.open(path, frame) };
            let Some(picture) = opened else {
                gone.photos.push(name);
                continue;
            };
            picture.check_is_markable()?;
            let open = || {
                picture.check_size(options.photo_size)?;
                let (image, named) = MarkedPicture::of(picture, annotation.as_deref())?;
                image.check_file(images.iter())?;
                Ok::<_, Error>((image, named))
            };
            let (image, named) = match open() {
                Ok(opened) => opened,
                Err(error) if is_given => return Err(error),
                Err(error) => {
                    gone.leave_out_named(&name, &error);
                    gone.photos.push(name);
                    continue;
                }
            };
            notes.extend(recorded.map(|file| {
                // Changes of marks in another tool's file are in a file beside it.
                let found = match &image.saved {
                    Saved::Written { file: found } => Path::new(file).with_file_name(found),
                    _ => PathBuf::from(file),
                };
                format!("The marks of {name} are in {}.", found.display())
            }));
            label = label.take().or(named);
            images.push(image);
        }
        // The first photo is the reference: opening another one changes neither the order nor the model's age.
        let name = |image: &MarkedPicture| relative(&folder, &image.picture.path);
        images.sort_by_cached_key(|image| {
            let name = name(image);
            project.photos.iter().position(|known| *known == name).unwrap_or(usize::MAX)
        });
        let given = options.images.first();
        let shown = given.and_then(|(path, _)| images.iter().position(|image| name(image) == relative(&folder, path)));
        let trial_pictures = trial_pictures(&project, &folder, &images, options, &mut gone)?;
        notes.append(&mut gone.notes);
        let temporary = match place {
            Some(_) => None,
            None => {
                let made = tempfile::Builder::new().prefix("sdg-annotate-").tempdir();
                Some(made.map_err(Error::file(&std::env::temp_dir(), "cannot make a folder in it"))?)
            }
        };
        let default_folder = home.with_file_name("models");
        let folder_of_out = options.model_path.as_ref().map(|path| path.with_file_name("models"));
        let other_folder = folder_of_out.filter(|folder| absolute(folder) != absolute(&default_folder));
        let models = ModelVersions {
            folder: other_folder.unwrap_or_else(|| default_folder.clone()),
            default_folder,
            versions: project.models,
            current: project.current_model,
        };
        let teaching = Arc::new(Teaching::default());
        let mut region = project.searched.and_then(Searched::region);
        let mut is_model_lost = false;
        if let Some(id) = models.current {
            let opened = models.read(id).and_then(|bytes| {
                let open = |searched| teacher.open(&bytes, &models.versions[id].summary, searched);
                // A region chosen on the page takes precedence over the model's file.
                let opened = open(project.searched).or_else(|error| {
                    let note = format!("The frame that is searched does not suit this model: {error}");
                    open(None).inspect(|_| notes.push(note))
                });
                opened.map_err(Error::Teacher)
            });
            match opened {
                Ok(model) => {
                    region = model.region();
                    teaching.set_model(Arc::from(model));
                }
                Err(error) => {
                    is_model_lost = true;
                    let text = match error {
                        Error::Teacher(_) => "The model of this project cannot be used here",
                        _ => "There is no model in use, as long as its file cannot be read",
                    };
                    notes.push(format!("{text}: {error}"));
                }
            }
        }
        // The proposed name does not depend on photos taken later with the camera.
        let proposal = || proposed_label(first.as_deref(), home.parent().unwrap_or(Path::new("")));
        let state = State {
            is_named: label.is_some(),
            label: label.unwrap_or_else(proposal),
            images,
            trial_pictures,
            models,
            place,
            removed_earlier: project.removed,
            gone,
            marks_files,
            offered: Vec::new(),
            max_opening_px: options.max_opening_px,
            photo_size: options.photo_size,
            heights_m: options.heights_m,
            region,
            is_model_lost,
        };
        let taken_names = options.live.as_ref().map(|live| names_in_project(&live.photo_path)).transpose()?;
        state.save_project()?;
        Ok(Self {
            teacher,
            teaching,
            previews: Previews::default(),
            model_path: options.model_path.clone(),
            home,
            pixel_frame: options.pixel_frame,
            live: options.live.clone().map(LiveDesk::new),
            taken_names: taken_names.unwrap_or_default(),
            temporary,
            locks: Mutex::default(),
            state: Arc::new(Mutex::new(state)),
            shown: shown.unwrap_or(0),
            id: new_token()?,
            token: options.token.clone(),
            notes,
        })
    }

    /// The folder of pictures added on the page.
    pub(super) fn uploads(&self, state: &State) -> PathBuf {
        match (&state.place, &self.temporary) {
            (None, Some(temporary)) => temporary.path().to_owned(),
            _ => self.home.with_file_name(TRIED_FOLDER),
        }
    }

    /// If the session has no project, it gets the project of its first photo; pictures that were added on the page
    /// earlier are copied into the folder of this project.
    pub(super) fn settle_place(&self, state: &mut State, id: usize) -> Result<()> {
        let Some(temporary) = self.temporary.as_ref().filter(|_| state.place.is_none()) else { return Ok(()) };
        state.place = Some(ProjectPlace::of_photo(&state.images[id].picture.path)?);
        let folder = self.uploads(state);
        for trial in &mut state.trial_pictures {
            let path = &trial.picture.path;
            if let Ok(name) = path.strip_prefix(temporary.path()) {
                // The folder may have pictures of another project.
                let kept = free_numbered(&folder.join(name));
                std::fs::create_dir_all(&folder).map_err(Error::file(&folder, "cannot make this folder"))?;
                std::fs::copy(path, &kept).map_err(Error::file(&kept, "cannot write"))?;
                trial.picture.path = kept;
            }
        }
        Ok(())
    }
}

/// The pictures of the project, followed by given ones that are not among them. Unreadable pictures of the project or
/// of a given folder are left out.
fn trial_pictures(
    project: &ProjectFile,
    folder: &Path,
    images: &[MarkedPicture],
    options: &SessionOptions,
    gone: &mut Gone,
) -> Result<Vec<TrialPicture>> {
    let frame = options.pixel_frame;
    let mut trial_pictures: Vec<TrialPicture> = Vec::new();
    for tried in &project.tried {
        let Some(opened) = gone.open(&folder.join(&tried.file), frame) else {
            gone.tried.push(tried.clone());
            continue;
        };
        let picture = Picture { name: tried.name.clone(), ..opened };
        let photo = tried.became.as_ref().map(|photo| folder.join(photo));
        let became = photo.and_then(|photo| images.iter().position(|image| image.picture.is_at(&photo)));
        let missing_photo = tried.became.clone().filter(|photo| gone.photos.contains(photo));
        let is_absent = tried.absent;
        trial_pictures.push(TrialPicture { became, missing_photo, is_absent, ..TrialPicture::new(picture, false) });
    }
    let pictures = images.iter().map(|image| &image.picture).chain(trial_pictures.iter().map(|trial| &trial.picture));
    let mut taken: BTreeSet<_> = pictures.map(|picture| relative(folder, &picture.path)).collect();
    for path in &options.trial_pictures {
        let is_folder = path.is_dir();
        let paths = if is_folder { pictures_in(path)? } else { vec![path.clone()] };
        for path in paths {
            if !taken.insert(relative(folder, &path)) {
                continue;
            }
            if trial_pictures.len() >= MAX_TRIAL_PICTURES {
                return Err(Error::TooManyPictures { most: MAX_TRIAL_PICTURES });
            }
            let opened = if is_folder { gone.open(&path, frame) } else { Some(Picture::open(&path, frame)?) };
            trial_pictures.extend(opened.map(|picture| TrialPicture::new(picture, false)));
        }
    }
    Ok(trial_pictures)
}
