//! `sdg annotate`: the annotation page.

#[cfg(feature = "annotate")]
mod recent;
#[cfg(feature = "annotate")]
mod run;

use std::path::PathBuf;

use clap::Args as ClapArgs;
use sdg_camera::Address;

#[cfg(feature = "annotate")]
pub use run::run;

use crate::live_pictures::RequestArgs;
use crate::shared_args::TaughtCameraArgs;

/// `sdg annotate`
#[derive(Debug, ClapArgs)]
pub struct AnnotateArgs {
    /// Photos of one part (PNG, JPEG, WebP, BMP, TIFF). Marks are read from the file beside the photo as by sdg teach,
    /// or from ANNOTATION, and written to the file of the photo's name with .json, or to ANNOTATION; files of other
    /// tools are read and never changed. The project records ANNOTATION: as long as it exists, the marks are read from
    /// it when the photo is opened without it. With --from, an IMAGE that does not exist yet names the photo to be
    /// taken.
    ///
    /// A photo is reopened in its last state, with its versions of the model, corrections and tried pictures, as
    /// recorded in IMAGE.sdg-project.json beside it; other files of its folder are ignored.
    ///
    /// Instead, DIR: one folder with a project in it (sdg-project.json). In a new project, pictures with marks beside
    /// them (in a text file: with a grasp) are photos of the part and other pictures are pictures to try; if no picture
    /// has marks, the page asks which picture is the photo.
    ///
    /// Without IMAGE, DIR and --from, the page lists recent projects, and creates a new one in the current folder from
    /// a photo dropped on it
    #[arg(value_name = "IMAGE[:ANNOTATION] | DIR")]
    pub images: Vec<String>,
    /// Live pictures, for taking photos on the page and for trying the model: v4l:, v4l:/dev/video2, http://HOST/PATH,
    /// 'cmd:PROGRAM ARGUMENTS', dir:FOLDER, file:PATH or sim:PART. Photos are written to photo.png, photo-2.png … in
    /// the current folder, or to IMAGE
    #[arg(long, value_name = "ADDRESS", help_heading = "Live pictures")]
    pub from: Option<Address>,
    /// A picture, or a folder of pictures, to try the taught model on; repeat for several. More can be added on the
    /// page
    #[arg(long = "try", value_name = "PATH")]
    pub trial_pictures: Vec<PathBuf>,
    /// File for a model taught on the page; default: beside the first photo, named after the part
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Port on 127.0.0.1; default: any free port
    #[arg(long, default_value_t = 0, hide_default_value = true, value_name = "N")]
    pub port: u16,
    /// File with the page's access token, created if missing and readable only by you. With the same --port, a page
    /// that is still open reconnects when the program is restarted
    #[arg(long, value_name = "FILE", requires = "port")]
    pub token_file: Option<PathBuf>,
    /// Network, training and augmentation
    #[arg(long, default_value = "edge", value_name = "NAME")]
    pub preset: String,
    /// The calibrated camera that took the photos
    #[command(flatten)]
    pub camera: TaughtCameraArgs,
    /// Print the address and do not open a browser
    #[arg(long)]
    pub no_browser: bool,
    /// Print the address as one JSON object
    #[arg(long)]
    pub json: bool,
    /// Settings of the camera; with --camera, the size is that of its file
    #[command(flatten)]
    pub request: RequestArgs,
}
