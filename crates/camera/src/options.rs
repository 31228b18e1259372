//! The options of a camera.

use std::time::Duration;

use sdg_picture::PixelFrame;

/// How a V4L2 camera encodes its frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// YUYV: 4:2:2, two bytes a pixel.
    Yuyv,
    /// RGB24 (V4L2's `RGB3`): three bytes a pixel.
    Rgb24,
    /// Motion JPEG (V4L2's `MJPG`).
    Mjpeg,
}

impl Encoding {
    /// All of them, in the order in which they are preferred: nothing lost first.
    pub const ALL: [Self; 3] = [Self::Rgb24, Self::Yuyv, Self::Mjpeg];

    /// V4L2's four letters.
    pub fn fourcc(self) -> [u8; 4] {
        match self {
            Self::Yuyv => *b"YUYV",
            Self::Rgb24 => *b"RGB3",
            Self::Mjpeg => *b"MJPG",
        }
    }
}

/// What a camera is asked for. `width`, `height`, `encoding`, `exposure_secs` and `white_balance_kelvin` are for V4L2; the other
/// kinds of camera deliver what they have, whose size the frames tell.
#[derive(Debug, Clone)]
pub struct OpenOptions {
    /// Pixels in a row; the nearest size there is.
    pub width: u32,
    /// Height, in pixels.
    pub height: u32,
    /// Frames a second: of a V4L2 camera, or how often a snapshot is fetched over HTTP. `None`: as the camera likes, and
    /// [`DEFAULT_SNAPSHOT_FPS`](Self::DEFAULT_SNAPSHOT_FPS) snapshots a second.
    pub fps: Option<f64>,
    /// How frames are encoded; the best there is where `None`.
    pub encoding: Option<Encoding>,
    /// A fixed exposure time in seconds; automatic where `None`.
    pub exposure_secs: Option<f64>,
    /// A fixed white balance in kelvin; automatic where `None`.
    pub white_balance_kelvin: Option<u32>,
    /// Which way up pictures with an Exif orientation are: with a calibration, the sensor's.
    pub frame: PixelFrame,
    /// Without a frame for so long a camera is [`Fault::Stale`](crate::Fault::Stale).
    pub stall_timeout: Duration,
    /// The same bits in so many frames in a row are [`Fault::Frozen`](crate::Fault::Frozen).
    pub frozen_frames: u32,
}

impl OpenOptions {
    /// Snapshots a second that are fetched where nothing else is asked for.
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
