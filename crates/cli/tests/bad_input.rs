//! Wrong input: one clear line, the exit code of docs/command-line.md, and no half-written file.

use std::fs;
use std::path::Path;

use sdg_evaluation::{Settings, Store};

use crate::support::{Folder, sdg, shipped, taught_pendulum, write_unusable_demonstration};

/// Asserts the exit code, and one line on standard error that contains every part.
fn assert_refused(arguments: &[&str], code: i32, parts: &[&str]) {
    let output = sdg(arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
    assert_eq!(stderr.lines().count(), 1, "{arguments:?}: {stderr}");
    for part in parts {
        assert!(stderr.contains(part), "{arguments:?}: expected \"{part}\" in: {stderr}");
    }
}

fn teach(demonstration: &str, out: &Path, code: i32, parts: &[&str]) {
    assert_refused(&["teach", "--demo", demonstration, "--out", out.to_str().unwrap()], code, parts);
    assert!(!out.exists());
}

fn pair(image: &Path, annotation: &Path) -> String {
    format!("{}:{}", image.display(), annotation.display())
}

fn files_in(folder: &Path) -> Vec<String> {
    fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect()
}

#[test]
fn unreadable_images_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("model.sdg");
    let annotation = shipped("pendulum", "annotation.json");
    teach(&pair(Path::new("/nowhere.png"), &annotation), &out, 1, &["/nowhere.png", "cannot read"]);
    teach("/nowhere.png", &out, 1, &["/nowhere.png", "cannot read"]);

    let truncated = folder.path().join("truncated.png");
    let whole = fs::read(shipped("pendulum", "image.png")).unwrap();
    fs::write(&truncated, &whole[..whole.len() / 2]).unwrap();
    teach(&pair(&truncated, &annotation), &out, 1, &["truncated.png"]);

    let text = folder.path().join("text.png");
    fs::write(&text, "not a picture").unwrap();
    teach(&pair(&text, &annotation), &out, 1, &["text.png"]);
}

#[test]
fn a_decompression_bomb_is_refused_before_memory_is_taken() {
    let folder = tempfile::tempdir().unwrap();
    let bomb = folder.path().join("bomb.png");
    // A valid header that announces 60000 × 60000 pixels; width and height are bytes 16 to 23, and the CRC of IHDR is
    // bytes 29 to 32.
    let mut bytes = fs::read(shipped("pendulum", "image.png")).unwrap();
    bytes[16..20].copy_from_slice(&60_000u32.to_be_bytes());
    bytes[20..24].copy_from_slice(&60_000u32.to_be_bytes());
    let checksum = crc32(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&checksum.to_be_bytes());
    fs::write(&bomb, bytes).unwrap();
    let out = folder.path().join("model.sdg");
    teach(&pair(&bomb, &shipped("pendulum", "annotation.json")), &out, 1, &["bomb.png", "60000"]);
}

/// The checksum of PNG, bit by bit.
pub(crate) fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| if crc & 1 == 1 { (crc >> 1) ^ 0xedb8_8320 } else { crc >> 1 })
    })
}

