//! `sdg teach`: demonstrations to a grasp model in one file.

use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use anyhow::Result;
use clap::Args as ClapArgs;
use sdg_demonstration::Demonstration;
use sdg_evaluation::held_back::HeldBackFigures;
use sdg_evaluation::teaching_page::TeachingPage;
use sdg_evaluation::{TaughtFile, quoted, taught_words};
use sdg_geometry::RotationalSymmetry;
use sdg_grasp::{CheckConfig, GraspError, NegativeFacts, Preset, SearchRegion, Start, TeachOptions};
use sdg_inputs::{TeachingFiles, base_weights, first_names};
use sdg_weights_conversion::Report;
use serde_json::{Value, json};

use crate::clock;
use crate::commands::devices;
use crate::demonstrations;
use crate::exit::{Outcome, Usage};
use crate::interrupt::Interrupt;
use crate::json_line::json_line;
use crate::paint::{Paint, Tone};
use crate::shared_args::{ComputeArgs, SizeTolerance, TaughtCameraArgs, region, seconds, size_tolerance};
use crate::teaching_progress::TeachingProgress;

/// `sdg teach`
#[derive(Debug, ClapArgs)]
pub struct TeachArgs {
    /// The grasp model, by letter or name: A or crop (detects a box, angle from the box's crop), B or box (box, angle
    /// from keypoints), C or keypoints, D or mask (mask, angle from texture or outline), S or shape (no network:
    /// searches the whole image for the demonstration; ready at once)
    #[arg(long, default_value = "C", value_name = "NAME")]
    pub model: String,
    /// A photo, followed by a colon and its annotation (COCO, LabelMe, YOLO-pose, OpenDR's boxes_*.npy). The annotation
    /// may be omitted if it is beside the photo (.json, .txt) or in a YOLO dataset's folder of labels; repeat for
    /// several views
    #[arg(long = "demo", required_unless_present = "demos", value_name = "IMAGE[:ANNOTATION]")]
    pub demonstrations: Vec<String>,
    /// Teach many parts: a folder with, for each part, a photo with marks beside it or a folder of such photos. --out
    /// is then a folder for the models and a page that lists similar parts and parts that need another photo. A part is
    /// not taught again if its model was already taught from the same files with the same arguments. Lines "NAME 4" or
    /// "NAME full" in DIR/symmetries.txt give a part's --symmetry
    #[arg(long, value_name = "DIR", conflicts_with_all = ["demonstrations", "negatives", "camera", "region"])]
    pub demos: Option<PathBuf>,
    /// Teach only this part of --demos, without the page, so that several machines can each teach some of the parts;
    /// repeat for several
    #[arg(long = "part", value_name = "NAME", requires = "demos", conflicts_with = "demonstrations")]
    pub parts: Vec<String>,
    /// A picture without the part, preferably one with a false detection. It is used in teaching, and the score is
    /// calibrated so that nothing is accepted in it, as long as nine in ten parts in held-out samples are still
    /// accepted; else a warning names it; model S is then as without it, but a network has learnt from it. Repeat for
    /// several
    #[arg(long = "negative", value_name = "IMAGE")]
    pub negatives: Vec<PathBuf>,
    /// The file to write
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Network, training and augmentation: edge; r50-detectron2 or r50-torchvision with --base-weights; paper, which
    /// takes hours
    #[arg(long, default_value = "edge", value_name = "NAME")]
    pub preset: String,
    /// Seed of all random choices
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub seed: u64,
    /// Maximum seconds for training the network
    #[arg(long, value_name = "SECS", value_parser = seconds)]
    pub time_budget: Option<f64>,
    /// Number of angles, within a full rotation, at which the part looks the same: 1 for most parts, 4 for a square,
    /// full for a disc
    #[arg(long, default_value = "1", value_name = "N|full", value_parser = symmetry)]
    pub symmetry: RotationalSymmetry,
    /// Smallest and largest size of the part in a picture, relative to its size in the photo: 0.95-1.05 if the camera's
    /// height is constant, which also distinguishes parts of different sizes; a wider range if the height varies, or if
    /// the photo was both cropped and resized. With a calibrated camera, 0.9 to 1.11 times the part's size is searched
    /// instead
    #[arg(long, default_value = "0.75-1.35", value_name = "LOW-HIGH", value_parser = size_tolerance)]
    pub size_tolerance: SizeTolerance,
    /// Search only this part of pictures: left edge, upper edge, width and height in pixels of the photo. A part counts
    /// if its grasp point and at least half of its area are in the region. The region is stored in the model file, for
    /// pictures of the photo's size
    #[arg(long, value_name = "X,Y,W,H", allow_hyphen_values = true, value_parser = region)]
    pub region: Option<SearchRegion>,
    /// The calibrated camera that took the photos
    #[command(flatten)]
    pub camera: TaughtCameraArgs,
    /// Number of optimiser steps, instead of the preset's
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub steps: Option<u32>,
    /// Initial weights: base weights made by `make base-weights`, any file that `sdg weights convert` reads or writes,
    /// a grasp model, or "none" (random initialisation); default: preset edge starts from the base weights included in
    /// this program
    #[arg(long, value_name = "FILE")]
    pub base_weights: Option<PathBuf>,
    /// Initialise this part of the network randomly in spite of --base-weights, such as roi_heads.box_predictor; repeat
    /// for several
    #[arg(long = "reinit", value_name = "PREFIX", requires = "base_weights")]
    pub reinitialized: Vec<String>,
    /// Folder for a page on the teaching: photo and marks, samples, curves
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    /// Device for the network
    #[command(flatten)]
    pub compute: ComputeArgs,
    /// End with one JSON object on standard output
    #[arg(long)]
    pub json: bool,
}

