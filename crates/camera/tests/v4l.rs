//! Cameras of Video4Linux 2, read through real drivers: `make test-v4l` boots a kernel with them in QEMU.
//!
//! [`UsbCamera`] is a webcam simulated by the test; for `uvcvideo`, the driver of USB webcams, it is the same as a real
//! one. `vivid` is the kernel's test camera; it draws eight colour bars, by which the pixels are checked.

use std::time::{Duration, Instant};

use crate::usb_camera;
use image::RgbImage;
use linuxvideo::Device;
use linuxvideo::format::{PixFormat, PixelFormat};
use sdg_camera::v4l::{self, Node, Sizes};
use sdg_camera::{Address, Camera, CameraError, Encoding, Fault, Frame, OpenOptions};
use usb_camera::UsbCamera;

/// vivid's bars from left to right at 75 % (ITU-R BT.801): white, yellow, cyan, green, magenta, red, blue, black.
const BARS: [[u8; 3]; 8] =
    [[191, 191, 191], [191, 191, 0], [0, 191, 191], [0, 191, 0], [191, 0, 191], [191, 0, 0], [0, 0, 191], [0, 0, 0]];
/// Error of a conversion to whole steps of YUV and back.
const MAX_ERROR: u8 = 4;

fn vivid() -> Node {
    v4l::nodes().into_iter().find(|node| node.driver == "vivid").expect("vivid is loaded")
}

fn options(width: u32, height: u32, encoding: Encoding) -> OpenOptions {
    OpenOptions {
        width,
        height,
        encoding: Some(encoding),
        fps: Some(30.0),
        stall_timeout: Duration::from_secs(1),
        ..OpenOptions::default()
    }
}

fn try_open(address: &str, options: &OpenOptions) -> Result<Box<dyn Camera>, CameraError> {
    sdg_camera::open(&address.parse::<Address>().unwrap(), options)
}

/// The mean colour of the centre of each bar in the last rows, below the text.
fn bars(picture: &RgbImage) -> [[u8; 3]; 8] {
    let (width, height) = picture.dimensions();
    std::array::from_fn(|bar| {
        let middle = (2 * bar as u32 + 1) * width / 16;
        let mut sums = [0_u32; 3];
        for y in height - 8..height {
            for (sum, channel) in sums.iter_mut().zip(picture.get_pixel(middle, y).0) {
                *sum += u32::from(channel);
            }
        }
        sums.map(|sum| (sum / 8) as u8)
    })
}

fn assert_bars(frame: &Frame) {
    let found = bars(&frame.picture);
    let worst = found.iter().flatten().zip(BARS.iter().flatten()).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
    assert!(worst <= MAX_ERROR, "off by {worst}: expected {BARS:?}, found {found:?}");
}

/// Reads frames, checks that all are complete and have this size, and prints the rate.
fn read(camera: &mut dyn Camera, size: (u32, u32), count: u32) -> Vec<Frame> {
    let start = Instant::now();
    let frames: Vec<_> = (0..count).map(|_| camera.next_frame().unwrap().unwrap()).collect();
    println!("{count} frames of {} × {} in {:.2} s", size.0, size.1, start.elapsed().as_secs_f64());
    for frame in &frames {
        assert_eq!((frame.picture.dimensions(), frame.faults.as_slice()), (size, [].as_slice()));
    }
    frames
}

/// Presses one of vivid's buttons, or sets a switch, through a second file descriptor of the node.
fn inject(name: &str) {
    let mut device = Device::open(vivid().path).unwrap();
    let control =
        device.controls().map_while(Result::ok).find(|control| control.name() == name).map(|control| control.id());
    device.write_control_raw(control.unwrap_or_else(|| panic!("vivid has no {name}")), 1).unwrap();
}

#[test]
#[ignore = "needs vivid: make test-v4l"]
fn nodes_tell_their_formats_and_sizes() {
    let node = vivid();
    println!("{}: {} ({}), {}", node.path.display(), node.name, node.driver, node.bus);
    for encoding in [Encoding::Yuyv, Encoding::Rgb24] {
        let format = node.formats.iter().find(|format| format.encoding == Some(encoding)).unwrap();
        let Sizes::Listed(sizes) = &format.sizes else { panic!("vivid's webcam lists its sizes") };
        assert!(sizes.contains(&(640, 480)) && sizes.contains(&(1280, 720)), "{sizes:?}");
        // As in vivid's table, larger frames have lower rates.
        let fps_of = |size| format.max_fps[sizes.iter().position(|listed| *listed == size).unwrap()];
        assert_eq!([fps_of((640, 480)), fps_of((1280, 720))], [25.0, 12.5], "{:?}", format.max_fps);
    }
    assert!(node.formats.iter().any(|format| format.encoding.is_none()), "others are listed, too");
}

