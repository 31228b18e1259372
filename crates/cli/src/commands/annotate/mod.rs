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
    /// Photos of one part (PNG, JPEG, WebP, BMP, TIFF). Marks are read from and written to the file of the same name with .json, or
    /// to ANNOTATION; another tool's file is read and left as it is. With --from, one that is not there yet is the name
    /// of the photo that is taken
    ///
    /// A photo is opened again where it was left, with its versions of the model, corrections and tried pictures
    /// (IMAGE.sdg-project.json beside it says what is what); nothing else of its folder is taken in
    ///
    /// Or one folder, DIR: a project likewise (sdg-project.json in it). In a new one the pictures that have marks beside them are
    /// photos of the part, the others pictures to try; without any marks the page asks which picture is the photo
    ///
    /// Without IMAGE, DIR and --from the page offers the projects that were opened before, and makes a new one in the current folder
    /// of a photo that is dropped on it
    #[arg(value_name = "IMAGE[:ANNOTATION] | DIR")]
    pub images: Vec<String>,
    /// Live pictures, to take photos on the page and to try the model on: v4l:, v4l:/dev/video2, http://HOST/PATH,
    /// 'cmd:PROGRAM ARGUMENTS', dir:FOLDER, file:PATH or sim:PART. Photos are written as photo.png, photo-2.png … into the current
    /// folder, or as IMAGE
    #[arg(long, value_name = "ADDRESS", help_heading = "Live pictures")]
    pub from: Option<Address>,
    /// A picture, or a folder of pictures, to try the taught model on; repeat for several. The page takes more
    #[arg(long = "try", value_name = "PATH")]
    pub trial_pictures: Vec<PathBuf>,
    /// Where a model taught on the page is written; without it, beside the first photo under the part's name
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Port on 127.0.0.1; without it, any that is free
    #[arg(long, default_value_t = 0, hide_default_value = true, value_name = "N")]
    pub port: u16,
    /// File with the key to the page, which is made where there is none, readable by you alone; with the same --port, a page that was
    /// left open goes on when the program is started again
    #[arg(long, value_name = "FILE", requires = "port")]
    pub token_file: Option<PathBuf>,
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
