//! A USB webcam in plain Rust: the kernel's `vhci-hcd` passes the data of the USB cable over a socket (USB/IP), and
//! this code answers as a camera of the USB video class with one bulk endpoint and motion JPEG.
//!
//! Sources: the kernel's Documentation/usb/usbip_protocol.rst; USB Device Class Definition for Video Devices 1.0.

mod descriptors;

use std::collections::VecDeque;
use std::fs;
use std::io::{ErrorKind, Read, Write};
use std::os::fd::AsRawFd;
use std::os::unix::net::UnixStream;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use descriptors::{FRAME_SIZES, MAX_PAYLOAD_BYTES};
use image::codecs::jpeg::JpegEncoder;
use image::{Rgb, RgbImage};

/// The picture: three bars from left to right.
pub const BARS: [[u8; 3]; 3] = [[200, 40, 40], [40, 160, 40], [60, 60, 220]];

const INTERVAL: Duration = Duration::from_millis(50);
/// Linux's EPIPE and ECONNRESET.
const STALLED: i32 = -32;
const UNLINKED: i32 = -104;

/// The settings made by the host.
#[derive(Debug, Clone, Copy)]
pub struct Settings {
    /// 1: manual.
    pub exposure_mode: u32,
    /// Exposure time in units of 100 µs.
    pub exposure: u32,
    pub white_balance_auto: u32,
    pub white_balance_kelvin: u32,
    is_next_cut: bool,
}

/// A webcam that is plugged in until it is dropped.
pub struct UsbCamera {
    settings: Arc<Mutex<Settings>>,
    cable: UnixStream,
    thread: Option<JoinHandle<()>>,
}

impl UsbCamera {
    pub fn plug_in() -> Self {
        let (cable, kernels_end) = UnixStream::pair().unwrap();
        // Port, socket, device number, speed: 3 is high speed. When a device is unplugged, its port becomes free after
        // a delay.
        let told = format!("0 {} 65537 3", kernels_end.as_raw_fd());
        let start = Instant::now();
        while let Err(error) = fs::write("/sys/devices/platform/vhci_hcd.0/attach", &told) {
            assert!(start.elapsed() < Duration::from_secs(10), "{error}");
            std::thread::sleep(Duration::from_millis(50));
        }
        let settings = Settings {
            exposure_mode: 2,
            exposure: 156,
            white_balance_auto: 1,
            white_balance_kelvin: 5000,
            is_next_cut: false,
        };
        let settings = Arc::new(Mutex::new(settings));
        let device = Device {
            cable: cable.try_clone().unwrap(),
            settings: Arc::clone(&settings),
            probe: descriptors::probe(1),
            waiting: VecDeque::new(),
            payload: Vec::new(),
            sent: 0,
            num_frames: 0,
            next_at: Instant::now(),
        };
        let thread = Some(std::thread::spawn(move || device.run()));
        Self { settings, cable, thread }
    }

    pub fn settings(&self) -> Settings {
        *self.settings.lock().unwrap()
    }

    /// Truncates the next frame in the middle.
    pub fn cut_next_frame(&self) {
        self.settings.lock().unwrap().is_next_cut = true;
    }
}

impl Drop for UsbCamera {
    fn drop(&mut self) {
        let _ = self.cable.shutdown(std::net::Shutdown::Both);
        let _ = self.thread.take().unwrap().join();
    }
}

struct Device {
    cable: UnixStream,
    settings: Arc<Mutex<Settings>>,
    /// The format and frame size negotiated by the host.
    probe: [u8; 26],
    /// Requests for stream data: sequence number and length.
    waiting: VecDeque<(u32, usize)>,
    /// The frame that is being sent, and the position in it.
    payload: Vec<u8>,
    sent: usize,
    num_frames: u32,
    next_at: Instant,
}

