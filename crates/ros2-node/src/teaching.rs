//! `~/teach`: `sdg teach` in a thread, so that pictures are searched meanwhile.

use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::Parser;
use sdg_ros2::messages::TeachRequest;

use crate::args::{Args, Command};
use crate::commands;
use crate::commands::ros2::args::TeachTriggerArgs;
use crate::exit::one_line;

/// A teaching under way.
pub(super) struct Teaching {
    thread: Option<JoinHandle<Result<(), String>>>,
    out: PathBuf,
    started: Instant,
    pub(super) is_used: bool,
    /// Has the marks that came with the request; removed with it.
    _marks: Option<MarksFile>,
}

/// What a Trigger teaches.
#[derive(Debug, Clone)]
pub(super) struct TriggerTeaching(TeachTriggerArgs);

impl TriggerTeaching {
    pub(super) fn new(args: &TeachTriggerArgs) -> Option<Self> {
        args.teach_demo.is_some().then(|| Self(args.clone()))
    }

    pub(super) fn request(&self) -> TeachRequest {
        TeachRequest {
            photo_path: self.0.teach_demo.clone().unwrap_or_default(),
            out_path: self.0.teach_out.as_ref().map_or(String::new(), |path| path.display().to_string()),
            model: self.0.teach_model.clone(),
            use_it: true,
            ..TeachRequest::default()
        }
    }
}

/// Marks that a request brought, as a file that lives as long as the teaching.
struct MarksFile(PathBuf);

impl Drop for MarksFile {
    fn drop(&mut self) {
        // What is left in the system's folder for such files harms nobody.
        let _ = std::fs::remove_file(&self.0);
    }
}

impl Teaching {
    /// Begins; the arguments are those of `sdg teach`, checked as there.
    ///
    /// # Errors
    /// What is no request.
    pub(super) fn begin(request: &TeachRequest, camera_file: Option<&Path>) -> Result<Self> {
        if request.photo_path.is_empty() || request.out_path.is_empty() {
            bail!("expected photo_path and out_path, found \"{}\" and \"{}\"", request.photo_path, request.out_path);
        }
        let marks = match request.annotation.as_str() {
            "" => None,
            text => {
                let path = std::env::temp_dir().join(format!("sdg-marks-{}.json", std::process::id()));
                std::fs::write(&path, text).with_context(|| path.display().to_string())?;
                Some(MarksFile(path))
            }
        };
        let annotation = marks.as_ref().map_or(request.annotation_path.clone(), |file| file.0.display().to_string());
        let demonstration = if annotation.is_empty() {
            request.photo_path.clone()
        } else {
            format!("{}:{annotation}", request.photo_path)
        };
        let mut line = vec!["sdg".to_owned(), "teach".to_owned()];
        let mut option = |name: &str, value: String| line.push(format!("{name}={value}"));
        option("--demo", demonstration);
        option("--out", request.out_path.clone());
        option("--model", if request.model.is_empty() { "C".to_owned() } else { request.model.clone() });
        option("--seed", if request.seed == 0 { 1 } else { request.seed }.to_string());
        if request.time_budget_secs > 0.0 {
            option("--time-budget", request.time_budget_secs.to_string());
        }
        if request.mark_height_mm > 0.0 {
            let camera = camera_file.context("mark_height_mm: expected a node that was started with --camera")?;
            option("--camera", camera.display().to_string());
            option("--mark-height-mm", request.mark_height_mm.to_string());
        }
        let parsed = Args::try_parse_from(&line).map_err(|error| {
            let text = error.to_string();
            anyhow::anyhow!("{}", text.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned())
        })?;
        let Command::Teach(args) = parsed.command else { bail!("expected the arguments of sdg teach") };
        let thread =
            std::thread::spawn(move || commands::teach::run(&args).map(drop).map_err(|error| one_line(&error)));
        let out = PathBuf::from(&request.out_path);
        Ok(Self { thread: Some(thread), out, started: Instant::now(), is_used: request.use_it, _marks: marks })
    }

    /// The model's file and how long it took, or why there is none; `None` while it goes on.
    pub(super) fn finished(&mut self) -> Option<Result<(PathBuf, f64), String>> {
        if !self.thread.as_ref().is_some_and(JoinHandle::is_finished) {
            return None;
        }
        let taught = self.thread.take()?.join().unwrap_or_else(|_| Err("teaching panicked".to_owned()));
        Some(taught.map(|()| (self.out.clone(), self.started.elapsed().as_secs_f64())))
    }
}
