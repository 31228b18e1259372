//! The arguments of `sdg evaluate`.

use std::path::PathBuf;

use clap::Args as ClapArgs;
use sdg_grasp::ComputeBackend;

use super::sharing_args::SharingArgs;
use super::split_args::{SPLIT_HELP, SplitArgs};
use crate::shared_args::{backend, share};

/// Help on the input and output of `sdg evaluate --pictures`.
const PICTURES_HELP: &str = "\
Labelled pictures (--pictures DIR):
  DIR contains pictures (PNG, JPEG, WebP, BMP, TIFF) and their labels: LabelMe (a JSON file of the same name beside each picture)
  or COCO (one JSON file with `images` and `annotations`) or truth.json; with truth.json, other labels are ignored
  (docs/file-formats.md). Each instance of the part has a box or an outline and the two points of the grasp, grasp_start and
  grasp_end; in LabelMe its shapes have the same group_id. An instance flagged `optional` (LabelMe: in `flags`; COCO: in `attributes`)
  counts neither as missed nor as wrong, and may lack the grasp. A picture with labels but without instances is a picture without
  the part. Pictures that the model was taught from are left out. Subfolders are not searched: run the command once per folder.

  A hit is a detection within 4 % of the instance's diagonal and within 10 degrees of the marks; rotations after which the part looks the
  same (`sdg teach --symmetry`) are equivalent. Detections are matched to instances one to one, highest score first. The diagonal
  is that of the demonstration's box, scaled by the length of the instance's marks over that of the demonstration's; truth.json
  states diagonal and symmetry of each instance. A picture is clean if it has a correct detection and no wrong one;
  a picture with optional instances only needs no detection.

  --json prints one object: found, parts, missed, wrong, optional_found, optional, clean, pictures_with_part, false_alarms,
  pictures_without_part (counts); errors {median_px, median_percent, median_deg, p95_px, p95_percent, p95_deg} or null;
  pictures [{image, outcome: right|missed|wrong|quiet|false_alarm, found, parts, missed, wrong, clean, false_alarm,
  seconds, instances [{grasp: {x, y, angle_deg, diagonal_px} or null, box, optional, found}], detections [{hit: {instance,
  error: {px, percent, deg} or null} or null, detection: as `sdg detect --json`, in pixels}]}]; by_kind [{kind, found, parts, wrong,
  false_alarms, pictures_without_part}], empty unless truth.json names kinds; by_min_score [{min_score, found, wrong, clean, false_alarms}]; left_out [{file, why}]; other_labels;
  foreign_label (of all instances, if it is not the model's part: they count as the part) or null; report;
  label_offset {agreeing {count, of}, along_percent, across_percent, px, turn_deg, totals}, if the labels mark another grasp on the part.
  The exit code is 3 if parts are marked and nothing was detected.";

/// Number of pictures of each part with it, and without it.
pub const DEFAULT_PICTURES: u32 = 25;

/// `sdg evaluate`
#[derive(Debug, ClapArgs)]
#[command(after_long_help = format!("{PICTURES_HELP}\n\n{SPLIT_HELP}"))]
pub struct EvaluateArgs {
    /// Test a taught model on your own labelled pictures: a folder of pictures with LabelMe or COCO labels or
    /// truth.json. The end of --help describes the labels and the counts
    #[arg(
        long,
        value_name = "DIR",
        requires = "grasp_model",
        conflicts_with_all = [
            "models", "objects", "attempts", "views", "scenes", "unverified", "preset", "steps", "time_budget",
            "seed", "jobs", "out",
            "axes", "cameras",
        ],
        help_heading = PICTURES
    )]
    pub pictures: Option<PathBuf>,
    /// The grasp model to test, written by `sdg teach`
    #[arg(long, value_name = "FILE", requires = "pictures", help_heading = PICTURES)]
    pub grasp_model: Option<PathBuf>,
    /// Skip the check against the demonstration: the network alone decides and gives the poses
    #[arg(long, requires = "pictures", help_heading = PICTURES)]
    pub no_verify: bool,
    /// The calibrated camera that took the pictures, for a model taught with a camera: errors are also given in
    /// millimetres
    #[arg(long, value_name = "FILE", requires = "pictures", help_heading = PICTURES)]
    pub camera: Option<PathBuf>,
    /// Minimum score of accepted detections
    #[arg(
        long,
        default_value_t = 0.5,
        value_name = "X",
        value_parser = share,
        requires = "pictures",
        help_heading = PICTURES
    )]
    pub min_score: f64,
    /// The label of the part, if other objects are labelled too; default: the model's object
    #[arg(long, value_name = "NAME", requires = "pictures", help_heading = PICTURES)]
    pub label: Option<String>,
    /// Device for the network: flex, or one that this build adds; see sdg devices
    #[arg(
        long,
        default_value = "flex",
        value_name = "NAME",
        value_parser = backend,
        requires = "pictures",
        help_heading = PICTURES
    )]
    pub device: ComputeBackend,
    /// The grasp models, by letter or name; default: all
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = trimmed)]
    pub models: Vec<String>,
    /// The parts: names of folders in datasets/; default: the paper's eight
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = trimmed)]
    pub objects: Vec<String>,
    /// Number of grasp attempts of each model on each part
    #[arg(long, default_value_t = 10, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub attempts: u32,
    /// Number of unseen pictures of each part, for detection against the ground truth
    #[arg(
        long,
        default_value_t = DEFAULT_PICTURES,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=10_000)
    )]
    pub views: u32,
    /// Number of pictures without the part for each part, for false alarms
    #[arg(
        long,
        default_value_t = DEFAULT_PICTURES,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=10_000)
    )]
    pub scenes: u32,
    /// Also run every grasp of models A to D without the check against the demonstration
    #[arg(long)]
    pub unverified: bool,
    /// Evaluate pictures whose difficulty is raised along one axis at a time (height, tilt, slant, covered, dark, blur,
    /// tint, clutter, instances, look-alikes; "pictures": all of them), and grasps under errors (no-error, marks,
    /// mark-height, hand-eye, friction, shake; "grasps": all of them), instead of the paper's protocol. Without names:
    /// everything, on all parts
    #[arg(
        long,
        value_name = "NAMES",
        value_delimiter = ',',
        value_parser = trimmed,
        num_args = 0..=1,
        conflicts_with_all = ["unverified"],
        group = "sheet",
        help_heading = AXES
    )]
    pub axes: Option<Vec<String>>,
    /// Evaluate parts taught in the plan view of one calibrated camera on pictures of other cameras (webcam, phone,
    /// overhead), along the axes, and on parts of other sizes (other-sizes), instead of the paper's protocol. Without
    /// names: everything, by models S and C on all parts
    #[arg(
        long,
        value_name = "NAMES",
        value_delimiter = ',',
        value_parser = trimmed,
        num_args = 0..=1,
        conflicts_with_all = ["unverified", "axes"],
        group = "sheet",
        help_heading = AXES
    )]
    pub cameras: Option<Vec<String>>,
    /// Number of pictures of each part and axis, or of each part and camera
    #[arg(
        long,
        default_value_t = 20,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=10_000),
        requires = "sheet",
        help_heading = AXES
    )]
    pub axis_views: u32,
    /// Number of photos of each part for --cameras: the shipped one, and others with the part near the picture's border
    #[arg(
        long,
        default_value_t = 1,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=3),
        requires = "cameras",
        help_heading = AXES
    )]
    pub photos: u32,
    /// Number of edge points that model S compares at each pose of its search, instead of the taught number
    #[arg(
        long,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(8..=1024),
        requires = "axes",
        help_heading = AXES
    )]
    pub search_points: Option<u32>,
    /// The --out folder of another run with --axes; the results on the same pictures are compared
    #[arg(long, value_name = "DIR", requires = "axes", help_heading = AXES)]
    pub against: Option<PathBuf>,
    /// Network, training and augmentation
    #[arg(long, default_value = "edge", value_name = "NAME")]
    pub preset: String,
    /// Number of optimiser steps, instead of the preset's
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub steps: Option<u32>,
    /// Maximum seconds for training one network; with --jobs 1 each training has the whole machine
    #[arg(long, value_name = "SECS", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub time_budget: Option<u32>,
    /// Seed of all random choices
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub seed: u64,
    /// Number of teachings and rehearsals run in parallel; default: one per core
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=256))]
    pub jobs: Option<u32>,
    /// Folder for models and results; results that are already in it are kept and not computed again
    #[arg(long, default_value = "target/evaluation", value_name = "DIR")]
    pub out: PathBuf,
    /// Folder for the page; default: the folder of the results; for --pictures, target/pictures-report
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    /// Sets of pictures on both sides of a split
    #[command(flatten)]
    pub split: SplitArgs,
    /// Single units for a cluster
    #[command(flatten)]
    pub sharing: SharingArgs,
    /// End with one JSON object on standard output
    #[arg(long)]
    pub json: bool,
}

/// The heading of the options of `--axes` in the help.
const AXES: &str = "Axes and errors";

/// The heading of the options of `--pictures` in the help.
const PICTURES: &str = "Labelled pictures";

/// A name of a list, which may have a space after each comma.
fn trimmed(name: &str) -> Result<String, std::convert::Infallible> {
    Ok(name.trim().to_owned())
}
