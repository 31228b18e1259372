//! The arguments of `sdg detect`.

use std::path::PathBuf;

use clap::Args as ClapArgs;
use sdg_camera::Address;
use sdg_cell::DEFAULT_MIN_SCORE;

use crate::live_pictures::RequestArgs;
use crate::shared_args::{ComputeArgs, RegionArg, SizeTolerance, region_or_all, share, size_tolerance};

/// Drawing of the zero angle and the direction in which angles grow.
const ANGLES_HELP: &str = "\
Angles:
  The angle of a grasp is the direction from the first marked point to the second; the jaws close across it.

              -90
               |
      +-180 ---+---> 0 degrees, to the right of the picture
               |
               v     angles increase clockwise
          90, down";

/// `sdg detect`
#[derive(Debug, ClapArgs)]
#[command(after_long_help = ANGLES_HELP)]
pub struct DetectArgs {
    /// A grasp model written by `sdg teach`
    #[arg(long, value_name = "FILE")]
    pub grasp_model: PathBuf,
    /// Device for the network
    #[command(flatten)]
    pub compute: ComputeArgs,
    /// Skip the check against the demonstration: the network alone decides and gives the poses
    #[arg(long)]
    pub no_verify: bool,
    /// Maximum number of parts per image, highest scores first
    #[arg(long, default_value_t = 100, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub max: u32,
    /// Smallest and largest size of the part relative to the photo, instead of the taught values
    #[arg(long, value_name = "LOW-HIGH", value_parser = size_tolerance)]
    pub size_tolerance: Option<SizeTolerance>,
    /// The calibrated camera that took the pictures: grasps are also given in metres, and parts of a different size are
    /// refused. For models taught with a camera; that camera may be a different one
    #[arg(long, value_name = "FILE", conflicts_with = "size_tolerance")]
    pub camera: Option<PathBuf>,
    /// Search only this part of each picture: left edge, upper edge, width and height in its pixels; "all" searches the
    /// whole picture; default: the region that the model was taught with. A part counts if its grasp point and at least
    /// half of its area are in the region
    #[arg(long, value_name = "X,Y,W,H|all", allow_hyphen_values = true, value_parser = region_or_all)]
    pub region: Option<RegionArg>,
    /// Minimum score of accepted detections; a higher value gives fewer wrong and more missed parts. Not for tracked
    /// parts: with --from, it needs --every-frame
    #[arg(long, value_name = "SCORE", default_value_t = DEFAULT_MIN_SCORE, value_parser = share)]
    pub min_score: f64,
    /// Also list refused detections, with the reasons; with --from, lost parts, or refused detections with
    /// --every-frame
    #[arg(long)]
    pub all: bool,
    /// Print one JSON line per image
    #[arg(long)]
    pub json: bool,
    /// Write each image with its grasps to this folder; refused detections show marks where edges, surface and features
    /// differ from the photo, except with --camera and under a slanted camera. With --from, serve the pictures to
    /// browsers at this port of 127.0.0.1 instead (0: any free port)
    #[arg(long, value_name = "DIR|PORT")]
    pub draw: Option<PathBuf>,
    /// Images (PNG, JPEG, WebP, BMP, TIFF), folders of images, or - for one image from standard input
    #[arg(required_unless_present = "from", value_name = "IMAGE|DIR|-")]
    pub images: Vec<PathBuf>,
    /// Live pictures instead of images, until Ctrl-C: v4l:, v4l:/dev/video0, v4l:NAME, http://HOST/PATH, 'cmd:PROGRAM
    /// ARGUMENTS', dir:FOLDER, file:PATH or sim:PART. Parts are tracked from frame to frame, or searched for in each
    /// frame with --every-frame; --json prints one line per frame
    #[arg(long, value_name = "ADDRESS", help_heading = "Live pictures")]
    pub from: Option<Address>,
    /// Stop after this number of frames
    #[arg(long, value_name = "N", help_heading = "Live pictures")]
    pub frames: Option<u64>,
    /// Search every frame independently; parts are not tracked
    #[arg(long, help_heading = "Live pictures")]
    pub every_frame: bool,
    /// Settings of the camera
    #[command(flatten)]
    pub request: RequestArgs,
}
