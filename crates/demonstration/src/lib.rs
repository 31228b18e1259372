//! A demonstration: one photo of a part with a person's marks, read, checked and multiplied.
//!
//! ```text
//! photo bytes ── decode_image ─────┐
//!                                  ├─ Demonstration ── Augmenter ── sample(i) ── Sample {image, objects}
//! COCO, LabelMe,                   │                                                 │
//! YOLO-pose, OpenDR ─ Annotation ──┘                           CocoFile ── bytes ────┘
//! ```
//!
//! Everything from outside is checked here, once: [`decode_image`] reads the size before it allocates memory, and
//! errors of [`Annotation::read`] give the expected value, the found value and the position. [`Augmenter`] then
//! makes any number of samples by random access: sample *i* of a seed is the same on every call.
//!
//! This crate deliberately has no files, threads or clocks (bytes in, bytes out; it runs in a browser), no tensors or
//! training targets (`sdg-training`), and no mirror images as samples of the part, because a mirror image is another
//! part.
//!
//! ```
//! use image::{Rgb, RgbImage};
//! use sdg_demonstration::{Annotation, AugmentationConfig, Augmenter, Demonstration, ImageFacts};
//!
//! let photo = RgbImage::from_fn(320, 240, |x, y| Rgb([(x / 2) as u8, y as u8, 90]));
//! let labelme = r#"{"imageWidth": 320, "imageHeight": 240, "shapes": [
//!     {"label": "rod", "shape_type": "polygon", "points": [[100, 100], [200, 110], [200, 130], [100, 125]]},
//!     {"label": "grasp_start", "shape_type": "point", "points": [[120, 112]]},
//!     {"label": "grasp_end", "shape_type": "point", "points": [[180, 118]]}]}"#;
//! let facts = ImageFacts { width: 320, height: 240, file_name: None };
//! let annotation = Annotation::read(labelme.as_bytes(), &facts)?.remove(0);
//!
//! let demonstration = Demonstration { image: photo, annotation };
//! let augmenter = Augmenter::new(&[demonstration], AugmentationConfig::default(), 7)?;
//! let sample = augmenter.sample(3);
//! assert_eq!(sample, augmenter.sample(3));
//! # Ok::<(), sdg_demonstration::Error>(())
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod annotation;
mod augmentation;
mod coco;
mod coco_image;
mod data_yaml;
mod demonstration;
mod draft;
mod erase;
mod error;
mod file_name;
mod foreign;
mod format;
mod json;
mod keypoint_row;
mod label_file;
mod labelled_instance;
mod labelme;
mod model_kind;
mod npy;
mod opendr;
mod other_kind;
mod outline_proposal;
pub mod random;
mod raster;
mod reading;
mod written;
mod yolo_pose;

pub use annotation::{Annotation, ImageFacts};
pub use augmentation::{
    AugmentationConfig, AugmentationStyle, Augmenter, MIN_SAMPLE_SIDE_PX, PaperStyle, Sample, SampleObject, SceneStyle,
    Windows, output_size_of, sample_size,
};
pub use coco::CocoFile;
pub use demonstration::{Demonstration, NUM_KEYPOINTS};
pub use error::{Error, Result};
pub use format::{AnnotationFormat, DeclaredImage};
pub use label_file::LabelFile;
pub use labelled_instance::LabelledInstance;
pub use model_kind::{ModelKind, UnknownModel};
pub use outline_proposal::{OutlineStroke, correct_outline, propose_outline, propose_outline_with};
pub use reading::{MarksReading, marks_fit, other_reading};
pub use sdg_picture::{
    IMAGE_EXTENSIONS, ImageLimits, PictureError, PixelFrame, decode_image, decode_image_in, is_turned_by_exif,
};
pub use written::WrittenAnnotation;
