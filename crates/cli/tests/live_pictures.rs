//! `sdg camera list`, `grab` and `watch`, and invalid addresses.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::camera::WRIST_CAMERA;
use crate::picture_kinds::with_orientation;
use crate::support::{Folder, sdg};
use image::{Rgb, RgbImage};
use serde_json::Value;

fn lines(output: &Output) -> Vec<Value> {
    String::from_utf8_lossy(&output.stdout).lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// Asserts the exit code, and that standard error contains every part.
fn assert_refused(output: &Output, code: i32, parts: &[&str]) {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{stderr}");
    for part in parts {
        assert!(stderr.contains(part), "expected \"{part}\" in: {stderr}");
    }
    assert!(!stderr.contains("panicked"), "{stderr}");
}

/// A folder with three pictures of brightness 60, 90, 120.
fn pictures() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, level) in [("a.png", 60), ("b.png", 90), ("c.png", 120)] {
        RgbImage::from_pixel(32, 24, Rgb([level; 3])).save(folder.path().join(name)).unwrap();
    }
    folder
}

fn level(path: &Path) -> u8 {
    image::open(path).unwrap().to_rgb8().get_pixel(5, 5)[0]
}

#[test]
fn list_says_what_there_is_or_that_there_is_nothing() {
    let told = sdg(&["camera", "list"]);
    let listed = lines(&sdg(&["camera", "list", "--json"]));
    let cameras = listed[0]["cameras"].as_array().unwrap();
    // The test passes on machines with and without a camera.
    assert_eq!(told.status.code(), Some(if cameras.is_empty() { 3 } else { 0 }));
    let text = String::from_utf8_lossy(&told.stdout).into_owned();
    assert!(text.contains(if cameras.is_empty() { "no V4L2 camera" } else { "v4l:/dev/video" }), "{text}");
}

#[test]
fn one_frame_goes_to_a_file_and_several_to_a_folder() {
    let (from, out) = (pictures(), tempfile::tempdir().unwrap());
    let address = format!("dir:{}", from.path().display());
    let file = out.path().join("one.png");
    let output = sdg(&["camera", "grab", "--from", &address, "--out", file.to_str().unwrap()]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(String::from_utf8_lossy(&output.stdout).contains("frame 0, 32 × 24 pixels"));
    assert_eq!(level(&file), 60);

    let folder = out.path().join("many");
    let output =
        sdg(&["camera", "grab", "--from", &address, "--count", "9", "--out", folder.to_str().unwrap(), "--json"]);
    assert_refused(&output, 0, &["3 of 9 frames"]);
    let told = lines(&output);
    assert_eq!(told.len(), 3);
    for (i, (line, expected)) in told.iter().zip([60, 90, 120]).enumerate() {
        assert_eq!((line["number"].as_u64(), line["width"].as_u64()), (Some(i as u64), Some(32)), "{line}");
        assert_eq!(line["camera"], address.as_str());
        assert!(line["captured_unix_secs"].as_f64().unwrap() > 1.6e9);
        assert_eq!(level(Path::new(line["file"].as_str().unwrap())), expected);
    }
}

/// The numbers of three frames, grabbed every half second from a camera with ten pictures per second, each 10 levels
/// brighter than the previous one. The first is followed by a pause.
fn grabbed_every_half_second(pause_secs: f64) -> Vec<u64> {
    let out = tempfile::tempdir().unwrap();
    let picture = |i: u32| {
        let (level, secs) = (10 * i, if i == 1 { pause_secs } else { 0.1 });
        format!("printf 'P6 1 1 255 '; printf '\\{level:o}\\{level:o}\\{level:o}'; sleep {secs};")
    };
    let file = out.path().join("camera.sh");
    fs::write(&file, (1..20).map(picture).collect::<String>()).unwrap();
    let address = format!("cmd:sh '{}'", file.display());
    let folder = out.path().join("frames");
    let arguments = ["--count", "3", "--every", "0.5", "--json", "--out", folder.to_str().unwrap()];
    let output = sdg(&[&["camera", "grab", "--from", &address], arguments.as_slice()].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    lines(&output).iter().map(|line| line["number"].as_u64().unwrap()).collect()
}

#[test]
fn frames_come_at_their_times_and_are_the_newest() {
    let start = Instant::now();
    let numbers = grabbed_every_half_second(0.1);
    assert!(start.elapsed().as_secs_f64() >= 1.0);
    // Half a second is five pictures, fewer on a busy machine. Without skipping, the pictures would be 0, 1, 2.
    assert!(numbers[1] >= numbers[0] + 2 && numbers[2] >= numbers[1] + 2, "{numbers:?}");
    // In a pause, the time of the second and of the third frame passes; the third is still half a second later.
    let numbers = grabbed_every_half_second(1.3);
    assert!(numbers[2] >= numbers[1] + 2, "{numbers:?}");
}

#[test]
fn ctrl_c_ends_the_wait_for_a_frame_and_keeps_the_frames_so_far() {
    let (from, out) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    RgbImage::from_pixel(32, 24, Rgb([60; 3])).save(from.path().join("a.png")).unwrap();
    let (address, folder) = (format!("dir:{}?follow", from.path().display()), out.path().to_str().unwrap());
    let mut child = Command::new(env!("CARGO_BIN_EXE_sdg"))
        .args(["camera", "grab", "--from", &address, "--count", "2", "--stall-secs", "0.1", "--out", folder])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut first = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut first).unwrap();
    assert!(first.contains("frame 0, 32 × 24 pixels"), "{first}");
    // No further picture comes.
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if start.elapsed() > Duration::from_secs(60) {
            child.kill().unwrap();
            panic!("still waits for a frame");
        }
        sleep(Duration::from_millis(20));
    }
    assert_refused(&child.wait_with_output().unwrap(), 0, &["1 of 2 frames; interrupted"]);
    assert_eq!(level(&out.path().join("000000.png")), 60);
}

