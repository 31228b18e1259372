//! Decodes pictures from bytes, for files and live pictures.
//!
//! ```text
//! bytes ─ kind by content ─┬─ JPEG: tables added, end searched ─┐       [`PixelFrame`]
//!                          ├─ TIFF: the full-size page ─────────┼─ image ─ upright ─ 8 bits ─ alpha over white ─┐
//!                          ├─ PNG, WebP, BMP ───────────────────┘                                              ├─ RGB
//!                          └─ PPM ─────────────────────────────────────────────────────────────────────────────┘
//! ```
//! The size is checked before memory is allocated. Not included: files, clocks, HEIC and AVIF, raw photos, animations.
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod decode;
mod error;
mod jpeg;
mod jpeg_gap;
mod ppm;
mod samples;
mod tiff;

pub use decode::{IMAGE_EXTENSIONS, ImageLimits, PixelFrame, decode_image, decode_image_in, is_turned_by_exif};
pub use error::PictureError;
pub use jpeg::{JpegEnd, JpegScanner};
pub use ppm::PpmHead;
