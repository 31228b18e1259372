//! Random rigid parts, their look-alikes, and pictures of scenes with ground truth, for evaluation and pretraining.
//!
//! ```text
//! seed ─ Part (recipe ─ relief ─ grasp, symmetry, outline) ─┬─ look_alike ─┐
//!                                                           ├─ demonstration ─ Demonstration {photo, marks}
//!                                                           └─ Scenes ─ sample(i) ─ Sample {image, instances, others}
//! ```
//!
//! A part is a height field with materials, built from a recipe of flat shapes that raise, cut and paint it: flat
//! stampings, turned, bent, cast and moulded parts. Scenes are rendered by following lines of sight through a pinhole
//! camera to these height fields, with soft shadows, mirrored surroundings, and the effects of lens and sensor. Sample
//! *i* of a seed is identical to the bit, in any order of samples and with any number of threads.
//!
//! **Frames.** Part: millimetres, x right, y down as seen from above, z up from the table. Picture: pixels, the centre
//! of the first pixel at (0.5, 0.5). Angles are in radians from x to y, so clockwise as seen.
//!
//! Deliberately absent: files, clocks, tensors (no burn), a simulator, and models of the parts that the project ships.
//!
//! ```
//! use sdg_part_generator::{Condition, LookAlike, Part, PhotoConfig, SceneConfig, Scenes, demonstration};
//!
//! let part = Part::generate(7);
//! let taught = demonstration(&part, &PhotoConfig::default(), 1);
//! assert_eq!(taught.check(), Ok(()));
//!
//! let scenes = Scenes::new(&[part], SceneConfig { num_other_parts: 2, ..SceneConfig::only(Condition::Tilt) }, 3)?;
//! let sample = scenes.sample(12);
//! assert_eq!(sample, scenes.sample(12));
//! let truth = &sample.instances[0];
//! assert!(truth.visible_share > 0.5 && truth.scale > 0.5);
//! # Ok::<(), sdg_part_generator::GeneratorError>(())
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod error;
mod grasp;
mod look_alike;
mod part;
mod part_kind;
mod part_pair;
mod random;
mod recipe;
mod relief;
mod scene;
mod tiles;

pub use error::{GeneratorError, Result};
pub use grasp::PartGrasp;
pub use look_alike::LookAlike;
pub use part::Part;
pub use part_kind::PartKind;
pub use scene::{
    Condition, Conditions, DemonstrationPhoto, Instance, MixedInstance, MixedSample, OtherKind, OtherObject,
    PhotoConfig, Sample, SceneConfig, Scenes, demonstration,
};
