//! `sdg detect`: planar grasps in images.

mod args;
mod inputs;
mod live;

use std::time::Instant;

use anyhow::{Context, Result, bail};
use sdg_cell::{DEFAULT_MIN_SCORE, DetectionWords, Perception, SearchedPicture};
use sdg_grasp::{CheckConfig, GraspDetection, Verification};
use sdg_inputs::{DrawnNames, PictureInput, PictureInputs, camera_files, pictures_of_argument};
use serde::Serialize;

pub use args::DetectArgs;

use crate::commands::devices;
use crate::exit::{Outcome, Usage, one_line};
use crate::found_text::{FoundText, advice_with_options};
use crate::json_line::json_line;
use crate::output;
use crate::paint::{Paint, Tone};
use crate::shared_args::{RegionArg, verification};

/// Prints the detections in each image. For an image that cannot be used, reports the error and continues.
pub fn run(args: &DetectArgs) -> Result<Outcome> {
    if args.from.is_none() {
        let own = [("--frames", args.frames.is_some()), ("--every-frame", args.every_frame)];
        args.request.refuse_without_camera(&own, "images")?;
    }
    if args.from.is_some() && !args.images.is_empty() {
        return Err(Usage("--from: expected live pictures instead of images, found images as well".to_owned()).into());
    }
    let mut model = sdg_inputs::read_model(&args.grasp_model, &devices::open(&args.compute)?)?;
    let verification = verification(args.no_verify, &model);
    let is_tracked = args.from.is_some() && !args.every_frame && verification != Verification::Off;
    if is_tracked && args.min_score != DEFAULT_MIN_SCORE {
        return Err(Usage(
            "--min-score: expected images, or live pictures with --every-frame, found live pictures with tracking"
                .to_owned(),
        )
        .into());
    }
    if let Some(tolerance) = args.size_tolerance {
        model = model.with_size_tolerance(tolerance.range())?;
    }
    if args.max as usize != CheckConfig::DEFAULT_MAX_DETECTIONS {
        model = model.with_max_detections(args.max as usize)?;
    }
    if args.region.is_some() {
        // The model's region, which is replaced, may not fit this camera's pictures.
        model = model.with_region(None)?;
    }
    let mut detector = camera_files::perception(model, &args.grasp_model, args.camera.as_deref())?;
    match args.region {
        None => {}
        Some(RegionArg::All) => detector.look_in(None)?,
        Some(RegionArg::Part(region)) => detector.look_in(Some(region)).context("--region")?,
    }
    if let Some(address) = &args.from {
        return live::run(args, address, detector, verification);
    }
    inputs::check_standard_input(&args.images)?;
    let mut batch = Batch {
        args,
        detector: &detector,
        verification,
        drawn: DrawnNames::of([]),
        num_used: 0,
        num_failed: 0,
        is_alone: false,
        last_error: String::new(),
        num_found: 0,
        num_with_parts: 0,
    };
    let inputs: Vec<_> = args.images.iter().map(|argument| (argument, pictures_of_argument(argument))).collect();
    let num_pictures = |inputs: &Result<PictureInputs>| inputs.as_ref().map_or(1, |inputs| inputs.pictures.len());
    batch.is_alone = inputs.iter().map(|(_, inputs)| num_pictures(inputs)).sum::<usize>() == 1;
    if let Some(folder) = &args.draw {
        let read = inputs.iter().filter_map(|(_, inputs)| inputs.as_ref().ok());
        let pictures = read.flat_map(|inputs| &inputs.pictures);
        inputs::check_drawn_elsewhere(folder, pictures.clone())?;
        batch.drawn = DrawnNames::of(pictures);
        sdg_files::prepare_folder(folder)?;
    }
    for (argument, inputs) in inputs {
        match inputs {
            Ok(PictureInputs { pictures, skipped }) => {
                if let Some(skipped) = skipped {
                    eprintln!("{skipped}");
                }
                pictures.iter().try_for_each(|input| batch.picture(input))?;
            }
            Err(error) => batch.failed(&argument.display().to_string(), &error)?,
        }
    }
    batch.summarize();
    match (batch.num_failed, batch.num_found > 0) {
        (0, true) => Ok(Outcome::Done),
        (0, false) => Ok(Outcome::NothingToGrasp),
        // The error of a single picture is the error of the command.
        (1, _) if batch.is_alone => bail!(batch.last_error),
        (failed, _) => bail!("{failed} of {} pictures could not be used", failed + batch.num_used),
    }
}

