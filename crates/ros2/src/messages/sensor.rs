//! sensor_msgs, and the message of transforms.

use super::geometry::TransformStamped;
use super::{Header, message, structure};

message! { "sensor_msgs",
    /// `sensor_msgs/msg/Image`.
    Image {
        /// When it was taken, and the camera's optical frame.
        header: Header,
        /// Rows.
        height: u32,
        /// Pixels of a row.
        width: u32,
        /// As `rgb8`.
        encoding: String,
        /// Whether numbers of two bytes have the high one first.
        is_bigendian: u8,
        /// Bytes of a row.
        step: u32,
        /// The rows, each of `step` bytes.
        data: Vec<u8>,
    }
}

message! { "sensor_msgs",
    /// `sensor_msgs/msg/CompressedImage`.
    CompressedImage {
        /// When it was taken, and the camera's optical frame.
        header: Header,
        /// As `jpeg`, or `rgb8; jpeg compressed bgr8`.
        format: String,
        /// The file.
        data: Vec<u8>,
    }
}

structure! {
    /// `sensor_msgs/msg/RegionOfInterest`.
    RegionOfInterest {
        /// Left edge.
        x_offset: u32,
        /// Upper edge.
        y_offset: u32,
        /// Rows; 0 for all.
        height: u32,
        /// Pixels of a row; 0 for all.
        width: u32,
        /// Whether the picture is to be rectified.
        do_rectify: bool,
    }
}

message! { "sensor_msgs",
    /// `sensor_msgs/msg/CameraInfo`.
    CameraInfo {
        /// The picture's.
        header: Header,
        /// Rows of the calibrated picture.
        height: u32,
        /// Pixels of a row.
        width: u32,
        /// As `plumb_bob`.
        distortion_model: String,
        /// Of `plumb_bob`: k1, k2, p1, p2, k3.
        d: Vec<f64>,
        /// The camera matrix, row by row.
        k: [f64; 9],
        /// Of a stereo camera.
        r: [f64; 9],
        /// The matrix of the rectified picture, row by row.
        p: [f64; 12],
        /// Pixels that were added up; 0 stands for 1.
        binning_x: u32,
        /// Likewise of rows.
        binning_y: u32,
        /// Which part of the picture was sent.
        roi: RegionOfInterest,
    }
}

message! { "sensor_msgs",
    /// `sensor_msgs/msg/JointState`.
    JointState {
        /// When.
        header: Header,
        /// The joints that follow.
        name: Vec<String>,
        /// rad or m.
        position: Vec<f64>,
        /// rad/s or m/s; may be empty.
        velocity: Vec<f64>,
        /// Nm or N; may be empty.
        effort: Vec<f64>,
    }
}

structure! {
    /// `tf2_msgs/msg/TFMessage`.
    TfMessage {
        /// Each with its stamp.
        transforms: Vec<TransformStamped>,
    }
}

impl super::Message for TfMessage {
    const PACKAGE: &'static str = "tf2_msgs";
    const NAME: &'static str = "TFMessage";
}