/// Parses a number of angles, or `full` for a part whose rotation is not visible.
pub(super) fn symmetry(text: &str) -> Result<RotationalSymmetry, String> {
    match (text, text.parse::<u32>()) {
        ("full", _) => Ok(RotationalSymmetry::Full),
        (_, Ok(1)) => Ok(RotationalSymmetry::None),
        (_, Ok(count @ 2..=360)) => Ok(RotationalSymmetry::Fold(count)),
        _ => Err("expected 1 to 360 equal angles, or full".to_owned()),
    }
}

/// Path, in the sources, of the base weights that this build may lack.
const SHIPPED_FILE: &str = "crates/grasp/weights/edge.safetensors";

/// Value of `--base-weights` for random initialisation.
pub(super) const NO_BASE_WEIGHTS: &str = "none";

/// Maximum number of photos named in the line of an error.
const MAX_NAMED: usize = 3;

/// The teaching options, except for the demonstrations and the initial weights.
pub(super) fn options(args: &TeachArgs) -> Result<TeachOptions> {
    let mut options = TeachOptions::new(args.seed);
    options.kind = parse("--model", &args.model)?;
    options.preset = parse("--preset", &args.preset)?;
    options.symmetry = args.symmetry;
    options.size_tolerance = args.size_tolerance.range();
    options.region = args.region;
    options.time_budget = args.time_budget.map(Duration::from_secs_f64);
    options.steps = args.steps.map(|steps| steps as usize);
    options.device = devices::open(&args.compute)?;
    Ok(options)
}

/// Teaches with progress on standard error, writes the model file, and tests the model on held-out samples.
///
/// `own` is a model file of this process that may be replaced, as in [`sdg_files::extend`].
///
/// # Errors
/// Errors of teaching as [`GraspError`]; the file cannot be written; the test fails.
pub(super) fn teach_to_file(
    demonstrations: &[Demonstration],
    options: &TeachOptions,
    (out, own): (&Path, Option<&Path>),
    interrupt: &Interrupt,
) -> Result<(TaughtFile, HeldBackFigures)> {
    let mut progress = TeachingProgress::new(interrupt.clone());
    let taught = TaughtFile::teach(demonstrations, options, &mut |event| progress.show(event));
    progress.finish();
    let file = taught?;
    sdg_files::extend(out, own, &file.bytes)?;
    let figures = file.figures(demonstrations, options.seed)?;
    Ok((file, figures))
}

