//! A ROS 2 node that detects, teaches and grasps.
//!
//! ```text
//! image ─ PictureReader: a thread ─ queue ─┐                     ┌─ Topics: pose, detections, overlay, tf, diagnostics
//! camera_info, tf ─ CameraPoseReader: threads ──┴─ Searcher ─ Searched ┴─ Services: requests that wait for a picture
//!                                             run: this thread       Teaching, Grasping: one thread each, while they run
//! ```
//!
//! This crate parses no arguments and reads no files other than the taught model. Settings are passed as [`Settings`]
//! and [`GraspInputs`], and teaching as a function of a [`TeachJob`], so that the node teaches in the same way as its
//! caller.
//!
//! Without the feature `dds` the crate is empty, so that a build of the whole workspace does not compile RustDDS.
#![cfg(feature = "dds")]
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod camera_pose;
mod grasping;
mod lines;
mod pictures;
mod publishing;
mod requests;
mod searching;
mod services;
mod settings;
mod teaching;

use std::sync::Arc;
use std::time::Duration;

use anyhow::Result;
use sdg_ros2::dds::{Node, TrajectoryArm, network_panic};

pub use camera_pose::CameraPoseSource;
pub use grasping::GraspInputs;
pub use settings::{IsInterrupted, Settings};
pub use teaching::{Teach, TeachJob};

use camera_pose::CameraPoseReader;
use grasping::Grasping;
use lines::Lines;
use pictures::PictureReader;
use publishing::Topics;
use sdg_inputs::one_line;
use searching::Searcher;
use services::Services;

/// Interval of checks for requests while there is no picture.
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// Runs the node until `is_interrupted` returns true.
///
/// # Errors
/// An error if a network resource cannot be opened, if the system's clock was set back, or if a thread of the network
/// panicked.
pub fn run(
    mut node: Node,
    settings: Settings,
    arm: Option<(GraspInputs, TrajectoryArm)>,
    is_interrupted: &IsInterrupted,
) -> Result<()> {
    let lines = Arc::<Lines>::default();
    let mut topics = Topics::open(&mut node, &lines)?;
    // A grasp by the arm needs lengths even if the pictures have no poses, as those of a camera on the hand.
    let needs_lengths = arm.is_some() || !matches!(settings.camera_pose, CameraPoseSource::Unknown);
    let camera_pose = CameraPoseReader::open(&mut node, settings.camera_pose, settings.max_transform_age_secs, &lines)?;
    let reader = PictureReader::open(&mut node, settings.is_compressed, settings.picture_qos, settings.queue, &lines)?;
    let grasping = arm.map(|(grasp, arm)| Grasping::new(grasp, arm, Arc::clone(&reader.shared), is_interrupted));
    let (teach, trigger) = (settings.teach, settings.trigger_teaching);
    let mut services = Services::open(&mut node, teach, trigger, needs_lengths, grasping, &lines)?;
    let mut searcher = Searcher::new(settings.model, settings.min_score, needs_lengths);
    sdg_files::print_stderr(format_args!(
        "sdg ros2: pictures from {}; publishes {}; Ctrl-C ends it\n",
        reader.topic,
        topics.names()
    ));
    while !is_interrupted() && reader.shared.ended.get().is_none() && network_panic().is_none() {
        if let Some(picture) = reader.shared.next(POLL_INTERVAL) {
            let over_table = camera_pose.at(&picture.header).map_err(anyhow::Error::from);
            match over_table.and_then(|over_table| searcher.search(&picture, over_table.as_ref())) {
                Ok(mut searched) => {
                    // A request may ask for lower scores than the node's setting.
                    services.searched(Ok(&searched), picture.arrived);
                    searched.keep_by_setting();
                    topics.publish(&node, &searched);
                }
                Err(error) => {
                    let error = one_line(&error);
                    lines.complain(&error);
                    topics.failed();
                    services.searched(Err(error), picture.arrived);
                }
            }
        }
        if let Some(taught) = services.work(&reader, searcher.model(), &camera_pose) {
            let changed = searcher.change_model(&taught.path, &settings.device).map_err(|error| one_line(&error));
            services.answer_use(&taught, changed);
        }
        topics.diagnose(&reader, searcher.model().is_some());
    }
    services.finish();
    match reader.shared.ended.get().map(ToString::to_string).or_else(|| network_panic().map(|why| why.to_string())) {
        Some(why) => anyhow::bail!("{why}"),
        None => Ok(()),
    }
}
