//! `sdg detect`: planar grasps in images.

use std::io::Write;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use image::{ImageFormat, RgbImage};
use sdg_grasp::{DetectionRecord, GraspDetection, Verification};
use sdg_report::write_atomically;
use serde::Serialize;

use crate::args::DetectArgs;
use crate::commands::devices;
use crate::exit::Outcome;
use crate::files;
use crate::pictures;

/// Every image gets its line; the first one that cannot be read ends the run, after the lines before it.
pub fn run(args: &DetectArgs) -> Result<Outcome> {
    let model = files::read_model(&args.grasp_model, &devices::open(&args.compute)?)?;
    if let Some(folder) = &args.draw {
        files::prepare_folder(folder)?;
    }
    let verification = if args.no_verify { Verification::Off } else { Verification::ByShape };
    let mut stdout = std::io::stdout().lock();
    let mut found_any = false;
    for path in &args.images {
        let image = files::read_image(path)?;
        let start = Instant::now();
        let mut detections = model.detect(&image, verification).with_context(|| path.display().to_string())?;
        let seconds = start.elapsed().as_secs_f64();
        found_any |= detections.iter().any(GraspDetection::is_accepted);
        if let Some(folder) = &args.draw {
            draw(folder, path, &image, &detections)?;
        }
        if !args.all {
            detections.retain(GraspDetection::is_accepted);
        }
        if args.json {
            let line = ImageLine::new(path, &image, seconds, &detections);
            writeln!(stdout, "{}", serde_json::to_string(&line)?)?;
        } else {
            write_text(&mut stdout, path, &detections)?;
        }
    }
    Ok(if found_any { Outcome::Done } else { Outcome::NothingToGrasp })
}

fn write_text(out: &mut impl Write, path: &Path, detections: &[GraspDetection]) -> Result<()> {
    if detections.is_empty() {
        writeln!(out, "{}: nothing to grasp", path.display())?;
    }
    for detection in detections {
        let grasp = detection.grasp;
        let agreement = detection.agreement.map(|a| format!(", agreement {a:.2}")).unwrap_or_default();
        writeln!(
            out,
            "{}: grasp at ({:.1}, {:.1}), {:.1}°, {:.1} px wide; score {:.2} (network {:.2}{agreement}; turn by {})",
            path.display(),
            grasp.x,
            grasp.y,
            grasp.angle.degrees(),
            grasp.width,
            detection.score,
            detection.network_score,
            detection.turn_source.name(),
        )?;
    }
    Ok(())
}

/// Writes the image with its detections as PNG, under its own name.
fn draw(folder: &Path, path: &Path, image: &RgbImage, detections: &[GraspDetection]) -> Result<()> {
    let drawn = pictures::with_detections(image, detections);
    let mut png = std::io::Cursor::new(Vec::new());
    drawn.write_to(&mut png, ImageFormat::Png)?;
    let name = Path::new(path.file_name().unwrap_or_default()).with_extension("png");
    Ok(write_atomically(&folder.join(name), &png.into_inner())?)
}

/// A line of `--json`; the names are the contract's.
#[derive(Serialize)]
struct ImageLine {
    image: String,
    width: u32,
    height: u32,
    seconds: f64,
    detections: Vec<DetectionRecord>,
}

impl ImageLine {
    fn new(path: &Path, image: &RgbImage, seconds: f64, detections: &[GraspDetection]) -> Self {
        Self {
            image: path.display().to_string(),
            width: image.width(),
            height: image.height(),
            seconds,
            detections: detections.iter().map(DetectionRecord::from).collect(),
        }
    }
}
