//! The arguments: what each command takes, with its help.

use std::path::PathBuf;

use clap::{Args as ClapArgs, Parser, Subcommand};
use sdg_camera::Address;
use sdg_geometry::RotationalSymmetry;
use sdg_grasp::ComputeBackend;

use crate::commands::camera::CameraCommand;
use crate::live_pictures::RequestArgs;

/// Teach a robot a grasp from one photo, on an ordinary computer.
#[derive(Debug, Parser)]
#[command(name = "sdg", version, propagate_version = true, arg_required_else_help = true)]
pub struct Args {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The verbs.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// The main job on shipped input: teach one object from one photo, then grasp it in simulation
    Demo(DemoArgs),
    /// Mark the grasp on photos in the browser, see what will be learnt, teach and try
    Annotate(AnnotateArgs),
    /// Demonstrations to a grasp model in one file
    Teach(TeachArgs),
    /// Planar grasps in images
    Detect(DetectArgs),
    /// Grasp attempts in MuJoCo
    Rehearse(RehearseArgs),
    /// The paper's protocol: every model on every part, and the paper's tables; or a model on your own labelled pictures
    Evaluate(EvaluateArgs),
    /// Augmented samples as pictures and COCO JSON, to look at
    Augment(AugmentArgs),
    /// Annotation files from one tool's format to another's
    Annotation(AnnotationArgs),
    /// Detectron2 and torchvision checkpoints: convert, inspect, verify
    Weights(WeightsArgs),
    /// Cameras: calibrate them, and look through them
    #[command(subcommand)]
    Camera(CameraCommand),
    /// A completion script for your shell, on standard output
    Completions(CompletionsArgs),
    /// Manual pages
    Man(ManArgs),
    /// What this build and this machine can compute on
    Devices(DevicesArgs),
}

