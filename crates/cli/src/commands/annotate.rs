//! `sdg annotate`: the annotation page.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;

use anyhow::Result;
use sdg_annotate::{Server, Session, SessionOptions};
use serde_json::json;

use crate::args::AnnotateArgs;
use crate::camera_files::CameraFile;
use crate::demonstrations;
use crate::exit::{Outcome, Usage};
use crate::files;
use crate::interrupt::Interrupt;
use crate::page_teacher::PageTeacher;

/// Serves the page until Ctrl-C.
pub fn run(args: &AnnotateArgs) -> Result<Outcome> {
    let preset = args.preset.parse().map_err(|error| Usage(format!("--preset: {error}")))?;
    let camera = args.camera.file.as_deref().map(CameraFile::read).transpose()?;
    let camera = camera.map(|camera| (camera, args.camera.heights_m()));
    let images: Vec<(PathBuf, Option<PathBuf>)> = args.images.iter().map(|argument| split(argument)).collect();
    // Marks are made for minutes before the first is written.
    files::check_writable(&images[0].0.with_extension("json"))?;
    if let Some(out) = &args.out {
        files::check_writable(out)?;
    }
    let options = SessionOptions { images, scenes: args.scenes.clone(), model_path: args.out.clone() };
    let session = Session::open(&options, Arc::new(PageTeacher { preset, camera }))?;
    let server = Server::bind(session, args.port)?;
    let url = server.url();
    if args.json {
        println!("{}", json!({"url": url}));
    } else {
        println!("mark the grasp at {url}");
        println!("Ctrl-C ends it; marks are saved as they are made");
    }
    if !args.no_browser {
        open_browser(&url);
    }
    let interrupt = Interrupt::watch();
    server.run(move || interrupt.is_requested())?;
    Ok(Outcome::Done)
}

/// `IMAGE`, or `IMAGE:ANNOTATION` where no file has that whole name.
fn split(argument: &str) -> (PathBuf, Option<PathBuf>) {
    if Path::new(argument).exists() {
        return (argument.into(), None);
    }
    match demonstrations::split(argument) {
        Ok((image, annotation)) => (image, Some(annotation)),
        Err(_) => (argument.into(), None),
    }
}

/// Tries to; the address is printed in any case.
fn open_browser(url: &str) {
    let opener = if cfg!(target_os = "macos") { "open" } else { "xdg-open" };
    let _ = Command::new(opener).arg(url).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
}
