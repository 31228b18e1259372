//! sensor_msgs, and the message of transforms.

use super::geometry::TransformStamped;
use super::{Header, message, structure};

message! { "sensor_msgs",
    /// `sensor_msgs/msg/Image`.
    Image {
        /// Time of the picture, and the camera's optical frame.
        header: Header,
        /// Rows.
        height: u32,
        /// Pixels per row.
        width: u32,
        /// Encoding, such as `rgb8`.
        encoding: String,
        /// Whether numbers of two bytes are big-endian.
        is_bigendian: u8,
        /// Bytes per row.
        step: u32,
        /// The rows, each of `step` bytes.
        data: Vec<u8>,
    }
}

message! { "sensor_msgs",
    /// `sensor_msgs/msg/CompressedImage`.
    CompressedImage {
        /// Time of the picture, and the camera's optical frame.
        header: Header,
        /// Format, such as `jpeg` or `rgb8; jpeg compressed bgr8`.
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
        /// Pixels per row; 0 for all.
        width: u32,
        /// Whether the picture is to be rectified.
        do_rectify: bool,
    }
}

message! { "sensor_msgs",
    /// `sensor_msgs/msg/CameraInfo`.
    CameraInfo {
        /// Header of the picture.
        header: Header,
        /// Rows of the calibrated picture.
        height: u32,
        /// Pixels per row.
        width: u32,
        /// Lens model, such as `plumb_bob`.
        distortion_model: String,
        /// For `plumb_bob`: k1, k2, p1, p2, k3.
        d: Vec<f64>,
        /// The camera matrix, row by row.
        k: [f64; 9],
        /// For a stereo camera.
        r: [f64; 9],
        /// The matrix of the rectified picture, row by row.
        p: [f64; 12],
        /// Number of pixels that were added up; 0 means 1.
        binning_x: u32,
        /// The same for rows.
        binning_y: u32,
        /// The part of the picture that was sent.
        roi: RegionOfInterest,
    }
}

message! { "sensor_msgs",
    /// `sensor_msgs/msg/JointState`.
    JointState {
        /// Time.
        header: Header,
        /// Names of the joints.
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
