//! One file for each verb.

pub mod annotate;
pub mod annotation;
pub mod augment;
pub mod completions;
pub mod demo;
pub mod detect;
pub mod evaluate;
pub mod man;
pub mod rehearse;
pub mod teach;
pub mod weights;