#[test]
#[ignore = "needs vivid: make test-v4l"]
fn yuyv_and_rgb_frames_have_the_bars_colours_and_the_format_can_change() {
    // Opened by name and by path.
    let path = format!("v4l:{}", vivid().path.display());
    let changes = [
        ("v4l:vivid", 640, 480, Encoding::Yuyv),
        (path.as_str(), 1280, 720, Encoding::Rgb24),
        ("v4l:VIVID", 320, 180, Encoding::Yuyv),
        ("v4l:vivid", 640, 480, Encoding::Rgb24),
    ];
    for (address, width, height, encoding) in changes {
        let mut camera = try_open(address, &options(width, height, encoding)).unwrap();
        let frames = read(camera.as_mut(), (width, height), 10);
        frames.iter().for_each(assert_bars);
        assert_eq!(frames[9].number, 9);
        assert_ne!(frames[0].picture, frames[9].picture, "the text tells the time");
    }
}

#[test]
#[ignore = "needs vivid: make test-v4l"]
fn another_program_cannot_change_the_format_of_a_running_camera() {
    let mut camera = try_open("v4l:vivid", &options(640, 480, Encoding::Yuyv)).unwrap();
    read(camera.as_mut(), (640, 480), 2);
    let other = Device::open(vivid().path).unwrap().video_capture(PixFormat::new(320, 180, PixelFormat::RGB3));
    assert_eq!(other.err().and_then(|error| error.raw_os_error()), Some(16), "EBUSY");
    read(camera.as_mut(), (640, 480), 5).iter().for_each(assert_bars);
    let busy = try_open("v4l:vivid", &options(640, 480, Encoding::Yuyv)).err().unwrap().to_string();
    assert!(busy.contains("v4l:vivid") && busy.contains("busy"), "{busy}");
}

#[test]
#[ignore = "needs vivid: make test-v4l"]
fn frames_are_new_however_long_nobody_read() {
    let mut camera = try_open("v4l:vivid", &options(640, 480, Encoding::Yuyv)).unwrap();
    let first = read(camera.as_mut(), (640, 480), 3).pop().unwrap();
    std::thread::sleep(Duration::from_secs(1));
    // The buffers were filled immediately and are a second old; they are discarded.
    let second = camera.next_frame().unwrap().unwrap();
    assert!(second.number > first.number + 1, "{} after {}", second.number, first.number);
}

#[test]
#[ignore = "needs vivid: make test-v4l"]
fn faults_of_the_driver_are_told_and_survived() {
    let mut camera = try_open("v4l:vivid", &options(640, 480, Encoding::Yuyv)).unwrap();
    read(camera.as_mut(), (640, 480), 2);
    inject("Inject V4L2_BUF_FLAG_ERROR");
    let torn = (0..10).find_map(|_| camera.next_frame().err()).expect("a faulty buffer");
    assert!(matches!(torn.fault(), Some(Fault::Torn { found }) if found.contains("marks as faulty")), "{torn}");
    read(camera.as_mut(), (640, 480), 3);

    inject("Inject Fatal Streaming Error");
    let mut faults = Vec::new();
    let frame = loop {
        match camera.next_frame() {
            Ok(frame) if !faults.is_empty() => break frame.unwrap(),
            Ok(_) => {}
            Err(error) => {
                assert!(error.is_passing() && faults.len() < 20, "{error}");
                faults.push(error.fault().unwrap().name());
            }
        }
    };
    println!("after a fatal error of the driver: {faults:?}, then {:?}", frame.faults);
    assert!(matches!(frame.faults[..], [Fault::Back { .. }]), "{:?}", frame.faults);
    assert_bars(&frame);
}

#[test]
#[ignore = "needs vivid: make test-v4l"]
fn a_camera_that_is_unplugged_comes_back() {
    let mut camera = try_open("v4l:vivid", &options(640, 480, Encoding::Yuyv)).unwrap();
    read(camera.as_mut(), (640, 480), 2);
    inject("Disconnect");
    let gone = (0..10).find_map(|_| camera.next_frame().err()).expect("the device is gone");
    assert!(matches!(gone.fault(), Some(Fault::Gone { .. })), "{gone}");
    // vivid reconnects itself after the last program has closed it.
    let frame = (0..20).find_map(|_| camera.next_frame().ok()).expect("it comes back").unwrap();
    assert!(matches!(frame.faults[..], [Fault::Back { .. }]), "{:?}", frame.faults);
    assert_bars(&frame);
}

#[test]
#[ignore = "needs vivid: make test-v4l"]
fn what_the_camera_does_not_have_is_refused() {
    let refused = |address: &str, options: &OpenOptions| try_open(address, options).err().unwrap().to_string();
    let exposure = OpenOptions { exposure_secs: Some(0.01), ..OpenOptions::default() };
    assert!(refused("v4l:vivid", &exposure).contains("the setting fixed exposure, found no V4L2 control"));
    let mjpeg = options(640, 480, Encoding::Mjpeg);
    let error = refused(&format!("v4l:{}", vivid().path.display()), &mjpeg);
    assert!(error.contains("expected the format MJPG") && error.contains("YUYV"), "{error}");
    let error = refused("v4l:no such card", &OpenOptions::default());
    assert!(error.contains("vivid"), "the available cameras are not named: {error}");
}

