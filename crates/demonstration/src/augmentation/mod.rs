//! Augmented samples of a demonstration, each with its annotation.
//!
//! ```text
//! Demonstration ── prepared: reduced photo, distance to the outline, background without the part, mutants
//!                      │
//! (seed, stream, index) ── generator ── pose ── table ── distractors ── shadow, part ── cover
//!                                                                                         │
//!                                            Sample ── sensor ── lens ── light ───────────┘
//! ```
//!
//! Two frames: *photo* pixels, in which annotations and truths are stored, and *prepared* pixels of the reduced
//! photo. The canvas is the output itself, so that a warp is sampled once and its truth is exact.

mod augmenter;
mod background;
mod config;
mod distance;
mod distractor;
mod figure;
mod homography;
mod light;
mod mutant;
mod noise;
mod paper;
mod pose;
mod prepared;
mod random;
mod sample;
mod scene;
mod sensor;
#[cfg(test)]
mod tests;
mod warp;

pub use augmenter::{Augmenter, Windows};
pub use config::{
    AugmentationConfig, AugmentationStyle, MIN_SAMPLE_SIDE_PX, PaperStyle, SceneStyle, output_size_of, sample_size,
};
pub use sample::{Sample, SampleObject};
