//! Grasps in the browser: a grasp model's detection as a WebAssembly module.
//!
//! ```text
//! page/main.js ─ page/worker.js ─ sdg_web.js ─ Model ─ Detector ─ sdg_grasp::GraspModel
//!  canvas, camera  a thread        wasm-bindgen  bindings  plain Rust   the crates of the command line
//! ```
//!
//! Bytes of a model file and of an image go in, [`sdg_grasp::DetectionRecord`]s come out as JSON, under the names of
//! `sdg detect --json`. Image files are decoded by the very decoder that the command line uses, so that both see the
//! same pixels; frames of a camera come as RGBA.
//!
//! The module is built twice: once for the processor, and once (feature `webgpu`, several times as large, and fetched
//! only when asked for) for the graphics card that a browser lends. A browser hands over results of its
//! card to asynchronous code only, so detection is asynchronous.
//!
//! Left out on purpose: teaching, threads (a page may use them only where its host sends special headers), and any
//! request to anywhere: what is dropped on the page stays in it. `make web` builds modules and page into target/web.
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
// What wasm-bindgen writes for `bindings` has to be unsafe.
#![cfg_attr(not(target_arch = "wasm32"), forbid(unsafe_code))]
#![cfg_attr(test, allow(clippy::unwrap_used))]

#[cfg(all(target_arch = "wasm32", target_os = "unknown"))]
mod bindings;
mod detector;
mod error;

pub use detector::Detector;
pub use error::WebError;