/// `sdg devices`
#[derive(Debug, ClapArgs)]
pub struct DevicesArgs {
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// `sdg demo`
#[derive(Debug, ClapArgs)]
pub struct DemoArgs {
    /// The object: one of those shipped under datasets/
    #[arg(long, default_value = "pendulum", value_name = "NAME")]
    pub object: String,
    /// Grasp attempts
    #[arg(long, default_value_t = 10, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub attempts: u32,
    /// Decides every random choice
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub seed: u64,
    /// Seconds that the network's training may take at most
    #[arg(long, value_name = "SECS", value_parser = seconds)]
    pub time_budget: Option<f64>,
    /// Folder for the report
    #[arg(long, default_value = "report", value_name = "DIR")]
    pub out: PathBuf,
    /// End with one JSON object on standard output
    #[arg(long)]
    pub json: bool,
}

/// `sdg annotate`
#[derive(Debug, ClapArgs)]
pub struct AnnotateArgs {
    /// Photos of one part, PNG or JPEG. Marks are read from and written to the file of the same name with .json, or
    /// to ANNOTATION; another tool's file is read and left as it is. With --from, one that is not there yet is the name
    /// of the photo that is taken
    #[arg(required_unless_present = "from", value_name = "IMAGE[:ANNOTATION]")]
    pub images: Vec<String>,
    /// Live pictures, to take photos on the page and to try the model on: v4l:, v4l:/dev/video2, http://HOST/PATH,
    /// 'cmd:PROGRAM ARGUMENTS', dir:FOLDER, file:PATH or sim:PART. Photos are written as photo.png, photo-2.png … into the current
    /// folder, or as IMAGE
    #[arg(long, value_name = "ADDRESS", help_heading = "Live pictures")]
    pub from: Option<Address>,
    /// A picture, or a folder of pictures, to try the taught model on; repeat for several. The page takes more
    #[arg(long = "try", value_name = "PATH")]
    pub scenes: Vec<PathBuf>,
    /// Where a model taught on the page is written; without it, beside the first photo under the part's name
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Port on 127.0.0.1; without it, any that is free
    #[arg(long, default_value_t = 0, hide_default_value = true, value_name = "N")]
    pub port: u16,
    /// Network, training and augmentation
    #[arg(long, default_value = "edge", value_name = "NAME")]
    pub preset: String,
    /// The calibrated camera that took the photos
    #[command(flatten)]
    pub camera: TaughtCameraArgs,
    /// Print the address and leave the browser to you
    #[arg(long)]
    pub no_browser: bool,
    /// Print the address as one JSON object
    #[arg(long)]
    pub json: bool,
    /// What the camera is asked for; with --camera, its size is that file's
    #[command(flatten)]
    pub request: RequestArgs,
}

/// The camera that took the photos to teach from.
#[derive(Debug, ClapArgs)]
pub struct TaughtCameraArgs {
    /// The calibrated camera that took the photos, as ROS's camera_info YAML with the camera's pose over the table: the model
    /// then knows the part's size and works with every calibrated camera
    #[arg(id = "camera", long = "camera", value_name = "FILE", requires = "mark_height_mm")]
    pub file: Option<PathBuf>,
    /// Height of the marks over the table: of the surface that they lie on, not of the table
    #[arg(long, value_name = "MM", value_parser = height_mm, requires = "camera")]
    pub mark_height_mm: Option<f64>,
    /// Height over the table at which the gripper closes; without it, half of the marks' height
    #[arg(long, value_name = "MM", value_parser = height_mm, requires = "camera")]
    pub grasp_height_mm: Option<f64>,
}

impl TaughtCameraArgs {
    /// Heights over the table of the marks and of the grasp, in metres.
    pub fn heights_m(&self) -> [f64; 2] {
        let mark = self.mark_height_mm.unwrap_or_default();
        [mark, self.grasp_height_mm.unwrap_or(0.5 * mark)].map(|height| 1e-3 * height)
    }
}

/// `sdg teach`
#[derive(Debug, ClapArgs)]
pub struct TeachArgs {
    /// The grasp model: A (box, turn from its crop), B (box, turn from keypoints), C (keypoints), D (mask, turn from
    /// texture or outline) or S (no network: the demonstration looked for in the whole image, ready at once)
    #[arg(long, default_value = "C", value_name = "LETTER")]
    pub model: String,
    /// A photo and its annotation (COCO, LabelMe, YOLO-pose, OpenDR's boxes_*.npy); repeat for several views
    #[arg(long = "demo", required = true, value_name = "IMAGE:ANNOTATION")]
    pub demonstrations: Vec<String>,
    /// The file to write
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Network, training and augmentation: edge; r50-detectron2 or r50-torchvision with --base-weights; paper, which
    /// takes hours
    #[arg(long, default_value = "edge", value_name = "NAME")]
    pub preset: String,
    /// Decides every random choice
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub seed: u64,
    /// Seconds that the network's training may take at most
    #[arg(long, value_name = "SECS", value_parser = seconds)]
    pub time_budget: Option<f64>,
    /// How often the part looks the same in a whole turn: 1 for most, 4 for a square, full for a disc
    #[arg(long, default_value = "1", value_name = "N|full", value_parser = symmetry)]
    pub symmetry: RotationalSymmetry,
    /// Smallest and largest size of the part in a picture, over its size in the photo: 0.95-1.05 where the camera always has
    /// the same height, which also tells parts that differ in size; more where it does not, or where the photo was both
    /// cropped and resized
    #[arg(long, default_value = "0.75-1.35", value_name = "LOW-HIGH", value_parser = size_tolerance)]
    pub size_tolerance: SizeTolerance,
    /// The calibrated camera that took the photos
    #[command(flatten)]
    pub camera: TaughtCameraArgs,
    /// Optimiser steps instead of the preset's
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub steps: Option<u32>,
    /// Weights to start from: base weights of `make base-weights`, any file that `sdg weights convert` reads or writes, a
    /// grasp model, or none
    #[arg(long, value_name = "FILE")]
    pub base_weights: Option<PathBuf>,
    /// Start this part from nothing all the same, such as roi_heads.box_predictor; repeat for several
    #[arg(long = "reinit", value_name = "PREFIX", requires = "base_weights")]
    pub reinitialized: Vec<String>,
    /// Folder for a page about the teaching: photo and marks, samples, curves
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    /// Where the network computes
    #[command(flatten)]
    pub compute: ComputeArgs,
    /// End with one JSON object on standard output
    #[arg(long)]
    pub json: bool,
}

/// `sdg detect`
#[derive(Debug, ClapArgs)]
pub struct DetectArgs {
    /// A grasp model that `sdg teach` wrote
    #[arg(long, value_name = "FILE")]
    pub grasp_model: PathBuf,
    /// Where the network computes
    #[command(flatten)]
    pub compute: ComputeArgs,
    /// Leave out the check against the demonstration: the network alone decides and places
    #[arg(long)]
    pub no_verify: bool,
    /// Most parts to find in an image, the surest first
    #[arg(long, default_value_t = 100, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub max: u32,
    /// Smallest and largest size of the part over its size in the photo, instead of what it was taught with
    #[arg(long, value_name = "LOW-HIGH", value_parser = size_tolerance)]
    pub size_tolerance: Option<SizeTolerance>,
    /// The calibrated camera that took the pictures: grasps in metres, and parts of another size refused. For models taught
    /// with a camera, this or another one
    #[arg(long, value_name = "FILE", conflicts_with = "size_tolerance")]
    pub camera: Option<PathBuf>,
    /// Also list detections scored below 0.5, with what speaks against them
    #[arg(long)]
    pub all: bool,
    /// A JSON line for each image
    #[arg(long)]
    pub json: bool,
    /// Write each image with its grasps drawn on it into this folder; with --from, show them in browsers at this port of
    /// 127.0.0.1 instead, 0 for any
    #[arg(long, value_name = "DIR|PORT")]
    pub draw: Option<PathBuf>,
    /// PNG or JPEG images
    #[arg(required_unless_present = "from", value_name = "IMAGE")]
    pub images: Vec<PathBuf>,
    /// Live pictures instead of images, until Ctrl-C: v4l:, v4l:/dev/video0, v4l:NAME, http://HOST/PATH, 'cmd:PROGRAM ARGUMENTS',
    /// dir:FOLDER, file:PATH or sim:PART. Parts are followed from frame to frame; --json prints a line for each frame
    #[arg(long, value_name = "ADDRESS", help_heading = "Live pictures")]
    pub from: Option<Address>,
    /// End after so many frames
    #[arg(long, value_name = "N", help_heading = "Live pictures")]
    pub frames: Option<u64>,
    /// Search every frame on its own, instead of following parts
    #[arg(long, help_heading = "Live pictures")]
    pub every_frame: bool,
    /// What the camera is asked for
    #[command(flatten)]
    pub request: RequestArgs,
}

/// `sdg rehearse`
#[derive(Debug, ClapArgs)]
pub struct RehearseArgs {
    /// A grasp model that `sdg teach` wrote
    #[arg(long, value_name = "FILE")]
    pub grasp_model: PathBuf,
    /// The object on the table: one of those shipped under datasets/
    #[arg(long, value_name = "NAME")]
    pub object: String,
    /// Grasp attempts
    #[arg(long, default_value_t = 10, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub attempts: u32,
    /// Decides object poses, robot starts, lights and table
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub seed: u64,
    /// Where the network computes
    #[command(flatten)]
    pub compute: ComputeArgs,
    /// The camera on the wrist: resolution, focal length and lens of this file, instead of 640x480 at 550 px without distortion;
    /// where it is the arm tells. For models taught with a camera, which then look in the plan view
    #[arg(long, value_name = "FILE")]
    pub camera: Option<PathBuf>,
    /// Leave out the check against the demonstration
    #[arg(long)]
    pub no_verify: bool,
    /// Folder for the report
    #[arg(long, default_value = "report", value_name = "DIR")]
    pub out: PathBuf,
    /// End with one JSON object on standard output
    #[arg(long)]
    pub json: bool,
}

/// What `sdg evaluate --pictures` reads and writes.
const PICTURES_HELP: &str = "\
Labelled pictures (--pictures DIR):
  DIR holds PNG or JPEG pictures and their labels: LabelMe (a JSON file of the same name beside each picture) or COCO (one
  JSON file with `images` and `annotations`). Each instance of the part has a box or an outline and the two points of the
  grasp, grasp_start and grasp_end; in LabelMe its shapes share a group_id. An instance flagged `optional` (LabelMe: in
  `flags`; COCO: in `attributes`) is neither missed nor wrong, and may lack the grasp. A picture whose labels mark nothing is one without the part.
  A picture that the model was taught from is left out. Folders are not searched for folders: call once for each.

