//! Training the orientation CNN from demonstrations.
//!
//! ```text
//! Demonstration ─ Augmenter ─ scene ─ a few windows, each rotated, with a small box error ─ crops (another thread)
//!   ─ logits ─ cross-entropy with a bell around the true angle ─ AdamW on one cycle ─ validation in degrees
//! ```
//!
//! A composed scene costs more time than its crops, so each scene gives several crops. Each window is rotated at
//! random, which rotates the part in the crop: the same scene teaches several angles. The box of a rotated window is
//! recomputed from the part's outline, like the box of a detector.
//!
//! # Measured
//!
//! With the arguments `pendulum,fuel_line 20 9000 edge,steps=60 edge,steps=120 edge edge,labels=hard,window=0` of the
//! example crates/cli/examples/try_orientation.rs, which is in the history until commit b1519834: 96 held-out scenes, 20
//! rendered pictures (12 in the row of 120 steps of the pendulum) with three boxes each, box errors of up to 6 % in
//! position and 12 % in size.
//!
//! | part | settings | held-out: within 10°, median | rendered: within 10°, median, worst |
//! |---|---|---|---|
//! | pendulum | 60 steps | 88.5 %, 2.3° | 100 %, 1.2°, 6.2° |
//! | pendulum | 120 steps | 91.7 %, 1.2° | 100 %, 0.9°, 2.3° |
//! | pendulum | 240 steps (`edge`) | 96.9 %, 0.7° | 100 %, 0.4°, 1.7° |
//! | pendulum | 240 steps, hard labels | 80.2 %, 4.9° | 96.7 %, 3.7°, 11.3° |
//! | fuel line | 120 steps | 83.3 %, 2.7° | 95 %, 1.5°, 179° |
//!
//! The measurements ran on two Zen 4 cores with a load average of twenty, so only processor time is meaningful: 25 s
//! for 120 steps, 6.4 ms per evaluation in four quarter turns. The fuel line looks almost the same after half a turn,
//! which causes its worst error. Not measured: 240 steps of the fuel line, the rod end, other input sizes, times on an
//! idle machine.

mod augmented;
mod config;
mod jitter;
mod labelled_crop;
mod measured;
mod start;
mod trainer;

pub use augmented::AugmentedCrops;
pub use config::{CropStyle, OrientationTraining};
pub use jitter::BoxJitter;
pub use labelled_crop::LabelledCrop;
pub use measured::{AngleErrors, HIT_DEGREES};
pub use start::OrientationStart;
pub use trainer::{OrientationEvent, TrainedOrientation, teach, train};
