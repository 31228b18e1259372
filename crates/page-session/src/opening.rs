//! Opens a session of the page on a user's files. The project and the marks of the given photos are locked against
//! other processes; the session locks the marks of further photos when it writes them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Result, anyhow};
use sdg_annotate::{LiveOptions, Session, SessionOptions};
use sdg_files::{FileError, WriterLock};
use sdg_inputs::why_unreadable;

use crate::teacher::PageTeacher;

/// Name of a project's file in its folder.
const PROJECT_FILE: &str = "sdg-project.json";

/// Opens the files of a session, and then its camera with `open_camera`. `photo_path` is the photo to be taken.
/// `report` is given a line for each picture of an unsupported format in the folders of pictures to try.
///
/// Everything is checked here, so that an error does not come after minutes of marking.
///
/// # Errors
/// A file cannot be read or written, or is open in another process; a photo of a calibrated camera is stored rotated;
/// the errors of `open_camera`.
pub fn open_session(
    teacher: &PageTeacher,
    options: SessionOptions,
    photo_path: Option<&Path>,
    open_camera: impl FnOnce() -> Result<Option<LiveOptions>>,
    report: &mut dyn FnMut(&str),
) -> Result<Session> {
    let images = &options.images;
    for written in images.first().map(|(image, _)| image.as_path()).into_iter().chain(photo_path) {
        sdg_files::check_writable(&written.with_extension("json"))?;
    }
    if let Some(out) = &options.model_path {
        sdg_files::check_writable(out)?;
    }
    let marks = images.iter().map(|(image, marks)| marks.clone().unwrap_or_else(|| image.with_extension("json")));
    let photo = photo_path.iter().map(|photo| photo.with_extension("json"));
    let project_file = match (&options.project, images.first()) {
        (Some(folder), _) => Some(folder.join(PROJECT_FILE)),
        (None, Some((photo, _))) => Some(sdg_annotate::project_of_photo(photo)?),
        (None, None) => None,
    };
    let locks = lock_all(marks.chain(photo).chain(project_file))?;
    for folder in options.trial_pictures.iter().filter(|path| path.is_dir()) {
        for path in sdg_files::entries(folder)? {
            // Other kinds of files are expected beside the pictures and are not reported.
            if let Some(why) = why_unreadable(&path) {
                report(&format!("left out: {why}"));
            }
        }
    }
    if teacher.camera.is_some() {
        let photos = images.iter().map(|(photo, _)| photo).filter(|photo| photo.exists());
        photos.into_iter().try_for_each(|photo| sdg_inputs::check_is_not_turned(photo))?;
    }
    let live = open_camera()?;
    open(teacher, SessionOptions { live, ..options }, locks)
}

/// Opens a project chosen on the page: a folder or a photo.
///
/// # Errors
/// A file cannot be read or written, or is open in another process; a photo of a calibrated camera is stored rotated.
pub fn open_chosen(teacher: &PageTeacher, path: &Path) -> Result<Session> {
    let is_folder = path.is_dir();
    let written = if is_folder { path.join(PROJECT_FILE) } else { sdg_annotate::project_of_photo(path)? };
    sdg_files::check_writable(&written)?;
    let marks = (!is_folder).then(|| path.with_extension("json"));
    let locks = lock_all(marks.into_iter().chain([written]))?;
    let options = SessionOptions {
        images: if is_folder { Vec::new() } else { vec![(path.to_owned(), None)] },
        project: is_folder.then(|| path.to_owned()),
        ..SessionOptions::default()
    };
    open(teacher, options, locks)
}

fn open(teacher: &PageTeacher, options: SessionOptions, locks: Vec<WriterLock>) -> Result<Session> {
    let (max_opening_px, pixel_frame) = (teacher.max_opening_px(), teacher.pixel_frame());
    let (photo_size, heights_m) = (teacher.photo_size(), teacher.camera.as_ref().map(|(_, heights_m)| *heights_m));
    let options = SessionOptions { max_opening_px, pixel_frame, photo_size, heights_m, ..options };
    Ok(Session::open(&options, Arc::new(teacher.clone()))?.holding(locks))
}

/// Locks files against other processes, each once. Files in a folder that is not writable are not locked.
fn lock_all(written: impl Iterator<Item = PathBuf>) -> Result<Vec<WriterLock>> {
    let written: BTreeMap<PathBuf, PathBuf> = written.map(|file| (sdg_files::absolute(&file), file)).collect();
    let locks = written.values().map(|file| WriterLock::take(file).map_err(refused));
    Ok(locks.collect::<Result<Vec<_>>>()?.into_iter().flatten().collect())
}

