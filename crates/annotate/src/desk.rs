//! The state behind the server: a session or, until a project is chosen on the page, the list of projects.

use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError, RwLock};

use sdg_demonstration::PixelFrame;
use sdg_files::absolute;
use serde::Serialize;

use crate::error::{Error, Result, TeacherError};
use crate::model_versions::fingerprint;
use crate::names::{PROJECT_FILE, file_name, safe_stem};
use crate::picture::Picture;
use crate::project_file::label_of;
use crate::recent::{RecentProject, RecentProjects};
use crate::session::{Session, check_label};
use crate::views::SessionView;

/// Opens the project in a folder, or that of a photo.
pub type OpenProject = Box<dyn Fn(&Path) -> std::result::Result<Session, TeacherError> + Send + Sync>;

/// The folder and list for choosing and creating projects.
pub struct Start {
    /// The list of recently opened projects; `None` if the user has no home directory.
    pub recent: Option<RecentProjects>,
    /// Folder for new projects.
    pub folder: PathBuf,
    /// Orientation of the pixels of photos.
    pub pixel_frame: PixelFrame,
    /// Width and height of photos; `None` without a camera's calibration.
    pub photo_size: Option<[u32; 2]>,
    /// Opens the chosen project.
    pub open: OpenProject,
}

/// The session, if any, and the means to choose another, if allowed.
pub struct Desk {
    session: RwLock<Option<Arc<Session>>>,
    start: Option<Start>,
}

/// The data with which the page starts.
#[derive(Serialize)]
#[serde(untagged)]
pub enum FirstView {
    Session(Box<SessionView>),
    Start { start: StartView },
}

#[derive(Serialize)]
pub struct StartView {
    /// Folder for new projects.
    folder: String,
    recent: Vec<RecentView>,
}

#[derive(Serialize)]
struct RecentView {
    /// Identifier that does not depend on the other entries.
    id: String,
    /// The part's name or, without one, the name of the folder or photo.
    name: String,
    /// Path of the folder or photo.
    path: String,
    opened_secs: u64,
}

impl Desk {
    pub fn of_session(session: Session) -> Self {
        Self { session: RwLock::new(Some(Arc::new(session))), start: None }
    }

    pub fn of_start(start: Start) -> Self {
        Self { session: RwLock::new(None), start: Some(start) }
    }

    pub fn session(&self) -> Option<Arc<Session>> {
        self.session.read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    pub fn view(&self) -> Result<FirstView> {
        match self.session() {
            Some(session) => {
                let can_close = self.start.is_some();
                Ok(FirstView::Session(Box::new(SessionView { can_close, ..session.view() })))
            }
            None => Ok(FirstView::Start { start: self.start()?.view() }),
        }
    }

    fn start(&self) -> Result<&Start> {
        self.start
            .as_ref()
            .ok_or(Error::Busy("this page was opened for one project; without an argument it offers all"))
    }

    fn take(&self, open: impl FnOnce(&Start) -> Result<Session>) -> Result<FirstView> {
        let start = self.start()?;
        let mut session = self.session.write().unwrap_or_else(PoisonError::into_inner);
        if session.is_some() {
            return Err(Error::Busy("another project is open already: load the page again"));
        }
        *session = Some(Arc::new(open(start)?));
        drop(session);
        self.view()
    }

    /// Opens a recent project.
    ///
    /// # Errors
    /// Unknown project; the project cannot be opened; another project is open.
    pub fn open(&self, id: &str) -> Result<FirstView> {
        self.take(|start| {
            let project = start.recent_projects().into_iter().find(|project| id_of(project) == id);
            let project = project.ok_or(Error::Busy("this project is not there any more: load the page again"))?;
            (start.open)(&project.path).map_err(Error::Teacher)
        })
    }

    /// Creates a project with this name and copies a photo into it.
    ///
    /// # Errors
    /// The name is empty or taken, the bytes are not a picture, an Exif orientation rotates a photo of a calibrated
    /// camera or it has another size, the project cannot be written, or another project is open.
    pub fn create(&self, name: &str, photo: &str, bytes: &[u8]) -> Result<FirstView> {
        self.take(|start| {
            let name = check_label(name)?;
            let photo = photo.rsplit(['/', '\\']).next().unwrap_or(photo);
            Picture::check_photo(bytes, photo, start.pixel_frame, start.photo_size)?;
            let folder = start.folder.join(safe_stem(name));
            std::fs::create_dir(&folder).map_err(Error::file(&folder, "cannot make a new folder of this name"))?;
            let extension = Path::new(photo).extension().unwrap_or_default().to_string_lossy().to_lowercase();
            let stem = safe_stem(&Path::new(photo).file_stem().unwrap_or_default().to_string_lossy());
            let extension = if extension.is_empty() { "png" } else { &extension };
            let path = folder.join(format!("{stem}.{extension}"));
            let make = || {
                sdg_files::write_atomically(&path, bytes)?;
                let session = (start.open)(&folder).map_err(Error::Teacher)?;
                session.set_label(name)?;
                Ok::<_, Error>(session)
            };
            make().inspect_err(|_| {
                // Otherwise the name would be taken. A folder with other files stays.
                for file in [&path, &folder.join(PROJECT_FILE)] {
                    let _ = std::fs::remove_file(file);
                }
                let _ = std::fs::remove_dir(&folder);
            })
        })
    }

    /// Closes the project, so that another can be chosen.
    ///
    /// # Errors
    /// The page is for one project only, or a teaching is running.
    pub fn close(&self) -> Result<FirstView> {
        self.start()?;
        let mut session = self.session.write().unwrap_or_else(PoisonError::into_inner);
        if let Some(session) = &*session {
            session.close()?;
        }
        *session = None;
        drop(session);
        self.view()
    }
}

fn id_of(project: &RecentProject) -> String {
    fingerprint(&project.path.to_string_lossy())
}

impl Start {
    fn recent_projects(&self) -> Vec<RecentProject> {
        self.recent.as_ref().map(RecentProjects::list).unwrap_or_default()
    }

