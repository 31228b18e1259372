//! One test binary for all files of this folder, because each binary links the whole crate.
#![allow(clippy::unwrap_used)]

mod folders;
mod hostile_server;
mod mjpeg_server;
mod programs;
mod support;
mod usb_camera;
#[cfg(target_os = "linux")]
mod v4l;
