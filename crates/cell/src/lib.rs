#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod drawing;
mod error;
mod finder;
mod live_tracker;
mod part_shape;
mod perception;
mod placed_camera;
mod record;

pub use drawing::DEFAULT_MIN_SCORE;
pub use error::{CellError, Result};
pub use finder::{LivePictures, ModelFinder, Pictures, SeenOutline, TakenPicture};
pub use live_tracker::{LiveTracker, SearchTime};
pub use part_shape::part_shape;
pub use perception::{Found, Perception};
pub use placed_camera::{CameraPose, PlacedCamera};
pub use record::FoundRecord;
