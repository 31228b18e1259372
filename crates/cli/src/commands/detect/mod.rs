//! `sdg detect`: planar grasps in images.

mod args;
mod inputs;
mod live;
mod region_record;

use std::collections::BTreeSet;
use std::io::Write;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use image::RgbImage;
use sdg_cell::{DEFAULT_MIN_SCORE, Found, FoundRecord, Perception, drawing};
use sdg_grasp::{CheckConfig, GraspDetection, Verification};
use sdg_inputs::{PictureInput, PictureInputs, camera_files, pictures_of_argument};
use serde::Serialize;

pub use args::DetectArgs;
use region_record::RegionRecord;

use crate::commands::devices;
use crate::exit::{Outcome, Usage, one_line};
use crate::found_text::{Wording, advice_with_options};
use crate::json_line::json_line;
use crate::paint::{Paint, Tone};
use crate::shared_args::RegionArg;

/// Prints the detections in each image. For an image that cannot be used, reports the error and continues.
pub fn run(args: &DetectArgs) -> Result<Outcome> {
    if args.from.is_none() {
        let own = [("--frames", args.frames.is_some()), ("--every-frame", args.every_frame)];
        args.request.refuse_without_camera(&own, "images")?;
    }
    if args.from.is_some() && !args.images.is_empty() {
        return Err(Usage("--from: expected live pictures instead of images, found images as well".to_owned()).into());
    }
    if args.from.is_some() && args.min_score != DEFAULT_MIN_SCORE && !args.every_frame && !args.no_verify {
        return Err(Usage(
            "--min-score: expected images, or live pictures with --every-frame, found live pictures with tracking"
                .to_owned(),
        )
        .into());
    }
    let mut model = sdg_inputs::read_model(&args.grasp_model, &devices::open(&args.compute)?)?;
    if let Some(tolerance) = args.size_tolerance {
        model = model.with_size_tolerance(tolerance.range())?;
    }
    if args.max as usize != CheckConfig::DEFAULT_MAX_DETECTIONS {
        model = model.with_max_detections(args.max as usize)?;
    }
    let mut detector = camera_files::perception(model, &args.grasp_model, args.camera.as_deref())?;
    match args.region {
        None => {}
        Some(RegionArg::All) => detector.look_in(None)?,
        Some(RegionArg::Part(region)) => detector.look_in(Some(region)).context("--region")?,
    }
    if let Some(address) = &args.from {
        return live::run(args, address, detector);
    }
    inputs::check_standard_input(&args.images)?;
    let mut batch = Batch {
        args,
        detector: &detector,
        stdout: std::io::stdout().lock(),
        drawn: BTreeSet::new(),
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
        let pictures = inputs.iter().filter_map(|(_, inputs)| inputs.as_ref().ok()).flat_map(|inputs| &inputs.pictures);
        inputs::check_drawn_elsewhere(folder, pictures)?;
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
        // For a single picture, its line contains the error.
        (1, _) if batch.is_alone => bail!(batch.last_error),
        (failed, _) => bail!("{failed} of {} pictures could not be used", failed + batch.num_used),
    }
}

/// Processes pictures in order and prints the lines of each.
struct Batch<'a, W> {
    args: &'a DetectArgs,
    detector: &'a Perception,
    stdout: W,
    /// File names of the drawings written so far.
    drawn: BTreeSet<String>,
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

impl<W: Write> Batch<'_, W> {
    /// Detects parts in a picture and prints its lines. For a picture that cannot be used, reports the error.
    ///
    /// # Errors
    /// Standard output cannot be written.
    fn picture(&mut self, input: &PictureInput) -> Result<()> {
        match self.detect(input) {
            Ok(seen) => {
                self.num_used += 1;
                let num_found = seen.accepted(self.args.min_score).count();
                self.num_found += num_found;
                self.num_with_parts += usize::from(num_found > 0);
                seen.write(&mut self.stdout, self.args, self.detector, &input.name())
            }
            Err(error) => self.failed(&input.name(), &error),
        }
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
            writeln!(self.stdout, "{}", json_line(&line)?)?;
        } else if !self.is_alone {
            self.stdout.flush()?;
            eprintln!("{} {error}", Paint::stderr().text(Tone::Bad, "error:"));
        }
        self.last_error = error;
        Ok(())
    }

    fn detect(&mut self, input: &PictureInput) -> Result<Seen> {
        let verification = if self.args.no_verify { Verification::Off } else { Verification::ByShape };
        let image = input.read(self.detector.pixel_frame())?;
        let start = Instant::now();
        let detections = self.detector.detect(&image, verification).with_context(|| input.name())?;
        let seen = Seen { size: image.dimensions().into(), seconds: start.elapsed().as_secs_f64(), detections };
        if let Some(folder) = &self.args.draw {
            let wording = seen.wording(self.detector, self.args.min_score);
            let drawn = drawn(image, &seen.detections, &wording);
            sdg_files::write_drawing(&folder.join(input.drawn_name(&mut self.drawn)), &drawn)?;
        }
        Ok(seen)
    }
}

