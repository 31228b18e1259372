#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod board_drawing;
pub mod drawing;
mod dry_run;
mod error;
mod explained_plan;
mod finder;
mod frame_record;
mod frame_sizes;
mod grasp_record;
mod grasp_task;
mod hand_reach;
mod height;
mod jaws;
mod live_detection;
mod live_tracker;
mod mounted_camera;
mod obstacle_outline;
mod part_shape;
mod perception;
mod record;
mod region_record;
mod searched_picture;
mod sequence_run;
mod surface;
mod words;
mod workcell_map;

// Crates whose types are in this crate's interface, so that a program needs only this dependency.
pub use image;
pub use nalgebra;
pub use sdg_calibration as calibration;
pub use sdg_camera as camera;
pub use sdg_demonstration as demonstration;
pub use sdg_geometry as geometry;
pub use sdg_grasp as grasp;
pub use sdg_kinematics as kinematics;
pub use sdg_robot as robot;

pub use board_drawing::draw_board_session;
pub use drawing::DEFAULT_MIN_SCORE;
pub use dry_run::DryRun;
pub use error::{CellError, Result};
pub use explained_plan::{ExplainedPlan, refused_by_limits, turned_goals};
pub use finder::{LivePictures, ModelFinder, Pictures, SeenOutline, TakenPicture, UNKNOWN_HEIGHTS_M};
pub use frame_record::{FaultRecord, FrameRecord, PartRecord, track_state_name};
pub use frame_sizes::{FrameSize, FrameSizes};
pub use grasp_task::{GraspSettings, GraspTask};
pub use hand_reach::{Reach, Square};
pub use height::height_measurement;
pub use live_detection::{FrameDetector, Frames, Next, Part};
pub use live_tracker::{LiveTracker, SearchTime};
pub use mounted_camera::MountedCamera;
pub use obstacle_outline::footprints_on_table;
pub use part_shape::part_shape;
pub use perception::{Found, Perception, camera_over_table};
pub use record::{FoundRecord, PoseRecord};
pub use region_record::RegionRecord;
pub use sdg_robot::CameraPose;
pub use searched_picture::{ExplainedRecord, PictureRecord, SearchedPicture};
pub use sequence_run::{Ended, run_sequence};
pub use words::{DetectionWords, advice_in_words, without_minus_zero};
pub use workcell_map::WorkcellMap;
