//! One test binary for all files of this folder, because each binary links the whole
//! crate.
#![allow(clippy::unwrap_used)]

mod conversion;
mod forged;
mod formats;
mod hostile;
