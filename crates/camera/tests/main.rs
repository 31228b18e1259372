//! One program for all tests of this folder: each links the whole crate.
#![allow(clippy::unwrap_used)]

mod hostile_server;
mod latest_schedules;
mod mjpeg_server;
mod programs;
mod support;
mod usb_camera;
#[cfg(target_os = "linux")]
mod v4l;
