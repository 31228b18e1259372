//! `sdg annotate`: the annotation page.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Result, anyhow};
use nalgebra::Point2;
use sdg_annotate::{CameraPictures, LiveOptions, OpenProject, Server, Session, SessionOptions, SizeCheck, Start};
use sdg_camera::{Address, OpenOptions, PixelFrame};
use sdg_files::{FileError, WriterLock};
use sdg_grasp::Preset;
use sdg_inputs::UNREADABLE_EXTENSIONS;
use sdg_inputs::camera_files::CameraFile;
use sdg_kinematics::HAND_OPENING_MAX_M;
use serde_json::json;

use super::{AnnotateArgs, recent};
use crate::demonstrations;
use crate::exit::{Outcome, Usage, one_line};
use crate::interrupt::Interrupt;
use crate::live_pictures;
use crate::page_teacher::PageTeacher;
use crate::web_browser;

/// Locks a file of marks against other processes; `None` if the folder is not writable.
fn lock(written: &Path) -> Result<Option<WriterLock>> {
    WriterLock::take(written).map_err(|error| match error {
        FileError::Held { path, holder } => anyhow!(
            "{}: another `sdg annotate` ({holder}) is editing these marks; continue on its page, or stop it first",
            path.display()
        ),
        error => error.into(),
    })
}

/// Serves the page until Ctrl-C.
pub fn run(args: &AnnotateArgs) -> Result<Outcome> {
    if args.from.is_none() {
        args.request.refuse_without_camera(&[], "photos")?;
    }
    let preset = args.preset.parse().map_err(|error| Usage(format!("--preset: {error}")))?;
    let camera = args.camera.file.as_deref().map(CameraFile::read).transpose()?;
    let camera = camera.map(|camera| (camera, args.camera.heights_m()));
    let token = args.token_file.as_deref().map(sdg_annotate::token_of_file).transpose()?;
    let server = if args.images.is_empty() && args.from.is_none() {
        if args.out.is_some() || !args.trial_pictures.is_empty() {
            return Err(Usage(
                "expected IMAGE or DIR with --out and --try, found none (without these options, sdg annotate lists the projects)".into(),
            )
            .into());
        }
        let start = Start { recent: recent::projects(), folder: PathBuf::new(), open: opener(preset, camera) };
        Server::bind_start(start, args.port, token.as_deref())?
    } else {
        let project = project(&args.images)?;
        let session = open(args, project, preset, camera, token)?;
        Server::bind(session, args.port)?
    };
    let url = server.url();
    if args.json {
        println!("{}", json!({"url": url}));
    } else {
        println!("mark the grasp at {url}");
        println!("Ctrl-C ends it; marks are saved immediately");
    }
    if !args.no_browser {
        web_browser::open(&url);
    }
    let interrupt = Interrupt::watch();
    server.run(move || interrupt.is_requested())?;
    Ok(Outcome::Done)
}

