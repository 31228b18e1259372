//! Reads frames from a node.

use std::path::PathBuf;
use std::thread::sleep;
use std::time::{Duration, Instant};

use linuxvideo::controls::Cid;
use linuxvideo::format::{PixFormat, PixelFormat};
use linuxvideo::stream::ReadStream;
use linuxvideo::{Device, Fract};
use sdg_picture::PixelFrame;

use super::choice::{Choice, choose};
use super::nodes::{nodes, paths, read};
use crate::address::{Address, NodeName};
use crate::decode::{MAX_SIDE, decode};
use crate::error::CameraError;
use crate::options::{Encoding, OpenOptions};
use crate::source::{Missing, Source, Taken};
use crate::yuv::{rgb24_to_rgb, yuyv_to_rgb};

/// Interval between checks for a filled buffer: the operating system's own wait has no timeout.
const POLL_INTERVAL: Duration = Duration::from_millis(1);
/// If no picture was read for longer than this, the filled buffers are too old and are dropped.
const MAX_AGE: Duration = Duration::from_millis(200);
/// V4L2's exposure times are in units of 100 µs.
const EXPOSURE_UNITS_PER_SEC: f64 = 1e4;
/// V4L2_EXPOSURE_MANUAL.
const EXPOSURE_MANUAL: i32 = 1;

/// Opens a node and starts its stream.
///
/// # Errors
/// [`CameraError::Open`] if there is no such node or it has no supported format, [`CameraError::Setting`] if it rejects
/// a fixed exposure or white balance.
pub(crate) fn open(name: &NodeName, options: &OpenOptions) -> Result<Box<dyn Source>, CameraError> {
    let address = Address::V4l(name.clone()).to_string();
    let refused = |why: String| CameraError::Open { address: address.clone(), why };
    let path = find(name, options).map_err(refused)?;
    let node = read(&path).map_err(|error| refused(format!("{} does not open: {error}", path.display())))?;
    let offered = || node.formats.iter().map(|format| format.fourcc.as_str()).collect::<Vec<_>>().join(", ");
    let choice = choose(&node.formats, options).ok_or_else(|| {
        let expected = options.encoding.map_or_else(all_encodings, fourcc);
        refused(format!("expected the format {expected} of {}, found {}", path.display(), offered()))
    })?;
    let failed = |step: &str, error: std::io::Error| refused(format!("{} {step}: {error}", path.display()));
    let mut device = Device::open(&path).map_err(|error| failed("does not open", error))?;
    set_controls(&mut device, options, &address)?;
    Ok(Box::new(Stream::start(device, choice, options).map_err(|(step, error)| failed(step, error))?))
}

fn fourcc(encoding: Encoding) -> String {
    String::from_utf8_lossy(&encoding.fourcc()).into_owned()
}

fn all_encodings() -> String {
    Encoding::ALL.map(fourcc).join(" or ")
}

/// The path of the node, or text that says why there is none.
fn find(name: &NodeName, options: &OpenOptions) -> Result<PathBuf, String> {
    if let NodeName::Path(path) = name {
        return Ok(path.clone());
    }
    let nodes = nodes();
    let is_meant = |card: &str| match name {
        NodeName::Card(part) => card.to_lowercase().contains(&part.to_lowercase()),
        _ => true,
    };
    let mut readable = nodes.iter().filter(|node| choose(&node.formats, options).is_some());
    if let Some(node) = readable.find(|node| is_meant(&node.name)) {
        return Ok(node.path.clone());
    }
    let expected = match name {
        NodeName::Card(part) => format!("a V4L2 camera with \"{part}\" in its name"),
        _ => format!("a V4L2 camera with the format {}", options.encoding.map_or_else(all_encodings, fourcc)),
    };
    let found: Vec<_> = nodes.iter().map(|node| format!("{} ({})", node.path.display(), node.name)).collect();
    Err(match (found.is_empty(), paths().is_empty()) {
        (false, _) => format!("expected {expected}, found {}", found.join(", ")),
        (true, true) => format!("expected {expected}, found no /dev/video*"),
        (true, false) => {
            format!(
                "expected {expected}, found {} nodes in /dev, none of which can be opened and captures pictures",
                paths().len()
            )
        }
    })
}

/// Sets a fixed exposure and white balance if requested. All values are checked before the first one is written, so that
/// a refused setting does not leave the camera in a manual mode.
fn set_controls(device: &mut Device, options: &OpenOptions, address: &str) -> Result<(), CameraError> {
    let refused =
        |setting: &'static str, found: String| CameraError::Setting { address: address.to_owned(), setting, found };
    let values = requested_values(options);
    for &(setting, control, value) in &values {
        check_value(device, control, value).map_err(|found| refused(setting, found))?;
    }
    for (setting, control, value) in values {
        let written = device.write_control_raw(control, value);
        written.map_err(|error| refused(setting, format!("that it rejects {}: {error}", in_words(control, value))))?;
    }
    Ok(())
}

/// The requested values, each with the name of its setting, in the order of writing.
fn requested_values(options: &OpenOptions) -> Vec<(&'static str, Cid, i32)> {
    let mut values = Vec::new();
    if let Some(secs) = options.exposure_secs {
        let units = (secs * EXPOSURE_UNITS_PER_SEC).round() as i32;
        let controls = [(Cid::EXPOSURE_AUTO, EXPOSURE_MANUAL), (Cid::EXPOSURE_ABSOLUTE, units)];
        values.extend(controls.map(|(control, value)| ("fixed exposure", control, value)));
    }
    if let Some(kelvin) = options.white_balance_kelvin {
        let kelvin = i32::try_from(kelvin).unwrap_or(i32::MAX);
        let controls = [(Cid::AUTO_WHITE_BALANCE, 0), (Cid::WHITE_BALANCE_TEMPERATURE, kelvin)];
        values.extend(controls.map(|(control, value)| ("fixed white balance", control, value)));
    }
    values
}