#[test]
fn frames_of_a_calibrated_camera_have_its_stored_pixels_and_its_size() {
    let files = Folder::new();
    let stored = RgbImage::from_fn(640, 480, |x, _| Rgb([if x < 320 { 50 } else { 200 }; 3]));
    fs::write(files.path("photo.jpg"), with_orientation(&stored.into(), 3)).unwrap();
    let (address, out) = (format!("file:{}", files.path("photo.jpg")), files.path("out.png"));
    let grab = |further: &[&str]| sdg(&[&["camera", "grab", "--from", &address, "--out", &out], further].concat());
    let level_of = |further: &[&str]| {
        let output = grab(further);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let found = level(Path::new(&out));
        fs::remove_file(&out).unwrap();
        found
    };
    let wrist = files.text("wrist.yaml", WRIST_CAMERA);
    assert!(level_of(&[]).abs_diff(200) < 10 && level_of(&["--camera", &wrist]).abs_diff(50) < 10);
    let wide = files.text("wide.yaml", &WRIST_CAMERA.replace("image_width: 640", "image_width: 1280"));
    assert_refused(&grab(&["--camera", &wide]), 1, &["frame 0 of file:", "1280 × 480", "640 × 480"]);
}

#[test]
fn watch_tells_rate_brightness_and_faults() {
    let from = pictures();
    let address = format!("file:{}?fps=50&loop", from.path().join("b.png").display());
    let output = sdg(&["camera", "watch", "--from", &address, "--seconds", "2.2", "--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let told = lines(&output);
    assert!(told.len() >= 2, "{told:?}");
    assert_eq!(told[0]["brightness"].as_f64(), Some(90.0));
    let fps = told[0]["fps"].as_f64().unwrap();
    assert!(fps > 5.0 && fps < 52.0, "{fps}");
    assert!(told[0]["faults"].as_array().unwrap().is_empty(), "files may repeat: {}", told[0]);

    // Without a frame there is no size.
    let empty = tempfile::tempdir().unwrap();
    let address = format!("dir:{}?follow", empty.path().display());
    let silent = ["camera", "watch", "--from", &address, "--stall-secs", "0.1", "--seconds", "0.5", "--json"];
    let output = sdg(&silent);
    let told = lines(&output);
    assert_eq!((output.status.code(), &told[0]["frames"]), (Some(3), &0.into()));
    for field in ["width", "height", "brightness"] {
        assert_eq!(told[0][field], Value::Null, "{}", told[0]);
    }

    // A live camera that repeats the same picture, and black pictures.
    let watch = |line: &str| {
        let address = format!("cmd:yes '{line}'");
        let output = sdg(&["camera", "watch", "--from", &address, "--seconds", "1.2"]);
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let grey = watch("P6 1 1 255 zz");
    assert!(grey.contains("frozen: the same picture") && !grey.contains("black"), "{grey}");
    assert!(watch("P6 1 1 255 \x01\x01").contains("black: "));
}

#[test]
fn cameras_that_are_none_are_refused() {
    let from = pictures();
    let out = from.path().join("out.png");
    let grab = |address: &str, further: &[&str]| {
        sdg(&[&["camera", "grab", "--out", out.to_str().unwrap(), "--from", address], further].concat())
    };
    assert_refused(&grab("/dev/video0", &[]), 2, &["expected an address of a camera", "/dev/video0"]);
    assert_refused(&grab("https://camera/", &[]), 2, &["https is not supported"]);
    let with_password = grab("https://me:secret@camera/", &[]);
    assert_refused(&with_password, 2, &["'https://me:***@camera/'"]);
    assert!(!String::from_utf8_lossy(&with_password.stderr).contains("secret"));
    assert_refused(&grab("dir:/nowhere", &[]), 1, &["--from", "dir:/nowhere", "expected a folder"]);
    assert_refused(&grab("v4l:/dev/null", &[]), 1, &["v4l:/dev/null", "does not open"]);
    assert_refused(&grab("cmd:no-such-program", &[]), 1, &["cannot be started"]);
    assert_refused(&grab("cmd:sh -c 'echo no camera here >&2; exit 4'", &[]), 1, &["exit status: 4", "no camera here"]);
    assert_refused(&grab("cmd:true", &[]), 1, &["expected a frame"]);
    // No server listens on port 1.
    assert_refused(&grab("http://127.0.0.1:1/", &[]), 1, &["http://127.0.0.1:1/", "no connection"]);
    let file = format!("file:{}", from.path().join("a.png").display());
    assert_refused(&grab(&file, &["--size", "640"]), 2, &["640x480"]);
    assert_refused(&grab(&file, &["--stall-secs=-1"]), 2, &["positive number of seconds"]);
    assert_refused(&grab(&file, &["--stall-secs", "1e8"]), 2, &["--stall-secs", "0.01 to 3600 seconds"]);
    assert_refused(&grab("http://127.0.0.1:1/", &["--fps", "0"]), 1, &["0.1 to 1000 frames a second"]);
    // Settings that the camera does not have.
    let of_v4l = ["--size", "640x480", "--encoding", "yuyv", "--exposure-ms", "8", "--white-balance-kelvin", "4600"];
    let told = "--size, --encoding, --exposure-ms, --white-balance-kelvin: expected a V4L2 camera (v4l:)";
    for address in [file.as_str(), "cmd:true", "http://127.0.0.1:1/", "sim:pendulum"] {
        assert_refused(&grab(address, &of_v4l), 2, &[told, &format!("found {address}")]);
    }
    assert_refused(&grab(&file, &["--fps", "10"]), 2, &["--fps: expected", "found file:"]);
    assert_refused(&grab(&file, &["--every=-1"]), 2, &["0 to 86400"]);
    assert!(!out.exists(), "a failed call writes nothing");
    let jpeg = sdg(&["camera", "grab", "--from", &file, "--out", "frame.jpg"]);
    assert_refused(&jpeg, 2, &["ends in .png"]);
}