impl Device {
    /// Answers until the cable is unplugged.
    fn run(mut self) {
        let _ = self.cable.set_read_timeout(Some(Duration::from_millis(2)));
        loop {
            let mut header = [0; 48];
            match self.cable.read(&mut header) {
                Ok(0) => return,
                Ok(count) => {
                    if self.read_rest(&mut header, count).is_none() || self.answer(&header).is_none() {
                        return;
                    }
                }
                Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
                Err(_) => return,
            }
            if self.stream().is_none() {
                return;
            }
        }
    }

    fn read_rest(&mut self, bytes: &mut [u8], mut from: usize) -> Option<()> {
        while from < bytes.len() {
            match self.cable.read(&mut bytes[from..]) {
                Ok(0) => return None,
                Ok(count) => from += count,
                Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
                Err(_) => return None,
            }
        }
        Some(())
    }

    fn answer(&mut self, header: &[u8; 48]) -> Option<()> {
        let word = |at: usize| u32::from_be_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]);
        let (command, number, is_in, endpoint, length) = (word(0), word(4), word(12) == 1, word(16), word(24) as usize);
        if command == 2 {
            let unlinked = word(20);
            let before = self.waiting.len();
            self.waiting.retain(|(waiting, _)| *waiting != unlinked);
            let status = if self.waiting.len() < before { UNLINKED } else { 0 };
            return self.reply(4, number, status, 0, &[]);
        }
        let mut data = vec![0; if is_in { 0 } else { length }];
        self.read_rest(&mut data, 0)?;
        if endpoint != 0 {
            self.waiting.push_back((number, length));
            return Some(());
        }
        let setup: [u8; 8] = header[40..48].try_into().ok()?;
        match self.control(setup, &data) {
            Some(answer) if is_in => {
                let answer = &answer[..answer.len().min(length)];
                self.reply(3, number, 0, answer.len(), answer)
            }
            Some(_) => self.reply(3, number, 0, data.len(), &[]),
            None => self.reply(3, number, STALLED, 0, &[]),
        }
    }

    fn reply(&mut self, command: u32, number: u32, status: i32, length: usize, data: &[u8]) -> Option<()> {
        let mut bytes = Vec::with_capacity(48 + data.len());
        for word in [command, number, 0, 0, 0, status as u32, length as u32] {
            bytes.extend(word.to_be_bytes());
        }
        bytes.resize(48, 0);
        bytes.extend(data);
        self.cable.write_all(&bytes).ok()
    }

    /// Answers a control request: the data to return, empty if the request carries data; `None` for an unknown request.
    fn control(&mut self, setup: [u8; 8], data: &[u8]) -> Option<Vec<u8>> {
        let [kind, request, value_low, value_high, index_low, index_high, ..] = setup;
        match (kind, request) {
            (0x80, 6) => descriptors::descriptor(value_high, value_low),
            // SET_CONFIGURATION, SET_INTERFACE, CLEAR_FEATURE of an endpoint; GET_STATUS.
            (0x00, 9) | (0x01, 11) | (0x02, 1) => Some(Vec::new()),
            (0x80..=0x82, 0) => Some(vec![0, 0]),
            (0xa1 | 0x21, _) if index_low == 1 => self.stream_control(request, value_high, data),
            (0xa1 | 0x21, _) => self.camera_control(request, index_high, value_high, data),
            _ => None,
        }
    }

    /// Probe (1) and commit (2).
    fn stream_control(&mut self, request: u8, selector: u8, data: &[u8]) -> Option<Vec<u8>> {
        match (request, selector) {
            (0x01, 1 | 2) => {
                self.probe = descriptors::probe(*data.get(3)?);
                (self.payload, self.sent) = (Vec::new(), 0);
                Some(Vec::new())
            }
            (0x81..=0x83 | 0x87, 1 | 2) => Some(self.probe.to_vec()),
            (0x85, 1 | 2) => Some(vec![26, 0]),
            (0x86, 1 | 2) => Some(vec![3]),
            _ => None,
        }
    }

    /// Exposure (camera terminal 1) and white balance (processing unit 2).
    fn camera_control(&mut self, request: u8, entity: u8, selector: u8, data: &[u8]) -> Option<Vec<u8>> {
        let mut settings = self.settings.lock().unwrap();
        let (value, size, [min, max, step, default]) = match (entity, selector) {
            (1, 2) => (&mut settings.exposure_mode, 1, [1, 2, 3, 2]),
            (1, 4) => (&mut settings.exposure, 4, [1, 5000, 1, 156]),
            (2, 10) => (&mut settings.white_balance_kelvin, 2, [2800, 6500, 10, 5000]),
            (2, 11) => (&mut settings.white_balance_auto, 1, [0, 1, 1, 1]),
            _ => return None,
        };
        let told = match request {
            0x01 => {
                let mut bytes = [0; 4];
                bytes[..size].copy_from_slice(data.get(..size)?);
                *value = u32::from_le_bytes(bytes);
                return Some(Vec::new());
            }
            0x81 => *value,
            0x82 => min,
            0x83 => max,
            0x84 => step,
            0x85 => return Some(vec![size as u8, 0]),
            0x86 => return Some(vec![3]),
            0x87 => default,
            _ => return None,
        };
        Some(told.to_le_bytes()[..size].to_vec())
    }

    /// Answers requests for stream data: a frame is one payload, ended by a short transfer.
    fn stream(&mut self) -> Option<()> {
        while let Some(&(number, length)) = self.waiting.front() {
            if self.sent == self.payload.len() {
                if Instant::now() < self.next_at {
                    return Some(());
                }
                self.next_at = Instant::now() + INTERVAL;
                self.next_payload(length);
            }
            self.waiting.pop_front();
            let end = (self.sent + length).min(self.payload.len());
            let piece = self.payload[self.sent..end].to_vec();
            self.sent = end;
            self.reply(3, number, 0, piece.len(), &piece)?;
        }
        Some(())
    }

    fn next_payload(&mut self, request_bytes: usize) {
        let size = FRAME_SIZES[usize::from(self.probe[3]).clamp(1, FRAME_SIZES.len()) - 1];
        let mut jpeg = webcam_jpeg(size, self.num_frames);
        if std::mem::take(&mut self.settings.lock().unwrap().is_next_cut) {
            jpeg.truncate(jpeg.len() / 2);
        }
        // End of frame, and a bit that alternates from frame to frame.
        self.payload = vec![2, 0x82 | (self.num_frames % 2) as u8];
        self.payload.extend(jpeg);
        if self.payload.len().is_multiple_of(request_bytes) {
            self.payload.push(0);
        }
        assert!(self.payload.len() < MAX_PAYLOAD_BYTES as usize);
        self.sent = 0;
        self.num_frames += 1;
    }
}

/// A JPEG with three bars, a corner that differs between frames, and no Huffman tables.
fn webcam_jpeg((width, height): (u16, u16), number: u32) -> Vec<u8> {
    let (width, height) = (u32::from(width), u32::from(height));
    let picture = RgbImage::from_fn(width, height, |x, y| {
        if x < 32 && y < 32 { Rgb([(number * 40) as u8; 3]) } else { Rgb(BARS[(x * 3 / width) as usize]) }
    });
    let mut jpeg = Vec::new();
    JpegEncoder::new_with_quality(&mut jpeg, 95).encode_image(&picture).unwrap();
    let (mut bare, mut at) = (jpeg[..2].to_vec(), 2);
    // The segments up to the start of scan; 0xc4 marks the tables.
    while jpeg[at + 1] != 0xda {
        let end = at + 2 + usize::from(u16::from_be_bytes([jpeg[at + 2], jpeg[at + 3]]));
        if jpeg[at + 1] != 0xc4 {
            bare.extend(&jpeg[at..end]);
        }
        at = end;
    }
    bare.extend(&jpeg[at..]);
    bare
}