/// Opens the files that the arguments name, and their projects.
fn open(
    args: &AnnotateArgs,
    project: Option<PathBuf>,
    preset: Preset,
    camera: Option<(CameraFile, [f64; 2])>,
    token: Option<String>,
) -> Result<Session> {
    let arguments = args.images.iter().filter(|_| project.is_none());
    let mut images: Vec<(PathBuf, Option<PathBuf>)> = arguments.map(|argument| split(argument)).collect();
    let photo_path = match (&args.from, &project) {
        (None, _) => None,
        (Some(_), Some(folder)) => Some(folder.join("photo.png")),
        (Some(_), None) => Some(photo_path(&mut images)?),
    };
    // Checked here, so that the error does not come after minutes of marking.
    for written in images.first().map(|(image, _)| image).into_iter().chain(&photo_path) {
        sdg_files::check_writable(&written.with_extension("json"))?;
    }
    if let Some(out) = &args.out {
        sdg_files::check_writable(out)?;
    }
    let marks = images.iter().map(|(image, marks)| marks.clone().unwrap_or_else(|| image.with_extension("json")));
    let photo = photo_path.iter().map(|photo| photo.with_extension("json"));
    let project_file = match (&project, images.first()) {
        (Some(folder), _) => Some(folder.join("sdg-project.json")),
        (None, Some((photo, _))) => Some(sdg_annotate::project_of_photo(photo)?),
        (None, None) => None,
    };
    let written: BTreeSet<PathBuf> = marks.chain(photo).chain(project_file).collect();
    let locks = written.iter().map(|written| lock(written)).collect::<Result<Vec<_>>>()?;
    for folder in args.trial_pictures.iter().filter(|path| path.is_dir()) {
        for path in sdg_files::entries(folder)? {
            // Other files beside the pictures are expected and not reported, but unreadable pictures are.
            if sdg_files::has_extension(&path, &UNREADABLE_EXTENSIONS) {
                let why = sdg_inputs::read_image(&path).err().map(|error| one_line(&error)).unwrap_or_default();
                eprintln!("left out: {why}");
            }
        }
    }
    if camera.is_some() {
        let photos = images.iter().map(|(photo, _)| photo).filter(|photo| photo.exists());
        photos.into_iter().try_for_each(|photo| sdg_inputs::check_is_not_turned(photo))?;
    }
    let calibration = camera.as_ref().map(|(file, _)| file.clone());
    let open = |(from, photo_path)| open_camera(from, args.request.options(), calibration, photo_path);
    let live = args.from.clone().zip(photo_path).map(open).transpose()?;
    let opened = project.clone().or_else(|| images.first().map(|(photo, _)| photo.clone()));
    let options = SessionOptions {
        images,
        trial_pictures: args.trial_pictures.clone(),
        model_path: args.out.clone(),
        live,
        project,
        token,
        max_opening_px: camera.as_ref().and_then(max_opening_px),
    };
    let session = Session::open(&options, Arc::new(PageTeacher { preset, camera }))?;
    if let Some(opened) = opened {
        recent::note(&opened);
    }
    Ok(session.holding(locks.into_iter().flatten().collect()))
}

/// Opens the project chosen on the page: a folder or a photo.
fn opener(preset: Preset, camera: Option<(CameraFile, [f64; 2])>) -> OpenProject {
    Box::new(move |path| {
        let is_folder = path.is_dir();
        let written = if is_folder { path.join("sdg-project.json") } else { sdg_annotate::project_of_photo(path)? };
        sdg_files::check_writable(&written)?;
        let marks = (!is_folder).then(|| path.with_extension("json"));
        let locks = marks.into_iter().chain([written]).map(|written| lock(&written)).collect::<Result<Vec<_>>>()?;
        let options = SessionOptions {
            images: if is_folder { Vec::new() } else { vec![(path.to_owned(), None)] },
            project: is_folder.then(|| path.to_owned()),
            max_opening_px: camera.as_ref().and_then(max_opening_px),
            ..SessionOptions::default()
        };
        let session = Session::open(&options, Arc::new(PageTeacher { preset, camera: camera.clone() }))?;
        recent::note(path);
        Ok(session.holding(locks.into_iter().flatten().collect()))
    })
}

/// The hand's maximum opening, in pixels at the centre of the photo, in the plane of the marks. It is nearly constant
/// over a table that is seen from above.
fn max_opening_px((file, [mark_height_m, _]): &(CameraFile, [f64; 2])) -> Option<f64> {
    let [width, height] = file.size_px();
    let middle = Point2::new(0.5 * f64::from(width), 0.5 * f64::from(height));
    let over_table = &file.over_table;
    let scale = over_table.camera.metres_per_pixel(&middle, over_table.table_height_m + mark_height_m)?;
    Some(HAND_OPENING_MAX_M / scale)
}

/// Opens the camera. With a calibration, the size in it is requested, and frames of another size are a fault.
fn open_camera(
    from: Address,
    mut options: OpenOptions,
    calibration: Option<CameraFile>,
    photo_path: PathBuf,
) -> Result<LiveOptions> {
    if let Some([width, height]) = calibration.as_ref().map(CameraFile::size_px) {
        (options.width, options.height) = (width, height);
        options.frame = PixelFrame::Sensor;
    }
    let address = sdg_annotate::paced(from);
    let camera = live_pictures::open(&address, &options)?;
    let check = calibration.map(|camera| -> Box<SizeCheck> {
        Box::new(move |size| camera.check_size(size).map_err(|error| one_line(&error)))
    });
    let pictures = Arc::new(CameraPictures::read(camera, matches!(address, Address::Sim(_)), check));
    Ok(LiveOptions { pictures, address: address.to_string(), photo_path })
}

