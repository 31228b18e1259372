//! `sdg detect --from`: parts in live pictures, one line per frame.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Command, Output, Stdio};

use crate::support::{sdg, shipped, taught_pendulum};
use image::RgbImage;
use sdg_calibration::{CalibratedCamera, Frame, TablePose};
use sdg_simulation::table_camera::TableCamera;
use serde_json::Value;

fn path(folder: &tempfile::TempDir, name: &str) -> String {
    folder.path().join(name).to_str().unwrap().to_owned()
}

/// Model S of the pendulum.
fn taught(folder: &tempfile::TempDir, camera: Option<&str>) -> String {
    let out = path(folder, "part.sdg");
    taught_pendulum(&out, camera.map(Path::new));
    out
}

fn lines(output: &Output) -> Vec<Value> {
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    text.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|_| panic!("{line}"))).collect()
}

#[test]
fn a_folder_is_played_and_its_part_followed() {
    let folder = tempfile::tempdir().unwrap();
    let model = taught(&folder, None);
    let pictures = folder.path().join("pictures");
    fs::create_dir(&pictures).unwrap();
    fs::copy(shipped("pendulum", "image.png"), pictures.join("a.png")).unwrap();
    // The stream lasts three seconds, because a search takes longer on a busy machine.
    let from = format!("dir:{}?loop&fps=25", pictures.display());
    let detected = sdg(&["detect", "--grasp-model", &model, "--from", &from, "--frames", "75", "--json"]);
    assert_eq!(detected.status.code(), Some(0), "{}", String::from_utf8_lossy(&detected.stderr));
    let lines = lines(&detected);
    assert_eq!(lines.len(), 75);
    let last = &lines[74];
    assert_eq!((&last["frame"], &last["width"]), (&74.into(), &640.into()), "{last}");
    // The part of the last frame is tracked.
    let part = &last["detections"][0];
    assert_eq!((&part["state"], &part["track"]), (&"followed".into(), &lines[73]["detections"][0]["track"]), "{last}");
    let alone = sdg(&["detect", "--grasp-model", &model, "--json", shipped("pendulum", "image.png").to_str().unwrap()]);
    let expected: Value = serde_json::from_slice(&alone.stdout).unwrap();
    for axis in ["x", "y"] {
        let [found, expected] =
            [part, &expected["detections"][0]].map(|detection| detection["grasp"][axis].as_f64().unwrap());
        assert!((found - expected).abs() < 0.5, "{axis}: {found} and {expected}");
    }

    let every = sdg(&["detect", "--grasp-model", &model, "--from", &from, "--frames", "2", "--every-frame"]);
    let told = String::from_utf8_lossy(&every.stdout).into_owned();
    assert!(told.lines().count() == 2 && told.starts_with("frame 0: grasp at ("), "{told}");
}

/// The demonstration's part at two positions in turn, and once absent, as PNG.
fn unrelated_pictures() -> Vec<Vec<u8>> {
    let photo = image::open(shipped("pendulum", "image.png")).unwrap();
    let table = RgbImage::from_pixel(photo.width(), photo.height(), *photo.to_rgb8().get_pixel(3, 3));
    let pictures = [photo.clone(), photo.rotate180(), photo.clone(), table.into(), photo.rotate180()];
    pictures
        .into_iter()
        .map(|picture| {
            let mut bytes = std::io::Cursor::new(Vec::new());
            picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
            bytes.into_inner()
        })
        .collect()
}

/// The positions of the grasps in a line.
fn grasps(line: &Value) -> Vec<Value> {
    line["detections"].as_array().unwrap().iter().map(|detection| detection["grasp"].clone()).collect()
}