    fn view(&self) -> StartView {
        let shown = |path: &Path| absolute(path).display().to_string();
        let recent = self.recent_projects().into_iter().map(|project| RecentView {
            id: id_of(&project),
            name: label_of(&project.path).unwrap_or_else(|| file_name(&project.path)),
            path: shown(&project.path),
            opened_secs: project.opened_secs,
        });
        StartView { recent: recent.collect(), folder: shown(&self.folder) }
    }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use image::RgbImage;
    use sdg_demonstration::Demonstration;
    use sdg_files::WriterLock;

    use super::*;
    use crate::picture::png;
    use crate::region::{Region, Searched};
    use crate::session::SessionOptions;
    use crate::teacher::{GraspTeacher, TaughtModel, TaughtSummary, TeachRequest, TeachingMaterial, TeachingStep};

    type Taught = std::result::Result<Box<dyn TaughtModel>, TeacherError>;

    struct NoTeacher;

    impl GraspTeacher for NoTeacher {
        fn teach(
            &self,
            _: &TeachingMaterial,
            _: &TeachRequest,
            _: &mut dyn FnMut(TeachingStep) -> ControlFlow<()>,
        ) -> Taught {
            Err("no teacher".into())
        }

        fn teach_on_trial(&self, _: &TeachingMaterial, _: &TeachRequest) -> Taught {
            Err("no teacher".into())
        }

        fn check_region(&self, _: &Region, _: &[Demonstration]) -> std::result::Result<(), TeacherError> {
            Ok(())
        }

        fn open(&self, _: &[u8], _: &TaughtSummary, _: Option<Searched>) -> Taught {
            Err("no teacher".into())
        }
    }

    #[test]
    fn the_name_of_a_project_that_cannot_be_created_stays_free() {
        let folder = tempfile::tempdir().unwrap();
        let desk = Desk::of_start(Start {
            recent: None,
            folder: folder.path().to_owned(),
            pixel_frame: PixelFrame::Upright,
            photo_size: Some([60, 40]),
            open: Box::new(|_: &Path| Err("the disk is full".into())),
        });
        let create = |width: u32| desk.create("rod", "photo.png", &png(&RgbImage::new(width, 40)).unwrap());
        let refused = create(50).err().unwrap().to_string();
        assert!(refused.starts_with("photo.png: expected 60 × 40 pixels"), "{refused}");
        assert!(create(60).err().unwrap().to_string().contains("the disk is full"));
        assert!(!folder.path().join("rod").exists());
    }

    #[test]
    fn a_closed_project_is_unlocked_although_a_search_still_uses_it() {
        let lock = |project: &Path| WriterLock::take(&project.join("sdg-project.json"));
        let open = move |path: &Path| {
            let options = SessionOptions { project: Some(path.to_owned()), ..SessionOptions::default() };
            Ok(Session::open(&options, Arc::new(NoTeacher))?.holding(lock(path)?.into_iter().collect()))
        };
        let folder = tempfile::tempdir().unwrap();
        let (project, pixel_frame) = (folder.path().join("rod"), PixelFrame::Upright);
        let folder_path = folder.path().to_owned();
        let start = Start { recent: None, folder: folder_path, pixel_frame, photo_size: None, open: Box::new(open) };
        let desk = Desk::of_start(start);
        desk.create("rod", "photo.png", &png(&RgbImage::new(60, 40)).unwrap()).unwrap();
        let search = desk.session();
        assert!(lock(&project).is_err());
        desk.close().unwrap();
        assert!(lock(&project).unwrap().is_some());
        drop(search);
    }
}
