//! `sdg annotate`: the annotation page.

use std::path::{Path, PathBuf};

use anyhow::Result;
use sdg_annotate::{OpenProject, Server, Session, SessionOptions, Start};
use sdg_inputs::camera_files::CameraFile;
use sdg_inputs::demonstrations;
use sdg_page_session::{PageTeacher, open_chosen, open_session};
use serde_json::json;

use super::{AnnotateArgs, recent};
use crate::exit::{Outcome, Usage};
use crate::interrupt::Interrupt;
use crate::live_pictures;
use crate::web_browser;

/// Serves the page until Ctrl-C.
pub fn run(args: &AnnotateArgs) -> Result<Outcome> {
    if args.from.is_none() {
        args.request.refuse_without_camera(&[], "photos")?;
    }
    let preset = args.preset.parse().map_err(|error| Usage(format!("--preset: {error}")))?;
    let camera = args.camera.file.as_deref().map(CameraFile::read).transpose()?;
    let teacher = PageTeacher { preset, camera: camera.map(|camera| (camera, args.camera.heights_m())) };
    let token = args.token_file.as_deref().map(sdg_annotate::token_of_file).transpose()?;
    let server = if args.images.is_empty() && args.from.is_none() {
        if args.out.is_some() || !args.trial_pictures.is_empty() {
            return Err(Usage(
                "expected IMAGE or DIR with --out and --try, found none (without these options, sdg annotate lists the projects)".into(),
            )
            .into());
        }
        let start = Start {
            recent: recent::projects(),
            folder: PathBuf::new(),
            pixel_frame: teacher.pixel_frame(),
            photo_size: teacher.photo_size(),
            open: opener(teacher),
        };
        Server::bind_start(start, args.port, token.as_deref())?
    } else {
        let project = project(&args.images)?;
        let session = open(args, project, &teacher, token)?;
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
    teacher: &PageTeacher,
    token: Option<String>,
) -> Result<Session> {
    let arguments = args.images.iter().filter(|_| project.is_none());
    let mut images: Vec<(PathBuf, Option<PathBuf>)> = arguments.map(|argument| split(argument)).collect();
    let photo_path = match (&args.from, &project) {
        (None, _) => None,
        (Some(_), Some(folder)) => Some(folder.join("photo.png")),
        (Some(_), None) => Some(photo_path(&mut images)?),
    };
    let opened = project.clone().or_else(|| images.first().map(|(photo, _)| photo.clone()));
    let options = SessionOptions {
        images,
        trial_pictures: args.trial_pictures.clone(),
        model_path: args.out.clone(),
        project,
        token,
        ..SessionOptions::default()
    };
    let open_camera = || {
        let Some((from, photo_path)) = args.from.clone().zip(photo_path.clone()) else { return Ok(None) };
        let address = sdg_annotate::paced(from);
        if let Some((camera, _)) = &teacher.camera {
            args.request.check_size(camera.size_px(), "of the calibration")?;
        }
        let options = args.request.options(&address)?;
        let camera = live_pictures::open(&address, &teacher.open_options(options))?;
        Ok(Some(teacher.live(camera, &address, photo_path)))
    };
    let report = &mut |line: &str| eprintln!("{line}");
    let session = open_session(teacher, options, photo_path.as_deref(), open_camera, report)?;
    if let Some(opened) = opened {
        recent::note(&opened);
    }
    Ok(session)
}

/// Opens the project chosen on the page: a folder or a photo.
fn opener(teacher: PageTeacher) -> OpenProject {
    Box::new(move |path| {
        let session = open_chosen(&teacher, path)?;
        recent::note(path);
        Ok(session)
    })
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

/// The path of the photo to be taken: the one image of `images` that does not exist yet, which is removed from
/// `images`. If all images exist, it is `photo.png` in the current folder.
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
