//! From a demonstration's samples to a trained detector.
//!
//! ```text
//! Augmenter ─ sample i ─ ImageTransform ─ batch (prepared on another thread) ─ losses ─ gradients ─ AdamW
//!                                                                                 │
//! held-back samples ─────────────────────── validation in pixels and degrees ─────┘ best checkpoint, early stop
//! ```
//!
//! A run is a function of its seed: which samples, in which order, every random choice of the losses. Only a time
//! budget that cuts a run short makes it depend on the machine.
//!
//! What is deliberately absent: how a grasp is read off detections (the `grasp` crate passes that in), files, and any
//! printing: a run tells what happens through [`TrainingEvent`]s.
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
mod batch;
mod config;
mod error;
mod optimizer;
mod pace;
mod progress;
mod schedule;
mod trainer;
mod validation;

pub use adamw::{AdamW, AdamWState};
pub use batch::{SampleSource, first_windows};
pub use config::{EarlyStop, Optimizer, TrainingConfig, ValidationConfig, WindowPhase};
pub use error::TrainingError;
pub use pace::Pace;
pub use progress::{Ending, History, LossValues, StepRecord, TrainingEvent, ValidationRecord};
pub use schedule::OneCycle;
pub use trainer::{Trained, step_seed, train};
pub use validation::{HIT_DEGREES, HIT_PX, Outcome, Validation};