/// Teaches a model and writes its file. All inputs are checked first, because the teaching can take minutes.
pub fn run(args: &TeachArgs) -> Result<Outcome> {
    let mut options = options(args)?;
    let files = TeachingFiles {
        demonstrations: &demonstrations::pairs(&args.demonstrations)?,
        negatives: &args.negatives,
        camera: args.camera.file.as_deref().map(|path| (path, args.camera.heights_m())),
    };
    let demonstrations = files.read(&mut options).map_err(of_region)?;
    // The weights are an input that the model must not replace.
    let report = read_base_weights(args, &mut options)?;
    sdg_files::check_writable(&args.out)?;
    sdg_inputs::check_replaces_a_model(&args.out)?;
    if let Some(folder) = &args.report {
        sdg_files::prepare_folder(folder)?;
    }

    let taught = teach_to_file(&demonstrations, &options, (&args.out, None), &Interrupt::watch());
    let (file, figures) = taught.map_err(|error| match error.downcast_ref() {
        Some(GraspError::Region(_)) => of_region(error),
        Some(GraspError::DemonstrationAsNegative { number }) => {
            let picture = args.negatives[number - 1].display();
            Usage(format!("--negative: expected a picture without the part, found the demonstration {picture}")).into()
        }
        Some(_) => error.context(first_names(&args.demonstrations, MAX_NAMED)),
        None => error,
    })?;
    let TaughtFile { taught, bytes, .. } = file;
    let write_page = |folder: &Path| -> Result<PathBuf> {
        let page = TeachingPage {
            taught: &taught,
            figures: &figures,
            demonstrations: &demonstrations,
            seed: args.seed,
            seconds: clock::elapsed_secs(),
            command: &command(args),
        };
        Ok(page.report()?.write(folder)?)
    };
    let page = args.report.as_deref().and_then(|folder| {
        // The model is written and tested: without the page, its results are still printed.
        let told = |error: &anyhow::Error| {
            eprintln!("{} --report: no page was written: {error:#}", Paint::stderr().text(Tone::Doubtful, "warning:"));
        };
        write_page(folder).inspect_err(told).ok()
    });

    let facts = taught.model.facts();
    let failure = figures.failure();
    if let Some(failure) = &failure {
        eprintln!("{} {failure}", Paint::stderr().text(Tone::Doubtful, "warning:"));
    }
    for warning in figures.warnings() {
        eprintln!("{} {warning}", Paint::stderr().text(Tone::Doubtful, "warning:"));
    }
    for accepted in &taught.accepted_negatives {
        let (warning, picture) = (Paint::stderr().text(Tone::Doubtful, "warning:"), &args.negatives[accepted.idx]);
        eprintln!("{warning} --negative {}: {accepted}", picture.display());
    }
    for told in taught_words::openings_by_the_box(&taught.model, &demonstrations) {
        eprintln!("{told}");
    }
    if args.json {
        let line = json!({
            "model": taught.model.kind(),
            "object": taught.model.object(),
            "preset": taught.model.preset(),
            "out": args.out.display().to_string(),
            "bytes": bytes.len(),
            "teach_seconds": facts.seconds,
            "seconds": clock::elapsed_secs(),
            "teaching": facts,
            "held_back": figures.to_json(),
            "failure": failure,
            "base_weights": report,
            "report": page.map(|path| path.display().to_string()),
        });
        println!("{}", json_line(&line)?);
    } else {
        // All the time that a person waits, not only the teaching.
        let (seconds, training) = (clock::elapsed_secs(), taught_words::training(&taught));
        let object = taught.model.object();
        println!("taught \"{object}\" in {seconds:.1} s, of which the teaching took {:.1} s{training}", facts.seconds);
        println!("{}", figures.in_words());
        let tolerance = taught.model.size_tolerance();
        let by_photo = format!("from {} to {} times the size in the photo", tolerance.start(), tolerance.end());
        if facts.lengths.is_some() {
            let known = CheckConfig::KNOWN_SIZE_TOLERANCE;
            println!(
                "with a calibrated camera, searches sizes from {} to {} times the part's size; without one, {by_photo}",
                known.start(),
                known.end()
            );
        } else {
            println!("searches sizes {by_photo}");
        }
        if let Some(region) = taught.model.region() {
            println!("searches {region} of pictures of the photo's size");
        }
        if let Some(NegativeFacts { pictures, refused, log_odds }) = facts.negatives {
            let lowered = match log_odds < 0.0 {
                true => format!("; for this, every score is lowered by {:.1} log-odds", -log_odds),
                false => String::new(),
            };
            println!("refuses {refused} of {pictures} pictures without the part{lowered}");
        }
        if let Some(lengths) = &facts.lengths {
            println!(
                "size of the part: {:.3} mm per pixel of the photo; marks {:.1} mm above the table; grasped {:.1} mm above the table",
                1e3 / lengths.pixels_per_m,
                1e3 * lengths.mark_height_m,
                1e3 * lengths.grasp_height_m
            );
        }
        if let Some(told) = taught_words::edges(&taught.model) {
            println!("{told}");
        }
        if let Some(warning) = taught_words::too_wide(&taught.model) {
            eprintln!("{warning}");
        }
        let size = match bytes.len() {
            small @ ..1_000_000 => format!("{:.0} kB", small as f64 / 1e3),
            large => format!("{:.1} MB", large as f64 / 1e6),
        };
        println!("wrote {} ({size})", args.out.display());
        if let Some(path) = page {
            println!("report: {}", path.display());
        }
    }
    Ok(if failure.is_some() { Outcome::ModelFails } else { Outcome::Done })
}

/// Adds `--region` to an error that the region caused.
fn of_region(error: anyhow::Error) -> anyhow::Error {
    match error.downcast_ref() {
        Some(GraspError::Region(_)) => error.context("--region"),
        _ => error,
    }
}

