//! Pretraining of preset `edge` on generated parts.
//!
//! ```text
//! seed ─ Pictures ─┬─ DetectorTask: PretrainNetwork ──────┬─ Run: AdamW on one cycle ─ checkpoint ─┐
//!                  ├─ OrientationTask: OrientationCnn ────┤                                        │
//!                  └─ ComparisonTask: ComparisonNetwork ──┘                                        │
//!                                          BaseWeightsFile (f16): trunk, heads, imprint ─ export ──┘
//! unseen parts ─ demonstration ─ teach for 15, 30, 60, 120 steps
//!                                 └ recall and false alarms of the network alone (`compare`)
//! ```
//!
//! A run is a function of its settings: picture *i* is always the same, and a checkpoint holds everything that the next
//! step needs. A run that was stopped and resumed gives the same bits as one that was not.
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod checkpoint;
pub mod compare;
pub mod comparison;
pub mod detector;
pub mod export;
pub mod network;
pub mod orientation;
pub mod outcome;
pub mod pictures;
pub mod run;
pub mod table;
