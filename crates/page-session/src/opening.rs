//! Opens a session of the page on a user's files. The files that the page writes are locked against other processes.

use std::collections::BTreeSet;
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
    let options = SessionOptions { max_opening_px, pixel_frame, ..options };
    let session = Session::open(&options, Arc::new(teacher.clone()))?.holding(locks);
    // The project may name further photos.
    session.lock_photos().map_err(refused)?;
    Ok(session)
}

/// Locks files against other processes, each once. Files in a folder that is not writable are not locked.
fn lock_all(written: impl Iterator<Item = PathBuf>) -> Result<Vec<WriterLock>> {
    let written: BTreeSet<PathBuf> = written.collect();
    let locks = written.iter().map(|written| lock(written)).collect::<Result<Vec<_>>>()?;
    Ok(locks.into_iter().flatten().collect())
}

/// Locks a file against other processes; `None` if the folder is not writable.
fn lock(written: &Path) -> Result<Option<WriterLock>> {
    WriterLock::take(written).map_err(refused)
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
    use sdg_grasp::Preset;
    use sdg_inputs::camera_files::CameraFile;

    #[test]
    fn photos_of_a_project_are_locked_and_those_added_to_it() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["a.png", "b.png", "c.png"] {
            RgbImage::new(60, 40).save(at(name)).unwrap();
        }
        let project = r#"{"format": 1, "label": null, "photos": ["a.png", "b.png"], "tried": [], "removed": [],
            "models": [], "current_model": null}"#;
        std::fs::write(at("a.sdg-project.json"), project).unwrap();
        let teacher = PageTeacher { preset: Preset::default(), camera: None };
        let open = |name: &str| open_chosen(&teacher, &at(name)).map_err(|error| error.to_string());
        let session = open("a.png").unwrap();
        let is_refused = |name: &str| open(name).is_err_and(|error| error.contains("is editing these marks"));
        assert!(is_refused("b.png") && !is_refused("c.png"));
        let other = session.view().others[0].id;
        session.add_photo(other).unwrap();
        assert!(is_refused("c.png"));
        // A photo that is removed and added again is locked already.
        let added = session.view().images[2].id;
        session.remove_image(added).unwrap();
        session.view();
        session.add_photo(other).unwrap();
        drop(session);
        assert!(!is_refused("b.png"));
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
