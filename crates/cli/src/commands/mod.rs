//! One file for each verb.

pub mod annotate;
pub mod augment;
pub mod demo;
pub mod detect;
pub mod evaluate;
pub mod rehearse;
pub mod teach;
pub mod weights;
