//! All targets, grouped by the kind of input.

mod borders;
mod bytes;
mod c_border;
mod cameras;
mod checkpoints;
mod fci_server;
mod jpegs;
mod marks;
mod model_files;
mod models;
mod numbers;
mod page;
mod pictures;
mod places;
mod robots;
mod ros;
mod ros_seeds;
mod written_marks;

pub use checkpoints::costliest_pickles;

use crate::target::Target;

/// All targets.
pub const TARGETS: &[Target] = &[
    checkpoints::CHECKPOINT,
    models::MODEL,
    models::DETECTOR_CONFIG,
    marks::COCO,
    marks::LABELME,
    marks::YOLO,
    marks::DATA_YAML,
    marks::OPENDR,
    pictures::PNG,
    pictures::PNG_CHUNKS,
    pictures::JPEG,
    pictures::TIFF,
    pictures::OTHERS,
    places::CAMERA_FILE,
    places::ROBOT_POSES,
    places::WORKCELL,
    robots::FRANKA,
    fci_server::FCI_SERVER,
    ros::CDR,
    cameras::HTTP_CAMERA,
    cameras::LIVE_PAGE,
    page::PAGE,
    page::START_PAGE,
    borders::WEB,
    borders::BINDINGS,
    c_border::C_BORDER,
];
