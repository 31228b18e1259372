//! Live pictures: a trait, and its implementations for several kinds of cameras.
//!
//! ```text
//! Address ── open ── Source: V4L2 node, HTTP, program, folder ── Reconnecting ── Watched ── Box<dyn Camera>
//!                    pictures of one connection                  reconnects      Frame.faults   │
//!                                                                                  LatestFrame ─┘ a thread; newest frame only
//! MjpegServer: pictures out, to browsers on this computer
//! ```
//! [`Camera::next_frame`] returns a [`Frame`] or an error within about the stall timeout, or `None` at the end; it
//! waits longer only for a requested interval between pictures. A camera's problem is a [`Fault`]. If there is a
//! picture (frozen, black, other size, back again), the fault is in [`Frame::faults`]; without a picture (stale, torn,
//! gone), the fault is a [`CameraError::Fault`], and the next call tries again.
//!
//! Not in this crate: lenses and tables (crate `calibration`), the simulated camera (crate `simulation`, which opens
//! [`Address::Sim`]), topics of ROS 2 (crate `ros2`), TLS, sound, and video codecs other than motion JPEG.
//!
//! ```
//! use sdg_camera::{Address, OpenOptions, open};
//!
//! let folder = tempfile::tempdir()?;
//! image::RgbImage::from_pixel(4, 2, image::Rgb([9, 99, 199])).save(folder.path().join("a.png"))?;
//! let address: Address = format!("dir:{}", folder.path().display()).parse()?;
//! let mut camera = open(&address, &OpenOptions::default())?;
//! let frame = camera.next_frame()?.expect("one picture");
//! assert_eq!((frame.number, frame.picture.dimensions()), (0, (4, 2)));
//! assert!(camera.next_frame()?.is_none());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod address;
mod command_line;
mod decode;
mod error;
mod fault;
mod folder;
mod frame;
mod http;
mod latest;
mod open;
mod options;
mod program;
mod reconnecting;
mod server;
mod source;
mod splitter;
mod statistics;
pub mod v4l;
mod watched;
mod yuv;

pub use address::{Address, NodeName, Playback};
pub use command_line::CommandLine;
pub use decode::decode as decode_picture;
pub use error::CameraError;
pub use fault::Fault;
pub use frame::{Camera, Frame, mean_brightness};
pub use http::{Url, read_pictures, without_password};
pub use latest::LatestFrame;
pub use open::open;
pub use options::{Encoding, OpenOptions};
pub use sdg_picture::PixelFrame;
pub use server::MjpegServer;
pub use statistics::FrameStatistics;
pub use watched::Watched;
pub use yuv::yuyv_to_rgb;