/// The picture with its detections drawn, and for the best refused ones the reasons and the differences from the
/// demonstration.
fn drawn(mut image: RgbImage, found: &[Found], wording: &Wording<'_>) -> RgbImage {
    let detections = || found.iter().map(|found| &found.detection);
    let refused: Vec<_> = wording.explained(detections()).into_iter().map(|idx| &found[idx].detection).collect();
    let differences: Vec<_> = wording.detector.differences(&image, &refused).into_iter().flatten().collect();
    let parts: Vec<_> = detections().map(|detection| detection.bbox).collect();
    let legend = drawing::draw_differences(&mut image, &differences, &parts);
    drawing::draw_region(&mut image, wording.detector.region());
    let reasons: Vec<_> = refused.iter().map(|detection| (*detection, wording.reasons(detection, 1))).collect();
    drawing::draw_detections(&mut image, detections(), wording.min_score, &reasons, legend);
    image
}

/// An image and its detections.
struct Seen {
    size: [u32; 2],
    seconds: f64,
    detections: Vec<Found>,
}

impl Seen {
    fn accepted(&self, min_score: f64) -> impl Iterator<Item = &Found> {
        self.detections.iter().filter(move |found| found.detection.score >= min_score)
    }

    fn wording<'a>(&self, detector: &'a Perception, min_score: f64) -> Wording<'a> {
        Wording { detector, picture_size: self.size, min_score, paint: Paint::stdout() }
    }

    fn write(&self, out: &mut impl Write, args: &DetectArgs, detector: &Perception, name: &str) -> Result<()> {
        let wording = self.wording(detector, args.min_score);
        let refused: Vec<&GraspDetection> =
            self.detections.iter().map(|found| &found.detection).filter(|found| !wording.is_accepted(found)).collect();
        let listed: Vec<&Found> =
            self.detections.iter().filter(|found| args.all || wording.is_accepted(&found.detection)).collect();
        let detections: Vec<&GraspDetection> = listed.iter().map(|found| &found.detection).collect();
        let touched = wording.touched(&detections);
        if args.json {
            let record = |(found, touched): (&&Found, Vec<usize>)| PictureRecord {
                found: FoundRecord::new(found, detector),
                size: detector.size_of(&found.detection, self.size),
                advice: found.detection.advice().map(advice_with_options),
                jaws_touch: touched,
            };
            let line = ImageLine {
                image: name,
                object: detector.model().object(),
                width: self.size[0],
                height: self.size[1],
                seconds: self.seconds,
                region: detector.region().map(RegionRecord::of),
                num_refused: refused.len(),
                detections: listed.iter().zip(touched).map(record).collect(),
            };
            writeln!(out, "{}", json_line(&line)?)?;
            return Ok(());
        }
        if refused.len() == self.detections.len() {
            writeln!(out, "{name}: {}", wording.nothing(&refused, args.all))?;
        }
        for (found, touched) in listed.iter().zip(touched) {
            let touched: Vec<&GraspDetection> = touched.into_iter().map(|idx| detections[idx]).collect();
            writeln!(out, "{name}: {}", wording.line(found, &touched))?;
        }
        Ok(())
    }
}

/// One line of `--json` (docs/command-line.md).
#[derive(Serialize)]
struct ImageLine<'a> {
    image: &'a str,
    /// Name of the part that the model detects.
    object: &'a str,
    width: u32,
    height: u32,
    seconds: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    region: Option<RegionRecord>,
    num_refused: usize,
    detections: Vec<PictureRecord>,
}

/// A detection with values that explain it.
#[derive(Serialize)]
struct PictureRecord {
    #[serde(flatten)]
    found: FoundRecord,
    /// Size of the part relative to its nominal size.
    #[serde(skip_serializing_if = "Option::is_none")]
    size: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    advice: Option<String>,
    /// Indices, in the list of detections, of the parts that the jaws would touch.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    jaws_touch: Vec<usize>,
}

/// One line of `--json` for a picture that cannot be used.
#[derive(Serialize)]
struct ErrorLine {
    image: String,
    error: String,
}