/// The project's folder, if the arguments are one folder.
fn project(arguments: &[String]) -> Result<Option<PathBuf>> {
    let mut folders = arguments.iter().map(Path::new).filter(|path| path.is_dir());
    let Some(folder) = folders.next() else { return Ok(None) };
    if arguments.len() > 1 {
        let found = arguments.len();
        let folder = folder.display();
        return Err(Usage(format!(
            "{folder}: expected one project's folder alone, or photos, found {found} arguments"
        ))
        .into());
    }
    sdg_files::check_writable(&folder.join("sdg-project.json"))?;
    Ok(Some(folder.to_owned()))
}

/// Removes the one image that does not exist yet from `images` and returns it, as the path of the photo to be taken;
/// `photo.png` in the current folder if all images exist.
fn photo_path(images: &mut Vec<(PathBuf, Option<PathBuf>)>) -> Result<PathBuf> {
    let is_new = |(image, annotation): &mut (PathBuf, Option<PathBuf>)| annotation.is_none() && !image.exists();
    let mut new = images.extract_if(.., is_new).map(|(image, _)| image);
    let first = new.next();
    if let (Some(first), Some(second)) = (&first, new.next()) {
        let (first, second) = (first.display(), second.display());
        return Err(Usage(format!(
            "expected at most one IMAGE that does not exist yet, for the photo that --from takes, found {first} and \
             {second}"
        ))
        .into());
    }
    drop(new);
    let Some(photo) = first else { return Ok("photo.png".into()) };
    if photo.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("png")) {
        let found = photo.display();
        return Err(Usage(format!(
            "{found}: expected a name that ends with .png for the photo, which is written as PNG"
        ))
        .into());
    }
    Ok(photo)
}

/// Splits `IMAGE:ANNOTATION`. An argument that is the name of an existing file is not split.
fn split(argument: &str) -> (PathBuf, Option<PathBuf>) {
    if Path::new(argument).exists() {
        return (argument.into(), None);
    }
    match demonstrations::split(argument) {
        Ok((image, annotation)) => (image, Some(annotation)),
        Err(_) => (argument.into(), None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_a_project_and_stands_alone() {
        let folder = tempfile::tempdir().unwrap();
        let name = folder.path().display().to_string();
        assert_eq!(project(std::slice::from_ref(&name)).unwrap(), Some(folder.path().to_owned()));
        assert_eq!(project(&["photo.png".to_owned()]).unwrap(), None);
        assert!(project(&[name, "photo.png".to_owned()]).unwrap_err().is::<Usage>());
    }

    #[test]
    fn the_image_that_is_not_there_is_the_photo_to_be_taken() {
        let folder = tempfile::tempdir().unwrap();
        let there = folder.path().join("there.png");
        std::fs::write(&there, "").unwrap();
        let new = |name: &str| (folder.path().join(name), None);
        let path = |mut images: Vec<_>| photo_path(&mut images).map(|path| (path, images.len()));
        assert_eq!(path(vec![]).unwrap(), ("photo.png".into(), 0));
        assert_eq!(path(vec![(there.clone(), None)]).unwrap(), ("photo.png".into(), 1));
        assert_eq!(path(vec![(there, None), new("rod.PNG")]).unwrap(), (folder.path().join("rod.PNG"), 1));
        let two = path(vec![new("a.png"), new("b.png")]).unwrap_err();
        assert!(two.is::<Usage>() && two.to_string().contains("at most one IMAGE"), "{two}");
        let jpeg = path(vec![new("a.jpg")]).unwrap_err();
        assert!(jpeg.is::<Usage>() && jpeg.to_string().contains(".png"), "{jpeg}");
    }
}
