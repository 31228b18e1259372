//! One file for each verb.

pub mod augment;
#[cfg(feature = "simulation")]
pub mod demo;
pub mod detect;
#[cfg(feature = "simulation")]
pub mod evaluate;
#[cfg(feature = "simulation")]
pub mod rehearse;
pub mod teach;
pub mod weights;
