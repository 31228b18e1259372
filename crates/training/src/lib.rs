//! From a demonstration's samples to a trained network: the detector, and model A's orientation CNN ([`orientation`]).
//!
//! ```text
//! Augmenter ─ sample i ─ ImageTransform ─ batch (prepared on another thread) ─ losses ─ gradients ─ AdamW
//!                                                                                 │
//! held-out samples ─────────────────────── validation in pixels and degrees ─────┘ best checkpoint, early stop
//! ```
//!
//! One loop (run.rs) trains both networks; their differences are in a `Task`: batches, loss, validation.
//!
//! A run is a function of its seed: the samples, their order, and every random choice of the losses. Apart from
//! rounding differences between vector instruction sets, a run depends on the machine only if a time budget shortens
//! it.
//!
//! This crate deliberately does not convert detections to grasps (the `grasp` crate passes a function for this), does
//! not read or write files, and prints nothing: a run reports its progress by [`TrainingEvent`]s or
//! [`orientation::OrientationEvent`]s.
//!
//! ```
//! use sdg_training::{OneCycle, TrainingConfig};
//!
//! let config = TrainingConfig::edge(7);
//! // A low start, the peak after the warm-up, almost nothing at the end.
//! let rates = [0.0, config.schedule.warm_up, 1.0].map(|progress| config.schedule.learning_rate(progress));
//! assert!(rates[0] < rates[1] && rates[2] < rates[0]);
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod adamw;
mod detector;
mod error;
mod optimizer;
pub mod orientation;
mod pace;
mod prefetch;
mod run;
mod schedule;

pub use adamw::{AdamW, AdamWState};
pub use detector::{
    EarlyStop, HIT_DEGREES, HIT_PX, History, LossValues, Outcome, SampleSource, StepRecord, Trained, TrainingConfig,
    TrainingEvent, Validation, ValidationConfig, ValidationRecord, WindowPhase, first_windows, step_seed, train,
};
pub use error::TrainingError;
pub use optimizer::Optimizer;
pub use pace::Ending;
pub use schedule::OneCycle;