/// The command that makes the same model again.
pub(super) fn command(args: &TeachArgs) -> String {
    let mut command = format!("sdg teach --model {} --preset {} --seed {}", args.model, args.preset, args.seed);
    let mut option = |name: &str, value: String| command += &format!(" --{name} {}", quoted(&value));
    if let Some(steps) = args.steps {
        option("steps", steps.to_string());
    }
    if let Some(secs) = args.time_budget {
        option("time-budget", secs.to_string());
    }
    match args.symmetry {
        RotationalSymmetry::Fold(count) => option("symmetry", count.to_string()),
        RotationalSymmetry::Full => option("symmetry", "full".to_owned()),
        _ => {}
    }
    if args.size_tolerance.range() != CheckConfig::DEFAULT_SIZE_TOLERANCE {
        option("size-tolerance", format!("{}-{}", args.size_tolerance.low, args.size_tolerance.high));
    }
    if let Some(SearchRegion { x, y, width, height, .. }) = args.region {
        option("region", format!("{x},{y},{width},{height}"));
    }
    if let Some(camera) = &args.camera.file {
        let [mark, grasp] = args.camera.heights_m().map(|height| (1e3 * height).to_string());
        option("camera", camera.display().to_string());
        option("mark-height-mm", mark);
        option("grasp-height-mm", grasp);
    }
    if let Some(weights) = &args.base_weights {
        option("base-weights", weights.display().to_string());
    }
    args.reinitialized.iter().for_each(|part| option("reinit", part.clone()));
    args.demonstrations.iter().for_each(|demonstration| option("demo", demonstration.clone()));
    args.negatives.iter().for_each(|negative| option("negative", negative.display().to_string()));
    option("out", args.out.display().to_string());
    command + &args.compute.in_command()
}

/// Adds the initial weights to the options. Missing weights, and weights that do not fit, are rejected before the
/// teaching, which takes minutes. Returns the report about given weights, for the JSON at the end.
pub(super) fn read_base_weights(args: &TeachArgs, options: &mut TeachOptions) -> Result<Option<Value>> {
    let report = read_given_weights(args, options)?;
    *options = options.with_start_read().map_err(of_base_weights)?;
    Ok(report)
}

/// Adds `--base-weights` to an error about missing weights.
fn of_base_weights(error: GraspError) -> anyhow::Error {
    match &error {
        GraspError::NeedsBaseWeights { preset } if *preset == Preset::Edge.name() => {
            Usage(format!("--base-weights: {error}; give {SHIPPED_FILE} of the sources, or none")).into()
        }
        GraspError::NeedsBaseWeights { .. } => Usage(format!("--base-weights: {error}")).into(),
        _ => error.into(),
    }
}

/// Reads the file of `--base-weights`.
fn read_given_weights(args: &TeachArgs, options: &mut TeachOptions) -> Result<Option<Value>> {
    let Some(path) = &args.base_weights else { return Ok(None) };
    if path.as_os_str() == NO_BASE_WEIGHTS {
        options.start = Start::Nothing;
        return Ok(None);
    }
    let Some(network) = options.network() else {
        return Err(Usage(format!("--base-weights: model {} has no network for initial weights", options.kind)).into());
    };
    if let Some((own, origin)) = base_weights::read_own(path, options, &args.reinitialized)? {
        options.start = Start::Weights(own);
        if !args.json {
            let made: Vec<String> = origin.iter().map(|(name, value)| format!("{name} {value}")).collect();
            println!("base weights {}: {}", path.display(), made.join(", "));
        }
        return Ok(Some(json!(origin)));
    }
    let mut told = None;
    let base_weights = base_weights::read(path, &network, &args.reinitialized, &mut |report| {
        if !args.json {
            print!("{}", report.exceptions());
            println!("base weights {} (names of {}): {}", path.display(), report.naming, report.summary());
        }
        told = Some(report.clone());
        Ok(())
    })?;
    options.start = Start::Weights(base_weights);
    Ok(told.map(|report: Report| json!(report)))
}

/// Parses an argument with a fixed set of values; another value is wrong usage.
fn parse<T: FromStr<Err: Display>>(argument: &str, name: &str) -> Result<T> {
    Ok(name.parse().map_err(|error| Usage(format!("{argument}: {error}")))?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{Args, Command};
    use clap::Parser;

    #[test]
    fn the_command_of_the_page_repeats_the_teaching() {
        let line = ["sdg", "teach", "--demo", "my part.png", "--out", "part.sdg", "--device", "wgpu"];
        let Command::Teach(args) = Args::try_parse_from(line).unwrap().command else { panic!("another command") };
        assert_eq!(
            command(&args),
            "sdg teach --model C --preset edge --seed 1 --demo 'my part.png' --out part.sdg --device wgpu"
        );
    }
}
