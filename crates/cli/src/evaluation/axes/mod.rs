//! Axes along which the paper's protocol is made harder, one at a time.

mod jitter;
mod paired;

pub use jitter::{MARKS_JITTER_PX, with_jittered_marks};
pub use paired::PairedCounts;