#[test]
fn annotations_that_mark_nothing_usable_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("model.sdg");
    let image = shipped("pendulum", "image.png");
    let annotated = |name: &str, json: &str| {
        let path = folder.path().join(name);
        fs::write(&path, json).unwrap();
        pair(&image, &path)
    };
    let shapes = |shapes: &str| format!(r#"{{"imageWidth": 640, "imageHeight": 480, "shapes": [{shapes}]}}"#);
    let rectangle = |x1: &str, y1: &str, x2: &str, y2: &str| {
        shapes(&format!(r#"{{"label": "part", "shape_type": "rectangle", "points": [[{x1}, {y1}], [{x2}, {y2}]]}}"#))
    };
    teach(&annotated("text.json", "hello"), &out, 1, &["text.json"]);
    teach(&annotated("list.json", "[1, 2]"), &out, 1, &["list.json"]);
    teach(&annotated("outside.json", &rectangle("10", "10", "900", "50")), &out, 1, &["outside.json", "900"]);
    teach(&annotated("zero.json", &rectangle("10", "10", "10", "50")), &out, 1, &["zero.json"]);
    teach(&annotated("nan.json", &rectangle("NaN", "10", "10", "50")), &out, 1, &["nan.json"]);
    teach(&annotated("no_grasp.json", &rectangle("10", "10", "90", "50")), &out, 1, &["grasp_start"]);
    let other = r#"{"imageWidth": 320, "imageHeight": 240, "shapes": []}"#;
    teach(&annotated("other.json", other), &out, 1, &["other.json", "320", "640"]);
}

#[test]
fn the_demonstration_is_no_picture_without_the_part() {
    let folder = Folder::new();
    let photo = shipped("pendulum", "image.png");
    let copy = folder.path("copy.png");
    fs::copy(&photo, &copy).unwrap();
    let (demo, out) = (pair(&photo, &shipped("pendulum", "annotation.json")), folder.path("model.sdg"));
    let teach = ["teach", "--model", "S", "--demo", &demo, "--negative", &copy, "--out", &out];
    assert_refused(&teach, 2, &["--negative: expected a picture without the part", "copy.png"]);
    assert!(!fs::exists(&out).unwrap());
    // With other pixels it is not recognised as the demonstration, but it still shows the part.
    let mut changed = image::open(&photo).unwrap().into_rgb8();
    changed.put_pixel(0, 0, image::Rgb([0, 0, 0]));
    changed.save(&copy).unwrap();
    let taught = sdg(&teach);
    let [stdout, stderr] = [taught.stdout, taught.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(stdout.contains("refuses 0 of 1 pictures without the part\n"), "{stdout}");
    let warning = format!("--negative {copy}: still accepted with ");
    assert!(stderr.contains(&warning) && stderr.contains("does it show the part?"), "{stderr}");
}

#[test]
fn what_is_no_model_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let image = shipped("pendulum", "image.png");
    let image = image.to_str().unwrap();
    let fake = folder.path().join("fake.sdg");
    fs::write(&fake, b"").unwrap();
    assert_refused(&["detect", "--grasp-model", fake.to_str().unwrap(), image], 1, &["fake.sdg", "an empty file"]);
    assert_refused(&["detect", "--grasp-model", image, image], 1, &["expected a grasp model", "a PNG image"]);
    assert_refused(
        &["rehearse", "--grasp-model", image, "--object", "teapot"],
        2,
        &["--object: ", "teapot", "pendulum"],
    );
    assert_refused(&["simulate", "--fci", "--object", "teapot"], 2, &["--object: ", "teapot", "pendulum"]);
    assert_refused(&["demo", "--object", "teapot"], 2, &["--object: ", "teapot", "pendulum"]);
}

#[test]
fn a_folder_that_cannot_be_written_is_told_before_the_work() {
    let demonstration = pair(&shipped("pendulum", "image.png"), &shipped("pendulum", "annotation.json"));
    let missing = Path::new("/nowhere/model.sdg");
    teach(&demonstration, missing, 1, &["/nowhere", "cannot write"]);
    assert_refused(&["demo", "--out", "/proc/report"], 1, &["/proc/report"]);
    let count = ["augment", "--demo", &demonstration, "--count", "1", "--out", "/proc/samples"];
    assert_refused(&count, 1, &["/proc/samples"]);
}

#[test]
fn the_annotation_page_does_not_open_on_what_cannot_be_marked() {
    let folder = tempfile::tempdir().unwrap();
    let photo = folder.path().join("photo.png");
    fs::copy(shipped("pendulum", "image.png"), &photo).unwrap();
    let photo = photo.to_str().unwrap();
    assert_refused(&["annotate", "/nowhere/photo.png"], 1, &["/nowhere", "cannot"]);
    let text = folder.path().join("text.png");
    fs::write(&text, "not a picture").unwrap();
    assert_refused(&["annotate", photo, text.to_str().unwrap()], 1, &["text.png", "expected a PNG, JPEG"]);
    assert_refused(&["annotate", photo, "--try", "/nowhere"], 1, &["/nowhere", "cannot read"]);
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    assert_refused(&["annotate", "--no-browser", "--port", &port, photo], 1, &["127.0.0.1", &port]);
    let (new, camera) = (folder.path().join("new.png"), shipped("../workcell", "camera.yaml"));
    let from = ["annotate", new.to_str().unwrap(), "--from", "sim:pendulum", "--size", "320x240"];
    let calibrated = ["--camera", camera.to_str().unwrap(), "--mark-height-mm", "16"];
    let size = "--size: expected 640x480, the size of the calibration, found 320x240";
    assert_refused(&[&from[..], &calibrated].concat(), 2, &[size]);
    fs::write(folder.path().join("photo.json"), "{\"shapes\": [}").unwrap();
    assert_refused(&["annotate", photo], 1, &["photo.json", "not JSON"]);
}

#[test]
fn results_of_other_settings_are_not_mixed() {
    let folder = tempfile::tempdir().unwrap();
    let settings = Settings {
        protocol: Settings::PROTOCOL,
        preset: "edge".to_owned(),
        steps: None,
        time_budget: None,
        seed: 7,
        attempts: 10,
        views: 25,
        scenes: 25,
        program: None,
    };
    drop(Store::open(folder.path(), &settings).unwrap());
    let out = folder.path().to_str().unwrap();
    let before = files_in(folder.path());
    let parts = ["settings.json", "seed: expected 8, found 7", "--out"];
    assert_refused(&["evaluate", "--models", "S", "--seed", "8", "--out", out], 1, &parts);
    assert_eq!(files_in(folder.path()), before);
    assert_refused(&["evaluate", "--out", "/proc/evaluation"], 1, &["/proc/evaluation"]);
}

#[test]
fn an_unknown_axis_names_the_known_ones() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    let parts = ["--axes", "found \"fog\"", "tilt", "look-alikes", "mark-height", "pictures"];
    assert_refused(&["evaluate", "--axes", "tilt,fog", "--out", out], 2, &parts);
    let parts = ["--against", "expected the folder of another run"];
    assert_refused(&["evaluate", "--axes", "tilt", "--out", out, "--against", "/nowhere"], 1, &parts);
}

#[test]
fn a_run_without_common_pictures_is_no_comparison() {
    let folder = Folder::new();
    let (out, other) = (folder.path("out"), folder.path("other"));
    let axes = Path::new(&other).join("axes");
    fs::create_dir_all(&axes).unwrap();
    // The record of another part.
    fs::write(axes.join("S-pendulum.tilt.json"), "{}").unwrap();
    let of = ["evaluate", "--axes", "tilt", "--axis-views", "1", "--models", "S", "--objects", "rod_end"];
    let output = sdg(&[&of[..], &["--out", &out, "--against", &other]].concat());
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains(&format!("--against {other}: expected results")), "{stderr}");
    assert!(Path::new(&out).join("axes.md").exists());
}

