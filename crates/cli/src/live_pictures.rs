//! `--from ADDRESS`: opens a camera with the crate for its address.

use std::time::Duration;

use anyhow::{Context, Result};
use clap::Args;
use sdg_camera::{Address, Camera, CameraError, Encoding, Fault, Frame, OpenOptions};

use crate::exit::Usage;
use crate::interrupt::Interrupt;
use crate::shared_args::seconds;

/// A camera and its settings.
#[derive(Debug, Args)]
pub struct LiveArgs {
    /// The camera: v4l:, v4l:/dev/video0, v4l:NAME, http://HOST/PATH, 'cmd:PROGRAM ARGUMENTS', dir:FOLDER, file:PATH,
    /// sim: or ros2:TOPIC.
    ///
    /// Folders and files take options after a question mark: dir:FOLDER?fps=10&loop, dir:FOLDER?follow
    #[arg(long, value_name = "ADDRESS")]
    pub from: Address,
    /// Settings of the camera
    #[command(flatten)]
    pub request: RequestArgs,
}

/// The heading of these options in the help.
const LIVE: &str = "Live pictures";

/// Default size requested from a V4L2 camera.
const DEFAULT_SIZE: (u32, u32) = (640, 480);
/// Default time without a frame after which a camera is stale.
const DEFAULT_STALL_SECS: f64 = 2.0;
/// Maximum number of consecutive faults that are skipped: half a minute with the default stall timeout.
const MAX_FAULTS: u32 = 15;

/// Settings of a camera.
#[derive(Debug, Args)]
#[command(next_help_heading = LIVE)]
pub struct RequestArgs {
    /// Width and height in pixels requested from a V4L2 camera; default: 640x480
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<(u32, u32)>,
    /// Frames per second requested from a V4L2 camera; snapshots per second over HTTP
    #[arg(long, value_name = "N")]
    pub fps: Option<f64>,
    /// Encoding of a V4L2 camera's frames; default: the one with the smallest loss
    #[arg(long, value_name = "NAME")]
    pub encoding: Option<EncodingName>,
    /// A fixed exposure time of a V4L2 camera
    #[arg(long, value_name = "MS")]
    pub exposure_ms: Option<f64>,
    /// A fixed white balance of a V4L2 camera
    #[arg(long, value_name = "KELVIN")]
    pub white_balance_kelvin: Option<u32>,
    /// Seconds without a frame after which a camera is stale; default: 2
    #[arg(long, value_name = "SECS", value_parser = stall_seconds)]
    pub stall_secs: Option<f64>,
}

/// Parses a time without frames; the limits are those of cameras.
fn stall_seconds(text: &str) -> Result<f64, String> {
    let secs = seconds(text)?;
    if (0.01..=3600.0).contains(&secs) { Ok(secs) } else { Err("expected 0.01 to 3600 seconds".to_owned()) }
}

/// The names of encodings on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum EncodingName {
    /// 4:2:2, two bytes per pixel
    Yuyv,
    /// Three bytes per pixel
    Rgb24,
    /// Motion JPEG
    Mjpeg,
}

impl From<EncodingName> for Encoding {
    fn from(name: EncodingName) -> Self {
        match name {
            EncodingName::Yuyv => Self::Yuyv,
            EncodingName::Rgb24 => Self::Rgb24,
            EncodingName::Mjpeg => Self::Mjpeg,
        }
    }
}

impl LiveArgs {
    /// The settings in the form of the camera crate.
    ///
    /// # Errors
    /// The errors of [`RequestArgs::options`].
    pub(crate) fn options(&self) -> Result<OpenOptions, Usage> {
        self.request.options(&self.from)
    }
}