/// The error of a lock.
fn refused(error: FileError) -> anyhow::Error {
    match error {
        FileError::Held { path, holder } => anyhow!(
            "{}: another `sdg annotate` ({holder}) is editing these marks; continue on its page, or stop it first",
            path.display()
        ),
        error => error.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::png::PngEncoder;
    use image::{ImageEncoder, RgbImage};
    use sdg_annotate::Marks;
    use sdg_grasp::Preset;
    use sdg_inputs::camera_files::CameraFile;

    const MARKED: &str = r#"{"imageWidth": 60, "imageHeight": 40, "shapes": [
            {"label": "bar", "shape_type": "rectangle", "points": [[10, 10], [30, 20]]}]}"#;

    fn teacher() -> PageTeacher {
        PageTeacher { preset: Preset::default(), camera: None }
    }

    fn folder_of(names: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for name in names {
            RgbImage::new(60, 40).save(folder.path().join(name)).unwrap();
        }
        folder
    }

    /// Opens a photo with a project of these photos.
    fn open_with(folder: &Path, photos: &[&str]) -> Result<Session> {
        let project = format!(
            r#"{{"format": 1, "label": null, "photos": {photos:?}, "tried": [], "removed": [], "models": [],
            "current_model": null}}"#
        );
        std::fs::write(folder.join("a.sdg-project.json"), project).unwrap();
        open_chosen(&teacher(), &folder.join("a.png"))
    }

    #[test]
    fn further_photos_of_a_project_are_locked_when_their_marks_are_written() {
        let folder = folder_of(&["a.png", "b.png"]);
        let open = |name: &str| open_chosen(&teacher(), &folder.path().join(name));
        let is_refused = |name: &str| open(name).is_err_and(|error| error.to_string().contains("editing these marks"));
        let marks = |left: f64| Marks { bbox: Some([left, 5.0, 50.0, 30.0]), ..Marks::default() };
        let session = open_with(folder.path(), &["a.png", "b.png"]).unwrap();
        assert!(is_refused("a.png"));
        let other = open("b.png").unwrap();
        let change = |left: f64| session.set_marks(1, marks(left)).map(drop).map_err(|error| error.to_string());
        assert!(change(1.0).unwrap_err().contains("locked by process"));
        other.set_marks(0, marks(2.0)).unwrap();
        drop(other);
        // The marks changed after they were read here.
        assert!(change(3.0).unwrap_err().contains("another program changed these marks"));
        assert_eq!(session.marks(1).unwrap(), marks(2.0));
        change(4.0).unwrap();
        assert!(is_refused("b.png"));
        drop(session);
        assert_eq!(open("b.png").unwrap().marks(0).unwrap(), marks(4.0));
    }

    #[test]
    fn a_part_is_renamed_in_all_files_or_in_none() {
        let folder = folder_of(&["a.png", "b.png"]);
        for name in ["a.json", "b.json"] {
            std::fs::write(folder.path().join(name), MARKED).unwrap();
        }
        let session = open_with(folder.path(), &["a.png", "b.png"]).unwrap();
        let other = open_chosen(&teacher(), &folder.path().join("b.png")).unwrap();
        assert!(session.set_label("rod").unwrap_err().to_string().contains("locked by process"));
        assert_eq!(session.view().label, "bar");
        assert!(!folder.path().join("a.coco.json").exists());
        drop(other);
        assert_eq!(session.set_label("rod").unwrap().label, "rod");
        assert!(folder.path().join("a.coco.json").exists());
    }

    #[test]
    fn a_photo_with_two_spellings_of_its_path_is_one_photo() {
        let folder = folder_of(&["a.png", "b.png"]);
        std::fs::create_dir(folder.path().join("sub")).unwrap();
        let spelled = ["sub/../b.png", "b.png"].map(|name| folder.path().join(name).display().to_string());
        let session = open_with(folder.path(), &["a.png", &spelled[0], &spelled[1]]).unwrap();
        assert_eq!(session.view().images.len(), 2);
    }

    #[test]
    fn a_folder_of_many_marked_photos_needs_one_lock() {
        let names: Vec<String> = (0..20).map(|number| format!("{number}.png")).collect();
        let folder = folder_of(&names.iter().map(String::as_str).collect::<Vec<_>>());
        for number in 0..20 {
            std::fs::write(folder.path().join(format!("{number}.json")), MARKED).unwrap();
        }
        let session = open_chosen(&teacher(), folder.path()).unwrap();
        assert_eq!(session.view().images.len(), 20);
        let is_hidden = |entry: &std::fs::DirEntry| entry.file_name().as_encoded_bytes().starts_with(b".");
        let num_locks = || std::fs::read_dir(folder.path()).unwrap().flatten().filter(is_hidden).count();
        assert_eq!(num_locks(), 1, "the project's");
        session.set_label("rod").unwrap();
        assert_eq!(num_locks(), 1, "those of the renamed photos are released");
    }

    #[test]
    fn a_project_with_a_rotated_photo_of_a_calibrated_camera_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let mut bytes = Vec::new();
        let mut encoder = PngEncoder::new(&mut bytes);
        // Big endian, one entry: tag 0x0112 (orientation), a short, 3 for a rotation by 180°.
        let exif = b"MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x03\0\0\0\0\0\0";
        encoder.set_exif_metadata(exif.to_vec()).unwrap();
        RgbImage::new(640, 480).write_with_encoder(encoder).unwrap();
        std::fs::write(folder.path().join("photo.png"), bytes).unwrap();
        let camera = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets/workcell/camera.yaml");
        let camera = Some((CameraFile::read(&camera).unwrap(), [0.016, 0.009]));
        let refused = [None, camera].map(|camera| {
            let teacher = PageTeacher { preset: Preset::default(), camera };
            open_chosen(&teacher, folder.path()).err().map(|error| error.to_string())
        });
        assert_eq!(refused[0], None);
        let told = refused[1].as_deref().unwrap();
        assert!(told.contains("photo.png: expected a photo of the calibrated camera without an Exif"), "{told}");
    }
}
