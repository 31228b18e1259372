//! The arguments of `sdg detect`.

use std::path::PathBuf;

use clap::Args as ClapArgs;
use sdg_camera::Address;
use sdg_cell::DEFAULT_MIN_SCORE;

use crate::live_pictures::RequestArgs;
use crate::shared_args::{ComputeArgs, RegionArg, SizeTolerance, region_or_all, share, size_tolerance};

/// Where an angle is zero and which way it grows, drawn.
const ANGLES_HELP: &str = "\
Angles:
  The angle of a grasp is the direction from the first marked point to the second; the jaws close across it.

              -90
               |
      +-180 ---+---> 0 degrees, to the right of the picture
               |
               v     angles grow clockwise, as seen
          90, down";

/// `sdg detect`
#[derive(Debug, ClapArgs)]
#[command(after_long_help = ANGLES_HELP)]
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
    /// Search only this part of each picture: left edge, upper edge, width and height in its pixels; the word "all" searches all of it;
    /// without it, the part that the model was taught with. A part counts whose grasp point lies in it and at least half of the part
    #[arg(long, value_name = "X,Y,W,H|all", allow_hyphen_values = true, value_parser = region_or_all)]
    pub region: Option<RegionArg>,
    /// Accept detections that score at least so much; more for fewer wrong ones, less for fewer missed ones
    #[arg(long, value_name = "SCORE", default_value_t = DEFAULT_MIN_SCORE, value_parser = share)]
    pub min_score: f64,
    /// Also list detections scored below that, with what speaks against them
    #[arg(long)]
    pub all: bool,
    /// A JSON line for each image
    #[arg(long)]
    pub json: bool,
    /// Write each image with its grasps drawn on it into this folder, under what was refused marks where edges, surface and features differ
    /// from the photo; with --from, show them in browsers at this port of 127.0.0.1 instead, 0 for any
    #[arg(long, value_name = "DIR|PORT")]
    pub draw: Option<PathBuf>,
    /// Images (PNG, JPEG, WebP, BMP, TIFF), folders of them, or - for one on standard input
    #[arg(required_unless_present = "from", value_name = "IMAGE|DIR|-")]
    pub images: Vec<PathBuf>,
    /// Live pictures instead of images, until Ctrl-C: v4l:, v4l:/dev/video0, v4l:NAME, http://HOST/PATH, 'cmd:PROGRAM ARGUMENTS',
    /// dir:FOLDER, file:PATH or sim:PART. Parts are followed from frame to frame, or searched for in each with --every-frame;
    /// --json prints a line for each frame
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
