//! A demonstration.
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod annotation;
mod coco;
mod decode;
mod error;
mod json;
mod labelme;

pub use annotation::{Annotation, ImageFacts};
pub use coco::CocoFile;
pub use decode::{ImageLimits, decode_image};
pub use error::{Error, Result};
