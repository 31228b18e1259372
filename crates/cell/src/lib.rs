#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod error;
mod finder;
mod height;
mod live_tracker;
mod part_shape;
mod perception;
mod placed_camera;
mod surface;

pub use error::{CellError, Result};
pub use finder::{LivePictures, ModelFinder, Pictures, SeenOutline, TakenPicture, UNKNOWN_HEIGHTS_M};
pub use height::height_measurement;
pub use live_tracker::{LiveTracker, SearchTime};
pub use part_shape::part_shape;
pub use perception::{Found, Perception};
pub use placed_camera::{CameraPose, PlacedCamera};