#[test]
fn wrong_usage_is_exit_code_2() {
    let demonstration = pair(&shipped("pendulum", "image.png"), &shipped("pendulum", "annotation.json"));
    for arguments in [
        vec![],
        vec!["fly"],
        vec!["annotate", "--try", "photo.png"],
        vec!["annotate", "photo.png", "--preset", "huge"],
        vec!["annotate", "photo.png", "--port", "70000"],
        vec!["teach", "--out", "m.sdg"],
        vec!["teach", "--demo", "image.png:", "--out", "m.sdg"],
        vec!["teach", "--demo", &demonstration, "--out", "m.sdg", "--model", "Z"],
        vec!["teach", "--demo", &demonstration, "--out", "m.sdg", "--preset", "huge"],
        vec!["augment", "--demo", &demonstration, "--count", "1", "--out", "x", "--preset", "huge"],
        vec!["demo", "--attempts", "0"],
        vec!["evaluate", "--models", "C,Z"],
        vec!["evaluate", "--models", "C,c"],
        vec!["evaluate", "--objects", "teapot"],
        vec!["evaluate", "--preset", "huge"],
        vec!["evaluate", "--preset", "r50-torchvision", "--models", "S,C"],
        vec!["evaluate", "--axes", "grasps", "--models", "A"],
        vec!["evaluate", "--scenes", "0"],
        vec!["evaluate", "--axis-views", "3"],
        vec!["evaluate", "--axes", "tilt", "--axis-views", "0"],
        vec!["evaluate", "--axes", "tilt", "--search-points", "2"],
        vec!["evaluate", "--axes", "shake", "--against", "other"],
        vec!["evaluate", "--cameras", "webcam,webcam"],
        vec!["demo", "--time-budget", "-3"],
    ] {
        assert_eq!(sdg(&arguments).status.code(), Some(2), "{arguments:?}");
    }
}

