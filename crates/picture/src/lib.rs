//! Decodes pictures from bytes, for files and live pictures, and cuts crops out of them.
//!
//! ```text
//! bytes ─ kind by content ─┬─ JPEG: tables added, end searched ─┐       [`PixelFrame`]
//!                          ├─ TIFF: the full-size page ─────────┼─ image ─ upright ─ 8 bits ─ alpha over white ─┐
//!                          ├─ PNG, WebP, BMP ───────────────────┘                                              ├─ RGB
//!                          └─ PPM ─────────────────────────────────────────────────────────────────────────────┘
//! ```
//! The size is checked before memory for the pixels is allocated.
//!
//! [`CropWindow`] resamples a square of a picture, possibly rotated, for a network; [`Pyramid`] is for many such squares of
//! one picture.
//!
//! Not included: files, clocks, HEIC and AVIF, raw photos, animations.
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod crop;
mod decode;
mod error;
mod jpeg;
mod jpeg_gap;
mod ppm;
mod pyramid;
mod samples;
mod tiff;
mod webp;

pub use crop::{CropWindow, OUTSIDE};
pub use decode::{IMAGE_EXTENSIONS, ImageLimits, PixelFrame, decode_image, decode_image_in, is_turned_by_exif};
pub use error::PictureError;
pub use jpeg::{JpegEnd, JpegScanner};
pub use ppm::PpmHead;
pub use pyramid::{Pyramid, halved};