  A hit lies within 4 % of the instance's diagonal and 10 degrees of the marks, but for turns that `sdg teach --symmetry`
  said look alike; one detection to one instance, the best score first. The diagonal is that of the demonstration's box, as
  much larger as the instance's marks are longer than the demonstration's. A picture is clean when something on it is right
  and nothing wrong.

  --json prints one object: found, parts, missed, wrong, optional_found, optional, clean, pictures_with_part, false_alarms,
  pictures_without_part (counts); errors {median_px, median_percent, median_deg, p95_px, p95_percent, p95_deg} or null;
  pictures [{image, outcome: right|missed|wrong|quiet|false_alarm, found, parts, missed, wrong, clean, false_alarm,
  seconds, instances [{grasp: {x, y, angle_deg, diagonal_px} or null, box, optional, found}], detections [{hit: {instance,
  error: {px, percent, deg} or null} or null, detection: as `sdg detect --json`}]}]; by_min_score [{min_score, found,
  wrong, clean, false_alarms}]; left_out [{file, why}]; other_labels; report.
  The exit code is 3 where parts are marked and nothing at all was detected.";

/// `sdg evaluate`
#[derive(Debug, ClapArgs)]
#[command(after_long_help = PICTURES_HELP)]
pub struct EvaluateArgs {
    /// Test a taught model on your own labelled pictures instead: a folder of pictures with LabelMe or COCO labels. The
    /// end of --help says how they are labelled and what is counted
    #[arg(
        long,
        value_name = "DIR",
        requires = "grasp_model",
        conflicts_with_all = [
            "models", "objects", "attempts", "views", "scenes", "unverified", "preset", "steps", "seed", "jobs", "out",
            "axes", "cameras",
        ],
        help_heading = PICTURES
    )]
    pub pictures: Option<PathBuf>,
    /// The grasp model to test, as `sdg teach` wrote it
    #[arg(long, value_name = "FILE", requires = "pictures", help_heading = PICTURES)]
    pub grasp_model: Option<PathBuf>,
    /// Leave out the check against the demonstration: the network alone decides and places
    #[arg(long, requires = "pictures", help_heading = PICTURES)]
    pub no_verify: bool,
    /// The calibrated camera that took the pictures, for a model taught with a camera: errors in millimetres, too
    #[arg(long, value_name = "FILE", requires = "pictures", help_heading = PICTURES)]
    pub camera: Option<PathBuf>,
    /// The least score that counts
    #[arg(
        long,
        default_value_t = 0.5,
        value_name = "X",
        value_parser = share,
        requires = "pictures",
        help_heading = PICTURES
    )]
    pub min_score: f64,
    /// The label of the part, where others are labelled too; without it, the model's object
    #[arg(long, value_name = "NAME", requires = "pictures", help_heading = PICTURES)]
    pub label: Option<String>,
    /// Where the network computes: flex, or what this build adds; see sdg devices
    #[arg(
        long,
        default_value = "flex",
        value_name = "NAME",
        value_parser = backend,
        requires = "pictures",
        help_heading = PICTURES
    )]
    pub device: ComputeBackend,
    /// The grasp models, by their letters; without it, all
    #[arg(long, value_name = "LETTERS", value_delimiter = ',')]
    pub models: Vec<String>,
    /// The parts, out of those shipped under datasets/; without it, the paper's eight
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub objects: Vec<String>,
    /// Grasp attempts of each model on each part
    #[arg(long, default_value_t = 10, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub attempts: u32,
    /// Unseen pictures of each part, for detection against the truth
    #[arg(long, default_value_t = 25, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub views: u32,
    /// Pictures for each part in which it is not, for false alarms
    #[arg(long, default_value_t = 25, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub scenes: u32,
    /// Also try every grasp without the check against the demonstration: twice the attempts
    #[arg(long)]
    pub unverified: bool,
    /// Instead of the paper's protocol: pictures made harder one axis at a time (height, tilt, covered, dark, blur, tint,
    /// clutter, instances, look-alikes; all: pictures) and grasps under errors (no-error, marks, mark-height, hand-eye,
    /// friction, shake; all: grasps). Without names, everything, on all parts
    #[arg(
        long,
        value_name = "NAMES",
        value_delimiter = ',',
        num_args = 0..=1,
        conflicts_with_all = ["unverified"],
        group = "sheet",
        help_heading = AXES
    )]
    pub axes: Option<Vec<String>>,
    /// Instead of the paper's protocol: parts taught in the plan view of one calibrated camera, on pictures of others (webcam,
    /// phone, overhead), along the axes, and of parts of other sizes (other-sizes). Without names, everything, by models S and
    /// C on all parts
    #[arg(
        long,
        value_name = "NAMES",
        value_delimiter = ',',
        num_args = 0..=1,
        conflicts_with_all = ["unverified", "axes"],
        group = "sheet",
        help_heading = AXES
    )]
    pub cameras: Option<Vec<String>>,
    /// Pictures of each part and axis, or of each part and camera
    #[arg(
        long,
        default_value_t = 20,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=10_000),
        requires = "sheet",
        help_heading = AXES
    )]
    pub axis_views: u32,
    /// Edge points that model S compares at each pose of its search, instead of as taught
    #[arg(
        long,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(8..=1024),
        requires = "axes",
        help_heading = AXES
    )]
    pub search_points: Option<u32>,
    /// The folder (--out) of another run with --axes, to compare with on the same pictures
    #[arg(long, value_name = "DIR", requires = "axes", help_heading = AXES)]
    pub against: Option<PathBuf>,
    /// Network, training and augmentation
    #[arg(long, default_value = "edge", value_name = "NAME")]
    pub preset: String,
    /// Optimiser steps instead of the preset's
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub steps: Option<u32>,
    /// Decides every random choice
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub seed: u64,
    /// Teachings and rehearsals side by side; without it, one for each core
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=256))]
    pub jobs: Option<u32>,
    /// Folder for models and results; what is in it already is not done again
    #[arg(long, default_value = "target/evaluation", value_name = "DIR")]
    pub out: PathBuf,
    /// Folder for the page; without it, the folder of the results, or target/pictures-report for --pictures
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    /// End with one JSON object on standard output
    #[arg(long)]
    pub json: bool,
}

