//! `sdg detect`: planar grasps in images.

mod args;
mod live;

use std::io::Write;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use image::{ImageFormat, RgbImage};
use sdg_calibration::Frame;
use sdg_grasp::{CheckConfig, GraspDetection, Verification};
use sdg_report::write_atomically;
use serde::Serialize;

pub use args::DetectArgs;

use crate::commands::devices;
use crate::exit::{Outcome, Usage, one_line};
use crate::files;
use crate::found_record::FoundRecord;
use crate::found_text::in_words;
use crate::picture_detector::{Found, PictureDetector};
use crate::pictures;

/// Every image gets its line; one that cannot be read gets its error, and the next one its turn.
pub fn run(args: &DetectArgs) -> Result<Outcome> {
    if args.from.is_none() && (args.frames.is_some() || args.every_frame) {
        return Err(
            Usage("--frames and --every-frame: expected live pictures (--from), found images".to_owned()).into()
        );
    }
    if args.from.is_some() && !args.images.is_empty() {
        return Err(Usage("--from: expected live pictures instead of images, found images as well".to_owned()).into());
    }
    let mut model = files::read_model(&args.grasp_model, &devices::open(&args.compute)?)?;
    for lack in model.lacks() {
        eprintln!("{}: {lack}", args.grasp_model.display());
    }
    if let Some(tolerance) = args.size_tolerance {
        model = model.with_size_tolerance(tolerance.range())?;
    }
    if args.max as usize != CheckConfig::DEFAULT_MAX_DETECTIONS {
        model = model.with_max_detections(args.max as usize)?;
    }
    let detector = PictureDetector::new(model, &args.grasp_model, args.camera.as_deref())?;
    if let Some(address) = &args.from {
        return live::run(args, address, detector);
    }
    if let Some(folder) = &args.draw {
        files::prepare_folder(folder)?;
    }
    let mut stdout = std::io::stdout().lock();
    let (mut found_any, mut failed) = (false, 0);
    for path in &args.images {
        match detect(args, &detector, path) {
            Ok(seen) => {
                found_any |= seen.detections.iter().any(|found| found.detection.is_accepted());
                seen.write(&mut stdout, args, &detector, path)?;
            }
            Err(error) => {
                failed += 1;
                let error = one_line(&error);
                if args.json {
                    let line = ErrorLine { image: path.display().to_string(), error };
                    writeln!(stdout, "{}", serde_json::to_string(&line)?)?;
                } else {
                    stdout.flush()?;
                    eprintln!("error: {error}");
                }
            }
        }
    }
    match (failed, found_any) {
        (0, true) => Ok(Outcome::Done),
        (0, false) => Ok(Outcome::NothingToGrasp),
        _ => bail!("{failed} of {} images could not be used", args.images.len()),
    }
}

/// An image and everything that was detected in it.
struct Seen {
    size: (u32, u32),
    seconds: f64,
    detections: Vec<Found>,
}

fn detect(args: &DetectArgs, detector: &PictureDetector, path: &Path) -> Result<Seen> {
    let verification = if args.no_verify { Verification::Off } else { Verification::ByShape };
    let image = files::read_image(path)?;
    let start = Instant::now();
    let detections = detector.detect(&image, verification).with_context(|| path.display().to_string())?;
    let seconds = start.elapsed().as_secs_f64();
    if let Some(folder) = &args.draw {
        let drawn: Vec<GraspDetection> = detections.iter().map(|found| found.detection.clone()).collect();
        draw(folder, path, &image, &drawn)?;
    }
    Ok(Seen { size: image.dimensions(), seconds, detections })
}

impl Seen {
    fn write(mut self, out: &mut impl Write, args: &DetectArgs, detector: &PictureDetector, path: &Path) -> Result<()> {
        let best = self.detections.first().map(|best| best.detection.clone());
        let best_refused = best.filter(|best| !best.is_accepted());
        if !args.all {
            self.detections.retain(|found| found.detection.is_accepted());
        }
        if args.json {
            let line = ImageLine {
                image: path.display().to_string(),
                width: self.size.0,
                height: self.size.1,
                seconds: self.seconds,
                detections: self.detections.iter().map(|found| FoundRecord::new(found, detector.frame())).collect(),
            };
            writeln!(out, "{}", serde_json::to_string(&line)?)?;
            return Ok(());
        }
        if best_refused.is_some() || self.detections.is_empty() {
            let almost = best_refused.and_then(|refused| almost(&refused));
            let advice = almost.or_else(|| of_other_size(detector, self.size)).unwrap_or_default();
            writeln!(out, "{}: nothing to grasp{advice}", path.display())?;
        }
        self.detections.iter().try_for_each(|found| write_text(out, path, found, detector.frame()))
    }
}

/// What was nearly found, and the photo that would help.
fn almost(refused: &GraspDetection) -> Option<String> {
    /// Below it nothing resembles the part: advice would mislead. Chosen by hand.
    const MIN_SCORE: f64 = 0.1;
    let why = refused.refused().filter(|_| refused.score >= MIN_SCORE)?;
    let grasp = refused.grasp;
    let advice = refused.advice().map(|advice| format!("; {advice}")).unwrap_or_default();
    Some(format!("; at ({:.0}, {:.0}) something like it, score {:.2}: {why}{advice}", grasp.x, grasp.y, refused.score))
}

/// Where the picture has another number of pixels than the photo: that the part may have a size that is not looked for.
fn of_other_size(detector: &PictureDetector, (width, height): (u32, u32)) -> Option<String> {
    let PictureDetector::AnyCamera(model) = detector else { return None };
    let photo = model.demonstrations().iter().find_map(|demonstration| demonstration.marks.photo_size)?;
    (photo != [width, height] && photo != [height, width]).then(|| {
        let [photo_width, photo_height] = photo;
        let tolerance = model.size_tolerance();
        format!(
            "; it has {width}x{height} pixels and the photo had {photo_width}x{photo_height}: if one of them is cropped and \
             resized, a wider --size-tolerance than {}-{} may help",
            tolerance.start(),
            tolerance.end()
        )
    })
}

fn write_text(out: &mut impl Write, path: &Path, found: &Found, frame: Option<Frame>) -> Result<()> {
    Ok(writeln!(out, "{}: {}", path.display(), in_words(found, frame))?)
}

/// Writes the image with its detections as PNG, under its own name.
fn draw(folder: &Path, path: &Path, image: &RgbImage, detections: &[GraspDetection]) -> Result<()> {
    let drawn = pictures::with_detections(image, detections);
    let mut png = std::io::Cursor::new(Vec::new());
    drawn.write_to(&mut png, ImageFormat::Png)?;
    let name = Path::new(path.file_name().unwrap_or_default()).with_extension("png");
    Ok(write_atomically(&folder.join(name), &png.into_inner())?)
}

/// A line of `--json`; docs/command-line.md describes it.
#[derive(Serialize)]
struct ImageLine {
    image: String,
    width: u32,
    height: u32,
    seconds: f64,
    detections: Vec<FoundRecord>,
}

/// A line of `--json` for an image that cannot be used.
#[derive(Serialize)]
struct ErrorLine {
    image: String,
    error: String,
}
