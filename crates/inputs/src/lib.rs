//! Reads a user's files: photos with their marks, cameras, workcells, models, initial weights.
//!
//! ```text
//! photo, marks (COCO, LabelMe, YOLO-pose, OpenDR) ─ AnnotationFile ─ MarkedPhoto: checked against the photo ─ Demonstration
//! pictures of a board ─ BoardPicture ─ calibrations ─ CameraUpdate     robot poses ─ robot_poses::views
//! camera.yaml ─ CameraFile ─ Perception, plan views of photos     TeachingFiles: all that a model is taught from
//! model.sdg ─ GraspModel          checkpoint of any format ─ BaseWeights
//! ```
//!
//! Most errors name the file. Not in this crate: command arguments, texts of results, and outputs except for camera files
//! and converted annotations.
//!
//! ```no_run
//! use std::path::Path;
//!
//! use sdg_inputs::annotation_files::beside_photo;
//! use sdg_inputs::demonstrations::read_pair;
//!
//! # fn main() -> anyhow::Result<()> {
//! let photo = Path::new("part.png");
//! let demonstration = read_pair(photo, &beside_photo(photo)?)?;
//! println!("{}", demonstration.annotation.label);
//! # Ok(())
//! # }
//! ```
#![forbid(unsafe_code)]
#![allow(missing_docs, reason = "the functions have docs; fields are named for what they are")]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod annotation_conversion;
pub mod annotation_files;
pub mod base_weights;
mod board_pictures;
pub mod camera_files;
mod camera_update;
pub mod checkpoints;
pub mod demonstrations;
pub mod detector_config;
mod error;
mod error_line;
pub mod marks_check;
mod models;
mod picture_inputs;
mod pictures;
pub mod robot_poses;
mod teaching_files;
mod workcell_files;

pub use annotation_conversion::{ConvertedAnnotation, convert_annotation};
pub use annotation_files::MAX_ANNOTATION_BYTES;
pub use board_pictures::{BoardPicture, read_board};
pub use camera_update::CameraUpdate;
pub use error::{ConfigError, ImageError, NotAPair};
pub use error_line::{first_names, one_line};
pub use models::{check_replaces_a_model, read_model};
pub use picture_inputs::{DrawnNames, PictureInput, PictureInputs, STANDARD_INPUT, pictures_of_argument};
pub use pictures::{
    UNREADABLE_EXTENSIONS, check_is_not_turned, read_image, read_image_in, read_sensor_pixels_if_turned,
    read_standard_input_image, why_unreadable,
};
pub use teaching_files::TeachingFiles;
pub use workcell_files::read_workcell;