/// A value of a control, with the unit of its option on the command line.
fn in_words(control: Cid, value: i32) -> String {
    if control == Cid::EXPOSURE_ABSOLUTE {
        format!("{} ms", 1e3 * f64::from(value) / EXPOSURE_UNITS_PER_SEC)
    } else if control == Cid::WHITE_BALANCE_TEMPERATURE {
        format!("{value} K")
    } else {
        value.to_string()
    }
}

/// Checks that the device has a control, and the value is in its range; the error says what was found.
fn check_value(device: &Device, control: Cid, value: i32) -> Result<(), String> {
    let range = device.controls().map_while(Result::ok).find(|known| known.id() == control);
    let range = range.ok_or_else(|| format!("no V4L2 control {control:?}"))?;
    let (min, max) = (range.minimum(), range.maximum());
    if (min..=max).contains(&value) {
        return Ok(());
    }
    let [min, max, value] = [min, max, value].map(|value| in_words(control, value));
    Err(format!("that {} goes from {min} to {max}, not to {value}", range.name()))
}

struct Stream {
    stream: ReadStream,
    encoding: Encoding,
    width: u32,
    height: u32,
    bytes_per_row: usize,
    last_read: Instant,
}

impl Stream {
    fn start(device: Device, choice: Choice, options: &OpenOptions) -> Result<Self, (&'static str, std::io::Error)> {
        let format = PixelFormat::from_fourcc(choice.encoding.fourcc());
        let wanted = PixFormat::new(choice.size.0, choice.size.1, format);
        let capture = device.video_capture(wanted).map_err(|error| ("does not accept the format", error))?;
        let given = capture.format();
        let (width, height) = (given.width(), given.height());
        if given.pixel_format() != format || width == 0 || height == 0 || width > MAX_SIDE || height > MAX_SIDE {
            let found = format!("expected {format}, found {} of {width} × {height} pixels", given.pixel_format());
            return Err(("uses another format", std::io::Error::other(found)));
        }
        let bytes_per_row = given.bytes_per_line() as usize;
        if let Some(fps) = options.fps {
            // The driver uses the nearest rate that it supports; the times of the frames show this rate. A driver
            // without frame rates returns an error.
            let interval = Fract::new(1000, (fps * 1000.0).round() as u32);
            capture.set_frame_interval(interval).map_err(|error| ("does not accept the frame rate", error))?;
        }
        let stream = capture.into_stream().map_err(|error| ("does not start", error))?;
        Ok(Self { stream, encoding: choice.encoding, width, height, bytes_per_row, last_read: Instant::now() })
    }

    /// Waits for a filled buffer.
    fn wait(&self, deadline: Instant) -> Result<(), Missing> {
        while self.stream.will_block().map_err(gone)? {
            if Instant::now() >= deadline {
                return Err(Missing::Late);
            }
            sleep(POLL_INTERVAL);
        }
        Ok(())
    }
}

fn gone(error: std::io::Error) -> Missing {
    Missing::Gone(format!("the device does not answer: {error}"))
}

impl Source for Stream {
    fn take(&mut self, deadline: Instant) -> Result<Option<Taken>, Missing> {
        let mut num_skipped = 0;
        if self.last_read.elapsed() > MAX_AGE {
            while !self.stream.will_block().map_err(gone)? {
                self.stream.dequeue(|_| Ok(())).map_err(gone)?;
                num_skipped += 1;
            }
        }
        self.wait(deadline)?;
        let (encoding, width, height, stride) = (self.encoding, self.width, self.height, self.bytes_per_row);
        let decoded = self.stream.dequeue(|buffer| {
            if buffer.is_error() {
                return Ok(Err(format!("{} bytes that the driver marks as faulty", buffer.len())));
            }
            Ok(match encoding {
                Encoding::Yuyv => yuyv_to_rgb(&buffer, width, height, stride),
                Encoding::Rgb24 => rgb24_to_rgb(&buffer, width, height, stride),
                Encoding::Mjpeg => decode(&buffer, PixelFrame::Sensor),
            })
        });
        self.last_read = Instant::now();
        let picture = decoded.map_err(gone)?.map_err(Missing::Torn)?;
        Ok(Some(Taken { num_skipped, ..Taken::now(picture) }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn values_have_the_unit_of_their_option() {
        let exposure = OpenOptions { exposure_secs: Some(0.008), ..OpenOptions::default() };
        let told = |options: &OpenOptions| -> Vec<String> {
            requested_values(options).into_iter().map(|(_, control, value)| in_words(control, value)).collect()
        };
        assert_eq!(told(&exposure), ["1", "8 ms"]);
        assert_eq!(in_words(Cid::EXPOSURE_ABSOLUTE, 3), "0.3 ms");
        let white_balance = OpenOptions { white_balance_kelvin: Some(4600), ..OpenOptions::default() };
        assert_eq!(told(&white_balance), ["0", "4600 K"]);
    }

    #[test]
    fn what_is_no_node_is_refused_with_its_path() {
        let refused =
            |path: &Path| open(&NodeName::Path(path.to_owned()), &OpenOptions::default()).err().unwrap().to_string();
        for path in ["/dev/null", "/dev/video-none", "/"] {
            let error = refused(Path::new(path));
            assert!(error.contains(&format!("v4l:{path}: {path} does not open")), "{error}");
        }
        let name = NodeName::Card("no such card".to_owned());
        let error = open(&name, &OpenOptions::default()).err().unwrap().to_string();
        assert!(error.contains("\"no such card\" in its name, found"), "{error}");
    }
}