/// The heading of the options of `--axes` in the help.
const AXES: &str = "Axes and errors";

/// The heading of the options of `--pictures` in the help.
const PICTURES: &str = "Labelled pictures";

/// `sdg augment`
#[derive(Debug, ClapArgs)]
pub struct AugmentArgs {
    /// A photo and its annotation (COCO, LabelMe, YOLO-pose, OpenDR's boxes_*.npy); repeat for several views
    #[arg(long = "demo", required = true, value_name = "IMAGE:ANNOTATION")]
    pub demonstrations: Vec<String>,
    /// Samples to write
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub count: u32,
    /// Folder to write into; made if missing
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// The augmentation: edge (what teaching uses), or paper (the original's)
    #[arg(long, default_value = "edge", value_name = "NAME")]
    pub preset: String,
    /// Decides every random choice
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub seed: u64,
    /// End with one JSON object on standard output
    #[arg(long)]
    pub json: bool,
}

/// `sdg annotation`
#[derive(Debug, ClapArgs)]
#[command(arg_required_else_help = true)]
pub struct AnnotationArgs {
    /// What to do with the annotation.
    #[command(subcommand)]
    pub command: AnnotationCommand,
}

/// The verbs of `sdg annotation`.
#[derive(Debug, Subcommand)]
pub enum AnnotationCommand {
    /// What is marked on one image, written in another format
    Convert(ConvertAnnotationArgs),
}