/// Processes pictures in order and prints the lines of each.
struct Batch<'a> {
    args: &'a DetectArgs,
    detector: &'a Perception,
    verification: Verification,
    /// File names of the drawings.
    drawn: DrawnNames,
    num_used: usize,
    num_failed: usize,
    /// Whether this run has only one picture.
    is_alone: bool,
    last_error: String,
    /// Number of accepted detections in all pictures.
    num_found: usize,
    /// Number of pictures with at least one accepted detection.
    num_with_parts: usize,
}

impl<'a> Batch<'a> {
    /// Detects parts in a picture and prints its lines. For a picture that cannot be used, reports the error.
    ///
    /// # Errors
    /// Standard output cannot be written, and there are no drawings, which are further results.
    fn picture(&mut self, input: &PictureInput) -> Result<()> {
        match self.detect(input) {
            Ok(seen) => {
                self.num_used += 1;
                let text = self.text(&seen);
                let num_found = seen.listed(&text.words, false).len();
                self.num_found += num_found;
                self.num_with_parts += usize::from(num_found > 0);
                print_lines(self.args, &seen, &text, &input.name())?;
            }
            Err(error) => self.failed(&input.name(), &error)?,
        }
        if self.args.draw.is_none() { output::check() } else { Ok(()) }
    }

    /// Prints the totals of several pictures on standard error.
    fn summarize(&self) {
        if !self.is_alone {
            let Self { num_found, num_with_parts, num_used, .. } = self;
            let parts = if *num_found == 1 { "part" } else { "parts" };
            eprintln!("found {num_found} {parts} in {num_with_parts} of {num_used} pictures");
        }
    }

    fn failed(&mut self, name: &str, error: &anyhow::Error) -> Result<()> {
        self.num_failed += 1;
        let error = one_line(error);
        if self.args.json {
            let line = ErrorLine { image: name.to_owned(), error: error.clone() };
            println!("{}", json_line(&line)?);
        } else if !self.is_alone {
            eprintln!("{} {error}", Paint::stderr().text(Tone::Bad, "error:"));
        }
        self.last_error = error;
        Ok(())
    }

    fn text(&self, seen: &SearchedPicture) -> FoundText<'a> {
        let words = DetectionWords { detector: self.detector, picture_size: seen.size, min_score: self.args.min_score };
        FoundText { words, paint: Paint::stdout() }
    }

    fn detect(&mut self, input: &PictureInput) -> Result<SearchedPicture> {
        let mut image = input.read(self.detector.pixel_frame())?;
        let start = Instant::now();
        let detections = self.detector.detect(&image, self.verification).with_context(|| input.name())?;
        let seconds = start.elapsed().as_secs_f64();
        let seen = SearchedPicture { size: image.dimensions().into(), seconds, detections };
        if let Some(folder) = &self.args.draw {
            seen.draw(&mut image, &self.text(&seen).words);
            sdg_files::write_drawing(&folder.join(self.drawn.name_of(input)), &image)?;
        }
        Ok(seen)
    }
}

/// Prints the lines of a picture, or its JSON line.
fn print_lines(args: &DetectArgs, seen: &SearchedPicture, text: &FoundText<'_>, name: &str) -> Result<()> {
    let FoundText { words, .. } = text;
    let listed = seen.listed(words, args.all);
    let detections: Vec<&GraspDetection> = listed.iter().map(|found| &found.detection).collect();
    let touched = words.touched(&detections);
    if args.json {
        println!("{}", json_line(&seen.record(name, words, &listed, touched, advice_with_options))?);
        return Ok(());
    }
    let refused = seen.refused(words);
    if refused.len() == seen.detections.len() {
        println!("{name}: {}", text.nothing(&refused, args.all));
    }
    for (found, touched) in listed.iter().zip(touched) {
        let touched: Vec<&GraspDetection> = touched.into_iter().map(|idx| detections[idx]).collect();
        println!("{name}: {}", text.line(found, &touched));
    }
    Ok(())
}

/// One line of `--json` for a picture that cannot be used.
#[derive(Serialize)]
struct ErrorLine {
    image: String,
    error: String,
}
