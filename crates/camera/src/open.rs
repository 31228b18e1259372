//! Opens the camera at an address.

use std::sync::Arc;
use std::time::Duration;

use crate::address::Address;
use crate::error::CameraError;
use crate::folder::Folder;
use crate::frame::Camera;
use crate::http;
use crate::options::OpenOptions;
use crate::program::Program;
use crate::reconnecting::{Opener, Reconnecting};
use crate::source::Source;
use crate::v4l;
use crate::watched::Watched;

/// Range of requested frame rates, in frames per second.
const FPS: std::ops::RangeInclusive<f64> = 0.1..=1000.0;
/// Range of stall timeouts.
const STALL_TIMEOUTS: std::ops::RangeInclusive<Duration> = Duration::from_millis(10)..=Duration::from_secs(3600);

/// Opens the camera at an address. The camera is reopened if its connection is lost, and its frames are checked for
/// faults.
///
/// # Errors
/// [`CameraError::Open`] and [`CameraError::Setting`] if the camera cannot be opened or rejects its settings,
/// [`CameraError::OpenedElsewhere`] for [`Address::Sim`] and [`Address::Ros2`].
pub fn open(address: &Address, options: &OpenOptions) -> Result<Box<dyn Camera>, CameraError> {
    let name: Arc<str> = address.to_string().into();
    let refused = |expected: &str, found: String| {
        Err(CameraError::Open { address: name.to_string(), why: format!("expected {expected}, found {found}") })
    };
    if let Some(fps) = options.fps.filter(|fps| !FPS.contains(fps)) {
        return refused("0.1 to 1000 frames a second", fps.to_string());
    }
    if !STALL_TIMEOUTS.contains(&options.stall_timeout) {
        return refused("a stall timeout of 0.01 to 3600 s", format!("{} s", options.stall_timeout.as_secs_f64()));
    }
    if let Address::Sim(_) | Address::Ros2(_) = address {
        return Err(CameraError::OpenedElsewhere { address: name.to_string() });
    }
    let frozen_frames = address.is_live().then_some(options.frozen_frames);
    let opener = opener(address.clone(), options.clone());
    Ok(Box::new(Watched::new(Reconnecting::open(name, opener, options.stall_timeout)?, frozen_frames)))
}

fn opener(address: Address, options: OpenOptions) -> Opener {
    let frame = options.frame;
    let boxed = move |folder: Folder| Box::new(folder.in_frame(frame)) as Box<dyn Source>;
    Box::new(move |deadline| match &address {
        Address::V4l(node) => v4l::open(node, &options),
        Address::Http(url) => http::connect(url, &options, deadline),
        Address::Command(line) => Ok(Box::new(Program::start(line, options.frame)?)),
        Address::Folder { path, playback } => Folder::open(path, *playback, &address.to_string()).map(boxed),
        Address::File { path, playback } => Folder::open_file(path, *playback, &address.to_string()).map(boxed),
        Address::Sim(_) | Address::Ros2(_) => Err(CameraError::OpenedElsewhere { address: address.to_string() }),
    })
}