#[test]
fn pictures_of_a_folder_and_on_request_show_what_files_show() {
    let folder = tempfile::tempdir().unwrap();
    let model = taught(&folder, None);
    let frames = folder.path().join("frames");
    fs::create_dir(&frames).unwrap();
    let pictures = unrelated_pictures();
    for (number, picture) in pictures.iter().enumerate() {
        fs::write(frames.join(format!("{number}.png")), picture).unwrap();
    }
    let detect = |arguments: &[&str]| {
        lines(&sdg(&[&["detect", "--grasp-model", &model, "--json"], arguments].concat())).iter().map(grasps).collect()
    };
    let expected: Vec<Vec<Value>> = detect(&[frames.to_str().unwrap()]);
    assert_eq!(expected.iter().map(Vec::len).collect::<Vec<_>>(), [1, 1, 1, 0, 1]);
    let from = format!("dir:{}", frames.display());
    assert_eq!(detect(&["--from", &from]), expected);
    // Model S has no network that could decide alone, and its parts are still tracked.
    let unverified = ["detect", "--grasp-model", &model, "--json", "--from", &from, "--no-verify"];
    assert_eq!(lines(&sdg(&[&unverified[..], &["--frames", "1"]].concat()))[0]["detections"][0]["track"], 0);
    assert_eq!(sdg(&[&unverified[..], &["--min-score", "0.4"]].concat()).status.code(), Some(2));
    let line = &lines(&sdg(&["detect", "--grasp-model", &model, "--json", frames.join("0.png").to_str().unwrap()]))[0];
    let detection = &line["detections"][0];
    assert_eq!((&line["object"], &detection["network_score"]), (&"pendulum".into(), &Value::Null), "{line}");
    let digits = |number: &Value| number.to_string().split_once('.').map_or(0, |(_, digits)| digits.len());
    let polygon = detection["polygon"].as_array().unwrap().iter().flat_map(|corner| corner.as_array().unwrap());
    assert!(polygon.chain([&detection["score"], &detection["grasp"]["x"]]).all(|number| digits(number) <= 6), "{line}");
    assert_eq!(detect(&["--from", &format!("dir:{}?fps=30", frames.display())]), expected);
    assert_eq!(detect(&["--from", &format!("file:{}", frames.join("1.png").display())]), expected[1..2]);

    let (url, server) = serve(pictures);
    assert_eq!(detect(&["--from", &url, "--frames", "5"]), expected);
    server.join().unwrap();
}

/// A camera that serves these pictures, one per request.
fn serve(pictures: Vec<Vec<u8>>) -> (String, std::thread::JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}/snapshot.png", listener.local_addr().unwrap());
    let server = std::thread::spawn(move || {
        for picture in pictures {
            let (mut stream, _) = listener.accept().unwrap();
            let _ = stream.read(&mut [0; 4096]).unwrap();
            let head =
                format!("HTTP/1.1 200 OK\r\nContent-Type: image/png\r\nContent-Length: {}\r\n\r\n", picture.len());
            stream.write_all(&[head.as_bytes(), &picture].concat()).unwrap();
        }
    });
    (url, server)
}