/// `sdg annotation convert`
#[derive(Debug, ClapArgs)]
pub struct ConvertAnnotationArgs {
    /// COCO, LabelMe, YOLO-pose (data.yaml beside or above it), OpenDR's boxes_*.npy (kps_*.npy beside it): told by content
    #[arg(value_name = "IN")]
    pub input: PathBuf,
    /// The file to write
    #[arg(value_name = "OUT")]
    pub output: PathBuf,
    /// The image, where IN is of several images or does not say how large its image is
    #[arg(long, value_name = "IMAGE")]
    pub image: Option<PathBuf>,
    /// The format to write: coco, labelme or yolo-pose; without it, coco for .json and yolo-pose for .txt
    #[arg(long, value_name = "NAME")]
    pub format: Option<String>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// `sdg completions`
#[derive(Debug, ClapArgs)]
pub struct CompletionsArgs {
    /// The shell
    #[arg(value_name = "SHELL")]
    pub shell: clap_complete::Shell,
}

/// `sdg man`
#[derive(Debug, ClapArgs)]
pub struct ManArgs {
    /// Write a page of every command into this folder; without it, the page of sdg goes to standard output
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// `sdg weights`
#[derive(Debug, ClapArgs)]
#[command(arg_required_else_help = true)]
pub struct WeightsArgs {
    /// What to do with the checkpoint.
    #[command(subcommand)]
    pub command: WeightsCommand,
}

/// The verbs of `sdg weights`.
#[derive(Debug, Subcommand)]
pub enum WeightsCommand {
    /// A checkpoint to this project's safetensors, with a report of every name
    Convert(ConvertArgs),
    /// What a checkpoint holds, without converting it
    Inspect(InspectArgs),
    /// The detector of a checkpoint, stage by stage, against what the original gave
    Verify(VerifyArgs),
}

/// `sdg weights convert`
#[derive(Debug, ClapArgs)]
pub struct ConvertArgs {
    /// Detectron2 .pkl or .pth, torchvision .pth, safetensors: told by content, not by name
    #[arg(value_name = "IN")]
    pub input: PathBuf,
    /// The file to write
    #[arg(value_name = "OUT")]
    pub output: PathBuf,
    /// The detector: r50-detectron2, r50-torchvision; without it, as the names of the checkpoint say
    #[arg(long, value_name = "NAME", conflicts_with = "config")]
    pub preset: Option<String>,
    /// The detector's configuration as JSON, for other widths and depths
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Store kernels and matrices in half precision: a file half as large
    #[arg(long)]
    pub f16: bool,
    /// Leave this part as initialised, such as roi_heads.box_predictor; repeat for several
    #[arg(long = "reinit", value_name = "PREFIX")]
    pub reinitialized: Vec<String>,
    /// Print the report as one JSON object
    #[arg(long)]
    pub json: bool,
}

/// `sdg weights inspect`
#[derive(Debug, ClapArgs)]
pub struct InspectArgs {
    /// A checkpoint of any format that convert reads
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// `sdg weights verify`
#[derive(Debug, ClapArgs)]
pub struct VerifyArgs {
    /// A checkpoint of any format that convert reads, or a converted file
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// The detector's configuration as JSON; a converted file brings its own
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// The image that the original was given
    #[arg(long, value_name = "IMAGE")]
    pub image: PathBuf,
    /// What the original gave at each stage: safetensors
    #[arg(long, value_name = "FILE")]
    pub against: PathBuf,
    /// Where the network computes
    #[command(flatten)]
    pub compute: ComputeArgs,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Where a network computes.
#[derive(Debug, ClapArgs)]
pub struct ComputeArgs {
    /// Where the network computes: flex, or what this build adds; see sdg devices
    #[arg(long, default_value = "flex", value_name = "NAME", value_parser = backend)]
    pub device: ComputeBackend,
}

/// A device's name.
fn backend(text: &str) -> Result<ComputeBackend, String> {
    text.parse().map_err(|error: sdg_grasp::GraspError| error.to_string())
}

/// Equal turns in a whole one, or that no turn can be seen.
fn symmetry(text: &str) -> Result<RotationalSymmetry, String> {
    match (text, text.parse::<u32>()) {
        ("full", _) => Ok(RotationalSymmetry::Full),
        (_, Ok(1)) => Ok(RotationalSymmetry::None),
        (_, Ok(count @ 2..=360)) => Ok(RotationalSymmetry::Fold(count)),
        _ => Err("expected 1 to 360 equal turns, or full".to_owned()),
    }
}

/// Smallest and largest size of a part over the usual one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SizeTolerance {
    /// From 0.5 to 1.
    pub low: f64,
    /// From 1 to 2.
    pub high: f64,
}

impl SizeTolerance {
    /// As a range.
    pub fn range(self) -> std::ops::RangeInclusive<f64> {
        self.low..=self.high
    }
}

/// A height over the table. A part higher than half a metre was given in another unit.
fn height_mm(text: &str) -> Result<f64, String> {
    const MAX_MM: f64 = 500.0;
    match text.parse::<f64>() {
        Ok(height) if (0.0..=MAX_MM).contains(&height) => Ok(height),
        _ => Err(format!("expected a height of 0 to {MAX_MM} millimetres, found {text}")),
    }
}

fn size_tolerance(text: &str) -> Result<SizeTolerance, String> {
    let bounds = text.split_once('-').map(|(low, high)| (low.trim().parse(), high.trim().parse()));
    match bounds {
        Some((Ok(low), Ok(high))) if (0.5..=1.0).contains(&low) && (1.0..=2.0).contains(&high) => {
            Ok(SizeTolerance { low, high })
        }
        _ => Err("expected LOW-HIGH with LOW from 0.5 to 1 and HIGH from 1 to 2, such as 0.75-1.35".to_owned()),
    }
}

/// A number from 0 to 1.
fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(share) if (0.0..=1.0).contains(&share) => Ok(share),
        _ => Err("expected a number from 0 to 1".to_owned()),
    }
}

/// A positive, finite number of seconds.
fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(secs) if secs.is_finite() && secs > 0.0 => Ok(secs),
        _ => Err("expected a positive number of seconds".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn a_size_tolerance_holds_the_usual_size() {
        assert_eq!(size_tolerance("0.75-1.35"), Ok(SizeTolerance { low: 0.75, high: 1.35 }));
        for text in ["", "0.75", "1.1-1.3", "0.9-0.95", "0.1-1.2", "0.9-3", "0.9..1.1"] {
            assert!(size_tolerance(text).unwrap_err().contains("such as 0.75-1.35"), "{text}");
        }
    }

    #[test]
    fn the_definition_is_consistent() {
        Args::command().debug_assert();
    }

    #[test]
    fn the_contract_s_calls_parse() {
        for line in [
            "sdg demo",
            "sdg demo --json",
            "sdg annotate photo.png",
            "sdg annotate --from v4l: --size 1280x720 --exposure-ms 8",
            "sdg annotate --from dir:pictures?loop part.png --camera c.yaml --mark-height-mm 12",
            "sdg annotate a.png b.png:b.json --try table --out m.sdg --port 8080 --no-browser --json",
            "sdg teach --model C --demo a.png:a.json --demo b.png:b.json --out m.sdg --preset edge --symmetry full --seed 3 --time-budget 60 --report r",
            "sdg detect --grasp-model m.sdg --json --no-verify a.png b.png",
            "sdg detect --grasp-model m.sdg --device wgpu a.png",
            "sdg devices --json",
            "sdg rehearse --grasp-model m.sdg --object pendulum --attempts 20 --seed 2",
            "sdg evaluate",
            "sdg evaluate --models B,C --objects pendulum,rod_end --attempts 2 --seed 3 --out d --report r --json",
            "sdg evaluate --axes",
            "sdg evaluate --axes tilt,covered --axis-views 3 --models S --search-points 32 --against other --json",
            "sdg evaluate --pictures d --grasp-model m.sdg",
            "sdg evaluate --pictures d --grasp-model m.sdg --no-verify --min-score 0.4 --label rod --device flex --report r --json",
            "sdg augment --demo a.png:a.json --count 5 --out samples",
            "sdg annotation convert photo.json photo.txt --image photo.png --format yolo-pose --json",
            "sdg completions bash",
            "sdg man --out pages",
            "sdg weights convert model.pkl model.safetensors --preset r50-detectron2 --f16 --reinit roi_heads --json",
            "sdg weights inspect model.pth --json",
            "sdg weights verify model.pkl --config c.json --image i.png --against expected.safetensors --json",
        ] {
            assert!(Args::try_parse_from(line.split(' ')).is_ok(), "{line}");
        }
        assert!(Args::try_parse_from(["sdg", "teach", "--demo", "a:b", "--out", "m", "--time-budget", "-1"]).is_err());
        assert!(Args::try_parse_from(["sdg", "teach", "--demo", "a:b", "--out", "m", "--symmetry", "0"]).is_err());
        for line in [
            "sdg evaluate --axis-views 3",
            "sdg evaluate --pictures d",
            "sdg evaluate --grasp-model m.sdg",
            "sdg evaluate --no-verify",
            "sdg evaluate --device flex",
            "sdg evaluate --pictures d --grasp-model m.sdg --models S",
            "sdg evaluate --pictures d --grasp-model m.sdg --views 10",
            "sdg evaluate --pictures d --grasp-model m.sdg --min-score 1.1",
        ] {
            assert!(Args::try_parse_from(line.split(' ')).is_err(), "{line}");
        }
    }
}