impl RequestArgs {
    /// Rejects camera settings given without a camera; `own` lists further such options of the command and states for
    /// each whether it is given.
    ///
    /// # Errors
    /// [`Usage`] with the names of the given options.
    pub(crate) fn refuse_without_camera(&self, own: &[(&'static str, bool)], found: &str) -> Result<(), Usage> {
        let of_any_camera = [("--stall-secs", self.stall_secs.is_some())];
        let settings = self.settings();
        let given = own.iter().chain(&settings).chain(&of_any_camera).filter(|(_, is_given)| *is_given);
        let given: Vec<_> = given.map(|(name, _)| *name).collect();
        if given.is_empty() {
            return Ok(());
        }
        Err(Usage(format!("{}: expected live pictures (--from ADDRESS), found {found}", given.join(", "))))
    }

    /// The options that only some cameras have, and whether each is given.
    fn settings(&self) -> [(&'static str, bool); 5] {
        [
            ("--size", self.size.is_some()),
            ("--fps", self.fps.is_some()),
            ("--encoding", self.encoding.is_some()),
            ("--exposure-ms", self.exposure_ms.is_some()),
            ("--white-balance-kelvin", self.white_balance_kelvin.is_some()),
        ]
    }

    /// Rejects `--size` if pictures have another size; `whose` says what their size is that of.
    ///
    /// # Errors
    /// [`Usage`] with both sizes.
    pub(crate) fn check_size(&self, [width, height]: [u32; 2], whose: &str) -> Result<(), Usage> {
        match self.size.filter(|&asked| asked != (width, height)) {
            Some((asked_width, asked_height)) => Err(Usage(format!(
                "--size: expected {width}x{height}, the size {whose}, found {asked_width}x{asked_height}"
            ))),
            None => Ok(()),
        }
    }

    /// The settings in the form of the crate that opens the camera.
    ///
    /// # Errors
    /// [`Usage`] if a setting is given that the camera at this address does not have.
    pub(crate) fn options(&self, address: &Address) -> Result<OpenOptions, Usage> {
        let has = |setting: &str| match address {
            Address::V4l(_) => true,
            Address::Http(_) => setting == "--fps",
            _ => false,
        };
        let missing = self.settings().into_iter().filter(|&(setting, is_given)| is_given && !has(setting));
        let missing: Vec<_> = missing.map(|(setting, _)| setting).collect();
        if !missing.is_empty() {
            let missing = missing.join(", ");
            return Err(Usage(format!(
                "{missing}: expected a V4L2 camera (v4l:), or http: for --fps, found {address}"
            )));
        }
        let (width, height) = self.size.unwrap_or(DEFAULT_SIZE);
        Ok(OpenOptions {
            width,
            height,
            fps: self.fps,
            encoding: self.encoding.map(Encoding::from),
            exposure_secs: self.exposure_ms.map(|ms| ms / 1e3),
            white_balance_kelvin: self.white_balance_kelvin,
            stall_timeout: Duration::from_secs_f64(self.stall_secs.unwrap_or(DEFAULT_STALL_SECS)),
            ..OpenOptions::default()
        })
    }
}

/// Opens a camera.
///
/// # Errors
/// The camera cannot be opened, or rejects a setting.
pub(crate) fn open(address: &Address, options: &OpenOptions) -> Result<Box<dyn Camera>> {
    match address {
        #[cfg(feature = "simulation")]
        Address::Sim(text) => {
            let camera = sdg_simulation::table_camera::TableCamera::open(text).context("--from")?;
            Ok(Box::new(camera))
        }
        #[cfg(not(feature = "simulation"))]
        Address::Sim(_) => Err(Usage(
            "--from sim: this sdg was built without the simulator: expected a build with cargo's feature \"simulation\""
                .to_owned(),
        )
        .into()),
        #[cfg(feature = "ros2")]
        Address::Ros2(text) => {
            use sdg_ros2::dds::{RosCamera, TopicAddress};
            let topic: TopicAddress = text.parse().map_err(|why| Usage(format!("--from ros2: {why}")))?;
            let camera = RosCamera::open(&topic, &address.to_string(), options.stall_timeout).context("--from")?;
            Ok(Box::new(sdg_camera::Watched::new(camera, Some(options.frozen_frames))))
        }
        #[cfg(not(feature = "ros2"))]
        Address::Ros2(_) => Err(Usage(
            "--from ros2: this sdg was built without ROS 2: expected a build with cargo's feature \"ros2\"".to_owned(),
        )
        .into()),
        address => sdg_camera::open(address, options).context("--from"),
    }
}

fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let sides = text.split_once('x').and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)));
    let sides = sides.filter(|(width, height)| (1..=16384).contains(width) && (1..=16384).contains(height));
    sides.ok_or_else(|| "expected width and height in pixels, as in 640x480".to_owned())
}

/// The next frame; `None` after the last one, or if Ctrl-C was pressed before a frame came. Temporary faults are printed
/// and skipped, up to a maximum number.
///
/// # Errors
/// A permanent fault, or too many temporary ones in a row.
pub fn next_frame(camera: &mut dyn Camera, interrupt: &Interrupt) -> Result<Option<Frame>> {
    let mut num_faults = 0;
    while !interrupt.is_requested() {
        match camera.next_frame() {
            Ok(frame) => return Ok(frame),
            // A folder that gets no picture for a while is no fault.
            Err(CameraError::Fault { camera, fault: Fault::Stale { .. } }) if camera.starts_with("dir:") => {}
            Err(error) if error.is_passing() && num_faults < MAX_FAULTS => {
                eprintln!("sdg: {error}");
                num_faults += 1;
            }
            Err(error) => return Err(error.into()),
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::RgbImage;
    use sdg_camera::LatestFrame;
    use std::sync::mpsc::{Sender, channel};

    /// Twice as many faults as are skipped, then a frame, then the end, before which it sends a message.
    struct Recovering(u32, Sender<()>);

    impl Camera for Recovering {
        fn next_frame(&mut self) -> Result<Option<Frame>, CameraError> {
            self.0 += 1;
            match self.0 {
                number if number <= 2 * MAX_FAULTS => {
                    Err(CameraError::Fault { camera: "test:".to_owned(), fault: Fault::Black })
                }
                number if number == 2 * MAX_FAULTS + 1 => Ok(Some(Frame::new(RgbImage::new(1, 1), 0, "test:".into()))),
                _ => {
                    let _ = self.1.send(());
                    Ok(None)
                }
            }
        }
    }

    #[test]
    fn faults_while_nobody_reads_are_skipped() {
        let (send, has_frame) = channel();
        let mut camera = LatestFrame::spawn(Box::new(Recovering(0, send)));
        // The call after the frame shows that the frame is stored.
        has_frame.recv().unwrap();
        assert_eq!(next_frame(&mut camera, &Interrupt::default()).unwrap().unwrap().number, 0);
    }

    #[test]
    fn what_cannot_be_opened_is_named_with_its_option() {
        let address = "dir:/nowhere/at/all".parse().unwrap();
        let line = crate::exit::one_line(&open(&address, &OpenOptions::default()).err().unwrap());
        assert!(line.starts_with("--from: dir:/nowhere/at/all") && line.contains("expected a folder"), "{line}");
    }

    #[test]
    fn sizes_have_two_sides() {
        assert_eq!(parse_size("640x480"), Ok((640, 480)));
        for text in ["640", "640x", "0x480", "640x99999", "640 x 480", "640X480"] {
            assert!(parse_size(text).is_err(), "{text}");
        }
    }
}
