//! The readers, by what they read.

mod marks;
mod models;
mod pictures;
mod places;
mod robots;
mod ros;

use std::path::Path;

use crate::target::Target;

/// All readers.
pub const TARGETS: &[Target] = &[
    models::CHECKPOINT,
    models::MODEL,
    models::DETECTOR_CONFIG,
    marks::COCO,
    marks::LABELME,
    marks::YOLO,
    marks::DATA_YAML,
    marks::OPENDR,
    pictures::PNG,
    pictures::JPEG,
    pictures::TIFF,
    pictures::OTHERS,
    places::CAMERA_FILE,
    places::ROBOT_POSES,
    places::WORKCELL,
    robots::FRANKA,
    ros::CDR,
];

/// A file of the repository.
fn file(path: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
    std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}