#[test]
fn augment_writes_pictures_and_their_list() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("samples");
    let demonstration = pair(&shipped("pendulum", "image.png"), &shipped("pendulum", "annotation.json"));
    let run = |seed: &str| {
        if out.exists() {
            fs::remove_dir_all(&out).unwrap();
        }
        let output = sdg(&[
            "augment",
            "--demo",
            &demonstration,
            "--count",
            "4",
            "--seed",
            seed,
            "--json",
            "--out",
            out.to_str().unwrap(),
        ]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        fs::read(out.join("000002.png")).unwrap()
    };
    let first = run("3");
    assert_eq!(first, run("3"));
    assert_ne!(first, run("4"));
    let mut names = files_in(&out);
    names.sort();
    assert_eq!(names, ["000000.png", "000001.png", "000002.png", "000003.png", "annotations.json"]);
}

#[test]
fn a_picture_of_another_size_with_nothing_in_it_is_answered_with_advice() {
    let folder = tempfile::tempdir().unwrap();
    let (model, picture) = (folder.path().join("model.sdg"), folder.path().join("table.png"));
    taught_pendulum(&model, None);
    for (size, advised) in [([320, 200], true), ([640, 480], false), ([480, 640], false)] {
        image::RgbImage::from_pixel(size[0], size[1], image::Rgb([120; 3])).save(&picture).unwrap();
        let output = sdg(&["detect", "--grasp-model", model.to_str().unwrap(), picture.to_str().unwrap()]);
        let stdout = String::from_utf8(output.stdout).unwrap();
        assert_eq!(output.status.code(), Some(3), "{stdout}");
        assert!(stdout.contains("nothing to grasp"), "{stdout}");
        let advice = "it has 320x200 pixels and the photo had 640x480";
        assert_eq!(stdout.contains(advice) && stdout.contains("--size-tolerance"), advised, "{stdout}");
    }
}

#[test]
fn a_model_that_fails_its_own_samples_is_written_and_ends_with_4() {
    let folder = Folder::new();
    let photo = folder.path("checks.png");
    write_unusable_demonstration(Path::new(&photo));
    let model = folder.path("model.sdg");
    let taught = sdg(&["teach", "--model", "S", "--demo", &photo, "--out", &model, "--json"]);
    let said = String::from_utf8(taught.stderr).unwrap();
    assert_eq!(taught.status.code(), Some(4), "{said}");
    assert!(said.contains("fails on its own held-out samples"), "{said}");
    let line: serde_json::Value = serde_json::from_slice(&taught.stdout).unwrap();
    assert!(line["failure"].is_string() && fs::metadata(&model).is_ok(), "{line}");
}

#[test]
fn a_page_that_cannot_be_written_does_not_hide_the_result() {
    let folder = Folder::new();
    let [model, report] = ["model.sdg", "report"].map(|name| folder.path(name));
    fs::create_dir_all(folder.path("report/index.html")).unwrap();
    let demonstration = pair(&shipped("pendulum", "image.png"), &shipped("pendulum", "annotation.json"));
    let teach = ["teach", "--model", "S", "--demo", &demonstration, "--out", &model, "--report", &report, "--json"];
    let taught = sdg(&teach);
    let said = String::from_utf8(taught.stderr).unwrap();
    assert_eq!(taught.status.code(), Some(0), "{said}");
    assert!(said.contains("--report: no page was written") && said.contains("index.html"), "{said}");
    let line: serde_json::Value = serde_json::from_slice(&taught.stdout).unwrap();
    assert!(line["held_back"].is_object() && line["report"].is_null(), "{line}");
}