#[test]
fn frames_of_another_size_than_the_regions_are_skipped_and_told_once() {
    let folder = tempfile::tempdir().unwrap();
    let model = path(&folder, "part.sdg");
    let (photo, marks) = (shipped("pendulum", "image.png"), shipped("pendulum", "annotation.json"));
    let demo = format!("{}:{}", photo.display(), marks.display());
    let region = ["--region", "220,140,200,200", "--out", &model];
    assert!(sdg(&[&["teach", "--model", "S", "--demo", &demo], &region[..]].concat()).status.success());
    let right = fs::read(&photo).unwrap();
    let mut small = std::io::Cursor::new(Vec::new());
    image::open(&photo).unwrap().thumbnail(320, 240).write_to(&mut small, image::ImageFormat::Png).unwrap();
    let small = small.into_inner();
    let detect = |pictures: &[&Vec<u8>], further: &[&str]| {
        let count = pictures.len().to_string();
        let (url, server) = serve(pictures.iter().map(|&picture| picture.clone()).collect());
        let output = sdg(&[&["detect", "--grasp-model", &model, "--from", &url, "--frames", &count], further].concat());
        // After an error at the first frame, the server would wait for a request that never comes.
        if output.status.code() == Some(0) {
            server.join().unwrap();
        }
        output
    };
    let output = detect(&[&right, &small, &small, &right, &small], &["--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let lines = lines(&output);
    let is_error: Vec<bool> = lines.iter().map(|line| line["error"].is_string()).collect();
    assert_eq!(is_error, [false, true, false, true], "{lines:?}");
    let told = lines[1]["error"].as_str().unwrap();
    assert!(told.contains("frame 1") && told.contains("are skipped") && told.contains("found 320 × 240"), "{told}");
    for line in [&lines[0], &lines[2]] {
        assert_eq!(line["detections"].as_array().unwrap().len(), 1, "{line}");
    }
    // In the text, parts are numbered from 1; in JSON, from 0.
    assert_eq!(lines[0]["detections"][0]["track"], 0, "{}", lines[0]);
    let table = unrelated_pictures().swap_remove(3);
    let words = String::from_utf8(detect(&[&right, &table, &right], &[]).stdout).unwrap();
    for told in ["frame 0: part 1 followed, ", "frame 1: nothing to grasp", "frame 2: part 1 found again, "] {
        assert!(words.lines().any(|line| line.starts_with(told)), "expected \"{told}\" in: {words}");
    }

    // In a stream of another size, no part would ever be found: this is an error.
    let output = detect(&[&small, &small], &[]);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{error}");
    assert!(error.contains("the camera's pictures") && error.contains("--region all"), "{error}");
    let output = sdg(&["detect", "--grasp-model", &model, "--from", "sim:pendulum", "--size", "320x240"]);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        output.status.code() == Some(2) && error.contains("--size: expected 640x480, the size of the region"),
        "{error}"
    );
}

#[test]
fn a_rendered_part_is_followed_in_metres() {
    const SIM: &str = "pendulum?speed=50&turn=30&seed=3&seconds=1.2";
    let folder = tempfile::tempdir().unwrap();
    let mut simulated = TableCamera::new(&SIM.parse().unwrap()).unwrap();
    let camera = CalibratedCamera {
        name: "sim".into(),
        intrinsics: simulated.posed_camera().intrinsics,
        table: Some(TablePose {
            frame: Frame::Base,
            height_m: 0.0,
            frame_from_camera: simulated.posed_camera().world_from_camera,
            workspace: None,
        }),
        flange_from_camera: None,
    };
    let file = path(&folder, "sim.yaml");
    fs::write(&file, camera.to_yaml()).unwrap();
    let model = taught(&folder, Some(&file));
    let from = format!("sim:{SIM}");
    let detected = sdg(&["detect", "--grasp-model", &model, "--camera", &file, "--from", &from, "--json"]);
    assert_eq!(detected.status.code(), Some(0), "{}", String::from_utf8_lossy(&detected.stderr));
    let lines = lines(&detected);
    assert_eq!(lines.len(), 120);
    let mut num_followed = 0;
    for line in &lines {
        let truth = simulated.next_view().unwrap().unwrap().truths[0].grasp.tcp;
        let Some(part) = line["detections"].as_array().unwrap().first() else { continue };
        let at: [f64; 3] = serde_json::from_value(part["pose"]["p_m"].clone()).unwrap();
        let off = (at[0] - truth.x).hypot(at[1] - truth.y);
        assert!(off < 0.003, "{off} m: {line}");
        assert!(part["pose"]["sigma_mm"].as_f64().unwrap() < 5.0, "{part}");
        num_followed += 1;
    }
    // The first frame is answered only after it was searched, so that every line has the part.
    assert_eq!(num_followed, 120, "{num_followed} of 120");
}

#[test]
fn drawn_frames_are_served_to_browsers() {
    let folder = tempfile::tempdir().unwrap();
    let model = taught(&folder, None);
    let from = format!("file:{}?loop&fps=20", shipped("pendulum", "image.png").display());
    let mut child = Command::new(env!("CARGO_BIN_EXE_sdg"))
        .args(["detect", "--grasp-model", &model, "--from", &from, "--frames", "200", "--draw", "0", "--json"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut first = String::new();
    BufReader::new(child.stderr.take().unwrap()).read_line(&mut first).unwrap();
    let url = first.trim().strip_prefix("pictures at http://").unwrap_or_else(|| panic!("{first}"));
    let host = url.trim_end_matches('/');
    // There is no picture until the first frame is drawn.
    let picture = (0..100).find_map(|_| {
        let mut stream = TcpStream::connect(host).ok()?;
        write!(stream, "GET /snapshot.jpg HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").ok()?;
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).ok()?;
        let body = answer.windows(4).position(|four| four == b"\r\n\r\n")? + 4;
        std::thread::sleep(std::time::Duration::from_millis(50));
        image::load_from_memory(&answer[body..]).ok()
    });
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(picture.expect("a picture").width(), 640);
}

#[test]
fn what_cannot_be_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let model = taught(&folder, None);
    let refused = |arguments: &[&str], code: i32, part: &str| {
        let output = sdg(&[&["detect", "--grasp-model", &model], arguments].concat());
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{stderr}");
        assert!(stderr.contains(part), "expected \"{part}\" in: {stderr}");
    };
    refused(&["--from", "ftp://camera"], 2, "ftp://camera");
    refused(&["--from", "dir:/nowhere"], 1, "/nowhere");
    let broken = path(&folder, "broken.png");
    fs::write(&broken, "not a picture").unwrap();
    refused(&["--from", &format!("file:{broken}")], 1, "1 of 1 pictures could not be used");
    refused(&["--from", &format!("dir:{}", folder.path().display())], 1, "1 of 1 pictures could not be used");
    refused(&["--from", "sim:teapot"], 1, "teapot");
    refused(&["--from", "sim:pendulum", "--draw", "pictures"], 2, "port of 127.0.0.1");
    refused(&["--from", "sim:pendulum", "--draw", "pictures"], 2, "found \"pictures\"");
    refused(&["--frames", "3", "a.png"], 2, "--frames: expected live pictures (--from ADDRESS), found images");
    refused(
        &["--fps", "10", "--size", "640x480", "a.png"],
        2,
        "--size, --fps: expected live pictures (--from ADDRESS)",
    );
    refused(&["--stall-secs", "2", "a.png"], 2, "--stall-secs: expected live pictures");
    refused(&["--from", "sim:pendulum", "a.png"], 2, "found images as well");
    refused(&[], 2, "<IMAGE|DIR|->");
}
