//! Grasps in the browser: a grasp model's detection as a WebAssembly module.
//!
//! ```text
//! page/main.js ─ page/worker.js ─ sdg_web.js ─ Model ─ Detector ─ sdg_grasp::GraspModel
//!  canvas, camera  a thread        wasm-bindgen  bindings  plain Rust   the crates of the command line
//! ```
//!
//! The inputs are the bytes of a model file and of an image; the outputs are [`sdg_grasp::DetectionRecord`]s as JSON,
//! with the field names of `sdg detect --json`. Image files are decoded by the same decoder as on the command line, so
//! both get the same pixels; camera frames are passed as RGBA.
//!
//! The module is built twice: for the processor, and (feature `webgpu`, several times as large, and loaded only on
//! request) for the graphics card provided by the browser. Browsers return results of the graphics card only to
//! asynchronous code, so detection is asynchronous.
//!
//! Deliberately absent: teaching, threads (allowed only if the page's host sends special headers), and any network
//! request: files dropped on the page stay in it. `make web` builds modules and page into target/web.
//!
//! ```no_run
//! use sdg_grasp::{Device, Verification};
//! use sdg_web::Detector;
//!
//! # async fn look() -> Result<(), Box<dyn std::error::Error>> {
//! let detector = Detector::open(&std::fs::read("pendulum.sdg")?, &Device::flex())?;
//! println!("{}", detector.detect_in_file(&std::fs::read("table.png")?, Verification::ByShape).await?);
//! # Ok(())
//! # }
//! ```
// The code that wasm-bindgen generates for `bindings` must be unsafe.
#![cfg_attr(not(target_arch = "wasm32"), forbid(unsafe_code))]
#![cfg_attr(test, allow(clippy::unwrap_used))]

#[cfg(all(target_arch = "wasm32", target_os = "unknown"))]
mod bindings;
mod detector;
mod error;

pub use detector::Detector;
pub use error::WebError;
