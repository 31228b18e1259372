//! Messages of sensor_msgs, and the message of transforms.

use super::geometry::TransformStamped;
use super::{Header, message, structure};

message! { "sensor_msgs",
    /// `sensor_msgs/msg/Image`.
    Image {
        /// Time of the picture, and the camera's optical frame.
        header: Header,
        /// Height, in pixels.
        height: u32,
        /// Width, in pixels.
        width: u32,
        /// Encoding, such as `rgb8`.
        encoding: String,
        /// Whether numbers of two bytes are big-endian.
        is_bigendian: u8,
        /// Bytes per row.
        step: u32,
        /// The pixels: `height` rows of `step` bytes.
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
        /// The bytes of the file.
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
        /// Height, in pixels; 0 for the whole picture.
        height: u32,
        /// Width, in pixels; 0 for the whole picture.
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
        /// Height of the calibrated picture, in pixels.
        height: u32,
        /// Width of the calibrated picture, in pixels.
        width: u32,
        /// Lens model, such as `plumb_bob`.
        distortion_model: String,
        /// The coefficients of the lens; for `plumb_bob`: k1, k2, p1, p2, k3.
        d: Vec<f64>,
        /// The camera matrix, row by row.
        k: [f64; 9],
        /// The rectification matrix of a stereo camera, row by row.
        r: [f64; 9],
        /// The matrix of the rectified picture, row by row.
        p: [f64; 12],
        /// Number of columns that were combined into one pixel; 0 means 1.
        binning_x: u32,
        /// Number of rows that were combined into one pixel; 0 means 1.
        binning_y: u32,
        /// The part of the picture that was sent.
        roi: RegionOfInterest,
    }
}

message! { "sensor_msgs",
    /// `sensor_msgs/msg/JointState`.
    JointState {
        /// Stamp.
        header: Header,
        /// Names of the joints.
        name: Vec<String>,
        /// Positions, rad or m.
        position: Vec<f64>,
        /// Velocities, rad/s or m/s; may be empty.
        velocity: Vec<f64>,
        /// Torques or forces, Nm or N; may be empty.
        effort: Vec<f64>,
    }
}

structure! {
    /// `tf2_msgs/msg/TFMessage`.
    TfMessage {
        /// The transforms, each with its own stamp.
        transforms: Vec<TransformStamped>,
    }
}

impl super::Message for TfMessage {
    const PACKAGE: &'static str = "tf2_msgs";
    const NAME: &'static str = "TFMessage";
}
