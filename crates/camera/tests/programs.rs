//! `cmd:`: programs that write pictures, end, hang, or do not exist.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use image::codecs::jpeg::JpegEncoder;
use image::{Rgb, RgbImage};
use sdg_camera::{Address, Camera, CameraError, Fault, LatestFrame, OpenOptions};

fn try_open(command: &str) -> Result<Box<dyn Camera>, CameraError> {
    let options = OpenOptions { stall_timeout: Duration::from_secs(2), ..OpenOptions::default() };
    sdg_camera::open(&format!("cmd:{command}").parse::<Address>()?, &options)
}

fn open(command: &str) -> Box<dyn Camera> {
    try_open(command).unwrap()
}

fn picture(level: u8) -> RgbImage {
    RgbImage::from_pixel(16, 8, Rgb([level; 3]))
}

fn levels(camera: &mut dyn Camera) -> Vec<(u64, u8)> {
    std::iter::from_fn(|| camera.next_frame().unwrap())
        .map(|frame| (frame.number, frame.picture.get_pixel(3, 3)[0]))
        .collect()
}

/// A folder with one stream of each format: pictures of levels 40, 80 and 120.
fn streams() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut streams: [(&str, Vec<u8>); 3] = [("jpeg", vec![]), ("png", vec![]), ("ppm", vec![])];
    for level in [40, 80, 120] {
        JpegEncoder::new_with_quality(&mut streams[0].1, 95).encode_image(&picture(level)).unwrap();
        let file = folder.path().join("one.png");
        picture(level).save(&file).unwrap();
        streams[1].1.extend(fs::read(file).unwrap());
        streams[2].1.extend(b"P6\n16 8\n255\n");
        streams[2].1.extend(picture(level).into_raw());
    }
    for (name, bytes) in streams {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

#[test]
fn jpeg_png_and_ppm_streams_come_in_order_and_end() {
    let folder = streams();
    for name in ["jpeg", "png", "ppm"] {
        let path = folder.path().join(name);
        let found = levels(open(&format!("cat '{}'", path.display())).as_mut());
        let close = found.iter().zip([40, 80, 120]).all(|((_, level), expected)| level.abs_diff(expected) < 3);
        assert!(close && found.iter().map(|(number, _)| *number).eq(0..3), "{name}: {found:?}");
        // The program is slower than the reader: one byte at a time.
        let slow = format!("sh -c 'dd bs=1 if=\"{}\" 2>/dev/null'", path.display());
        assert_eq!(levels(open(&slow).as_mut()), found, "{name}");
    }
}

#[test]
fn a_program_that_does_not_exist_or_refuses_its_arguments_is_told_with_its_last_line() {
    let error = try_open("no-such-program-here -x").err().unwrap().to_string();
    assert!(error.contains("cmd:no-such-program-here -x") && error.contains("cannot be started"), "{error}");
    let mut camera = open("sh -c 'echo first >&2; echo the device is busy >&2; exit 7'");
    let error = camera.next_frame().unwrap_err();
    assert!(!error.is_passing(), "{error}");
    let text = error.to_string();
    assert!(text.contains("exit status: 7") && text.ends_with("its last line of errors: the device is busy"), "{text}");
}

#[test]
fn a_program_that_dies_later_is_started_again() {
    let folder = streams();
    let command = format!("sh -c 'cat \"{}\"; echo lost the camera >&2; exit 3'", folder.path().join("png").display());
    let mut camera = open(&command);
    for expected in 0..3 {
        assert_eq!(camera.next_frame().unwrap().unwrap().number, expected);
    }
    let error = camera.next_frame().unwrap_err();
    let is_told = matches!(error.fault(), Some(Fault::Gone { why }) if why.contains("lost the camera"));
    assert!(is_told && error.is_passing(), "{error}");
    let back = camera.next_frame().unwrap().unwrap();
    assert_eq!((back.number, back.picture.get_pixel(3, 3)[0]), (3, 40));
    assert!(matches!(back.faults[..], [Fault::Back { .. }]), "{:?}", back.faults);
}

#[test]
fn a_program_is_started_again_until_it_delivers_as_before() {
    let folder = streams();
    let [runs, png] = ["runs", "png"].map(|name| folder.path().join(name).display().to_string());
    // The second run ends without a picture, as while the camera is unplugged.
    let second = format!("test $(wc -l < \"{runs}\") = 2 && exit 1");
    let mut camera = open(&format!("sh -c 'echo >> \"{runs}\"; {second}; cat \"{png}\"; exit 3'"));
    for expected in 0..3 {
        assert_eq!(camera.next_frame().unwrap().unwrap().number, expected);
    }
    for status in ["exit status: 3", "exit status: 1"] {
        let error = camera.next_frame().unwrap_err();
        assert!(matches!(error.fault(), Some(Fault::Gone { why }) if why.contains(status)), "{error}");
    }
    let back = camera.next_frame().unwrap().unwrap();
    assert!(back.number == 3 && matches!(back.faults[..], [Fault::Back { .. }]), "{:?}", back.faults);

    // Other output than pictures does not count.
    let mut camera = open("sh -c 'echo usage; exit 7'");
    assert!(matches!(camera.next_frame().unwrap_err().fault(), Some(Fault::Torn { .. })));
    assert!(!camera.next_frame().unwrap_err().is_passing());
}

#[test]
fn torn_pictures_and_silence_are_told() {
    let folder = streams();
    let png = folder.path().join("png");
    let mut camera = open(&format!("sh -c 'head -c 50 \"{0}\"; cat \"{0}\"; sleep 20'", png.display()));
    let mut faults = Vec::new();
    loop {
        match camera.next_frame() {
            Ok(frame) => assert!(frame.is_some()),
            Err(error) => {
                faults.push(error.fault().unwrap().name());
                if faults.last() == Some(&"stale") {
                    break;
                }
            }
        }
    }
    assert!(faults.len() > 1 && faults[0] == "torn", "{faults:?}");
}

#[test]
fn the_program_ends_with_its_camera() {
    let folder = tempfile::tempdir().unwrap();
    let id_file = folder.path().join("id");
    let start = Instant::now();
    // With `exec`, the killed process is the sleeping program itself.
    let mut camera = open(&format!("sh -c 'echo $$ > \"{}\"; exec sleep 60'", id_file.display()));
    assert!(matches!(camera.next_frame().unwrap_err().fault(), Some(Fault::Stale { .. })));
    let id = fs::read_to_string(&id_file).unwrap().trim().to_owned();
    let process = Path::new("/proc").join(&id);
    assert!(!cfg!(target_os = "linux") || process.exists());
    drop(camera);
    assert!(!process.exists(), "killed and waited for");
    assert!(start.elapsed() < Duration::from_secs(10));
}

#[test]
fn the_newest_frame_of_a_fast_program_is_at_hand() {
    // An endless stream: `yes` repeats its line, which is a picture of 1 × 1 pixel whose third byte is the line feed.
    let mut latest = LatestFrame::spawn(open("yes 'P6 1 1 255 ab'"));
    let first = latest.next_frame().unwrap().unwrap();
    std::thread::sleep(Duration::from_millis(200));
    let second = latest.next_frame().unwrap().unwrap();
    assert_eq!(second.picture.as_raw().as_slice(), b"ab\n");
    assert!(second.number > first.number + 10, "{} then {}", first.number, second.number);
    assert!(latest.num_dropped() > 10);
}
