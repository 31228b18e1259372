//! The options of a camera.

use std::time::Duration;

use sdg_picture::PixelFrame;

/// How a V4L2 camera encodes its frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// YUYV: 4:2:2, two bytes per pixel.
    Yuyv,
    /// RGB24 (V4L2's `RGB3`): three bytes per pixel.
    Rgb24,
    /// Motion JPEG (V4L2's `MJPG`).
    Mjpeg,
}

impl Encoding {
    /// All encodings, in order of preference: the one with the smallest loss first.
    pub const ALL: [Self; 3] = [Self::Rgb24, Self::Yuyv, Self::Mjpeg];

    /// V4L2's four-character code.
    pub fn fourcc(self) -> [u8; 4] {
        match self {
            Self::Yuyv => *b"YUYV",
            Self::Rgb24 => *b"RGB3",
            Self::Mjpeg => *b"MJPG",
        }
    }
}

/// Settings requested from a camera. `width`, `height`, `encoding`, `exposure_secs` and `white_balance_kelvin` apply
/// only to V4L2. Other cameras deliver frames unchanged, and the frames state their size.
#[derive(Debug, Clone)]
pub struct OpenOptions {
    /// Width in pixels; the nearest available size is used.
    pub width: u32,
    /// Height, in pixels.
    pub height: u32,
    /// Frames per second of a V4L2 camera, or snapshots per second over HTTP. `None`: the camera's default, and
    /// [`DEFAULT_SNAPSHOT_FPS`](Self::DEFAULT_SNAPSHOT_FPS) for snapshots.
    pub fps: Option<f64>,
    /// Encoding of the frames; `None` for the best available one.
    pub encoding: Option<Encoding>,
    /// Fixed exposure time in seconds; `None` for automatic exposure.
    pub exposure_secs: Option<f64>,
    /// Fixed white balance in kelvin; `None` for automatic white balance.
    pub white_balance_kelvin: Option<u32>,
    /// Orientation of pictures with an Exif orientation. A calibration needs [`PixelFrame::Sensor`].
    pub frame: PixelFrame,
    /// Time without a frame after which a camera is [`Fault::Stale`](crate::Fault::Stale).
    pub stall_timeout: Duration,
    /// Number of bit-identical frames in a row from which on a frame is [`Fault::Frozen`](crate::Fault::Frozen).
    pub frozen_frames: u32,
}

impl OpenOptions {
    /// Default number of snapshots per second.
    pub const DEFAULT_SNAPSHOT_FPS: f64 = 5.0;
}

impl Default for OpenOptions {
    /// 640 × 480, stale after 2 s, frozen after 10 equal frames.
    fn default() -> Self {
        Self {
            width: 640,
            height: 480,
            fps: None,
            encoding: None,
            exposure_secs: None,
            white_balance_kelvin: None,
            frame: PixelFrame::Upright,
            stall_timeout: Duration::from_secs(2),
            frozen_frames: 10,
        }
    }
}