/// Options for this test's webcam.
fn webcam_options(width: u32, height: u32) -> OpenOptions {
    OpenOptions { width, height, stall_timeout: Duration::from_secs(2), ..OpenOptions::default() }
}

fn open_webcam(options: &OpenOptions) -> Box<dyn Camera> {
    // The kernel needs some time to create the node.
    let start = Instant::now();
    loop {
        match try_open("v4l:sdg test webcam", options) {
            Ok(camera) => return camera,
            Err(error) => assert!(start.elapsed() < Duration::from_secs(10), "{error}"),
        }
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// JPEG at quality 95 with halved colour resolution, measured away from edges.
const MAX_JPEG_ERROR: u8 = 8;

fn assert_webcam(frame: &Frame) {
    let (width, height) = frame.picture.dimensions();
    for (bar, expected) in usb_camera::BARS.iter().enumerate() {
        let found = frame.picture.get_pixel((2 * bar as u32 + 1) * width / 6, height / 2).0;
        let worst = found.iter().zip(expected).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
        assert!(worst <= MAX_JPEG_ERROR, "expected {expected:?}, found {found:?}");
    }
}

#[test]
#[ignore = "needs uvcvideo and vhci-hcd: make test-v4l"]
fn motion_jpeg_of_a_usb_webcam_without_huffman_tables_is_read() {
    let usb = UsbCamera::plug_in();
    for size in [(640, 480), (320, 240)] {
        let mut camera = open_webcam(&webcam_options(size.0, size.1));
        let frames = read(camera.as_mut(), size, 10);
        frames.iter().for_each(assert_webcam);
        assert_ne!(frames[0].picture, frames[9].picture, "a corner changes");
    }
    let mut camera = open_webcam(&webcam_options(640, 480));
    read(camera.as_mut(), (640, 480), 2);
    usb.cut_next_frame();
    let torn = (0..10).find_map(|_| camera.next_frame().err()).expect("a frame that is cut");
    assert!(matches!(torn.fault(), Some(Fault::Torn { found }) if found.contains("end marker")), "{torn}");
    read(camera.as_mut(), (640, 480), 2);
}

#[test]
#[ignore = "needs uvcvideo and vhci-hcd: make test-v4l"]
fn exposure_and_white_balance_of_a_usb_webcam_are_fixed() {
    let usb = UsbCamera::plug_in();
    drop(open_webcam(&webcam_options(640, 480)));
    let refused = |options: &OpenOptions| try_open("v4l:sdg test webcam", options).err().unwrap().to_string();
    let too_long = refused(&OpenOptions { exposure_secs: Some(9.0), ..webcam_options(640, 480) });
    assert!(
        too_long.contains("fixed exposure") && too_long.contains("from 0.1 ms to 500 ms, not to 9000 ms"),
        "{too_long}"
    );
    let bluish =
        OpenOptions { exposure_secs: Some(0.01), white_balance_kelvin: Some(9000), ..webcam_options(640, 480) };
    let bluish = refused(&bluish);
    assert!(
        bluish.contains("fixed white balance") && bluish.contains("from 2800 K to 6500 K, not to 9000 K"),
        "{bluish}"
    );
    // A refusal changes nothing: mode 2 is automatic.
    let settings = usb.settings();
    assert_eq!((settings.exposure_mode, settings.exposure, settings.white_balance_auto), (2, 156, 1));
    let fixed = OpenOptions { exposure_secs: Some(0.01), white_balance_kelvin: Some(4600), ..webcam_options(640, 480) };
    drop(open_webcam(&fixed));
    // 10 ms are 100 units of 100 µs; mode 1 is manual.
    let settings = usb.settings();
    assert_eq!((settings.exposure_mode, settings.exposure), (1, 100));
    assert_eq!((settings.white_balance_auto, settings.white_balance_kelvin), (0, 4600));
}

#[test]
#[ignore = "needs uvcvideo and vhci-hcd: make test-v4l"]
fn a_usb_webcam_that_is_pulled_out_and_plugged_in_again_comes_back() {
    let usb = UsbCamera::plug_in();
    let mut camera = open_webcam(&webcam_options(640, 480));
    read(camera.as_mut(), (640, 480), 3);
    drop(usb);
    let mut faults = Vec::new();
    while faults.len() < 3 {
        if let Err(error) = camera.next_frame() {
            faults.push(error.fault().expect("a passing error").name());
        }
    }
    assert!(faults.contains(&"gone"), "{faults:?}");
    let _usb = UsbCamera::plug_in();
    let start = Instant::now();
    let frame = loop {
        match camera.next_frame() {
            Ok(frame) => break frame.unwrap(),
            Err(error) => assert!(error.is_passing() && start.elapsed() < Duration::from_secs(20), "{error}"),
        }
    };
    assert!(matches!(frame.faults[..], [Fault::Back { .. }]), "{:?}", frame.faults);
    assert_webcam(&frame);
}
