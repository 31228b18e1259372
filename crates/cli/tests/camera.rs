//! `--camera` on the command line: a part taught with one camera, detected in metres, and invalid camera files.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use crate::support::{Folder, sdg, shipped, taught_pendulum};
use image::RgbImage;
use sdg_calibration::{CalibratedCamera, Frame, TablePose};
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::views::{OTHER_CAMERAS, OnTable, other_view};
use serde_json::{Value, json};

/// The wrist camera in the pose of the shipped photos: straight down from 0.58 m; right in the picture is -y of the
/// base frame.
pub const WRIST_CAMERA: &str = include_str!("wrist.yaml");

impl Folder {
    fn teach(&self, out: &str, further: &[&str]) -> Output {
        let demonstration = format!(
            "{}:{}",
            shipped("pendulum", "image.png").display(),
            shipped("pendulum", "annotation.json").display()
        );
        let out = self.path(out);
        sdg(&[&["teach", "--model", "S", "--demo", &demonstration, "--out", &out], further].concat())
    }
}

/// Asserts the exit code, and that standard error contains every part.
fn assert_refused(output: &Output, code: i32, parts: &[&str]) {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{stderr}");
    for part in parts {
        assert!(stderr.contains(part), "expected \"{part}\" in: {stderr}");
    }
}

#[test]
fn a_part_taught_with_a_camera_is_found_in_metres() {
    let files = Folder::new();
    let camera = files.text("wrist.yaml", WRIST_CAMERA);
    let taught = files.teach("part.sdg", &["--camera", &camera, "--mark-height-mm", "16", "--grasp-height-mm", "9"]);
    assert!(taught.status.success(), "{}", String::from_utf8_lossy(&taught.stderr));
    let told = String::from_utf8_lossy(&taught.stdout).into_owned();
    assert!(told.contains("marks 16.0 mm above the table"), "{told}");
    let sizes =
        "sizes from 0.9 to 1.11 times the part's size; without one, from 0.75 to 1.35 times the size in the photo";
    assert!(told.contains(sizes), "{told}");

    let (model, photo) = (files.path("part.sdg"), shipped("pendulum", "image.png"));
    let detect = |json: &[&str]| {
        let common = ["detect", "--grasp-model", &model, "--camera", &camera];
        let found = sdg(&[&common, json, &[photo.to_str().unwrap()]].concat());
        assert!(found.status.success(), "{}", String::from_utf8_lossy(&found.stderr));
        String::from_utf8(found.stdout).unwrap()
    };
    let line: Value = serde_json::from_str(&detect(&["--json"])).unwrap();
    let found = &line["detections"][0];
    // Calculated by hand from the grasp's pixel in the photo, which is vertical: focal length 550 pixels, 0.564 m above
    // the marks.
    let number = |value: &Value| value.as_f64().unwrap();
    let [x, y] = ["x", "y"].map(|axis| number(&found["grasp"][axis]));
    let pose = &found["pose"];
    assert_eq!(pose["frame"], "base");
    assert!((number(&pose["p_m"][0]) - (0.48 - (y - 240.0) * 0.564 / 550.0)).abs() < 1e-6, "{pose}");
    assert!((number(&pose["p_m"][1]) - -(x - 320.0) * 0.564 / 550.0).abs() < 1e-6, "{pose}");
    assert!((number(&pose["p_m"][2]) - 0.009).abs() < 1e-12, "{pose}");
    // Right in the picture is -y of the base frame, and down is -x: an angle a in the picture is a yaw of -90° - a.
    let turn = number(&pose["yaw_deg"]) + 90.0 + number(&found["grasp"]["angle_deg"]);
    assert!((turn + 180.0).rem_euclid(360.0) - 180.0 < 1e-6, "{found}");
    let width = number(&found["grasp"]["width_px"]) * 0.564 / 550.0;
    assert!((number(&pose["opening_m"]) - width).abs() < 1e-6, "{found}");
    // The photo is vertical and the model was taught from it, so the standard deviation is below a pixel, 1.03 mm.
    assert!((0.01..1.03).contains(&number(&pose["sigma_mm"])), "{pose}");
    assert!((0.01..2.0).contains(&number(&pose["sigma_deg"])), "{pose}");
    let told = detect(&[]);
    assert!(told.contains(" = base (") && told.contains("mm, yaw "), "{told}");
}

#[test]
fn camera_files_that_are_none_and_pictures_of_other_cameras_are_refused() {
    let files = Folder::new();
    let teach = |name: &str, from: &str, to: &str| {
        assert!(WRIST_CAMERA.contains(from), "{from}");
        let camera = files.text(name, &WRIST_CAMERA.replace(from, to));
        let output = files.teach("part.sdg", &["--camera", &camera, "--mark-height-mm", "16"]);
        assert!(!Path::new(&files.path("part.sdg")).exists());
        output
    };
    assert_refused(&teach("mm.yaml", "0.58]", "580.0]"), 1, &["mm.yaml", "580", "millimetres given as metres?"]);
    assert_refused(&teach("size.yaml", "image_width: 640", "image_width: 1280"), 1, &["1280", "640 × 480"]);
    let up = teach("up.yaml", "[0.7071067811865475, -0.7071067811865476, 0.0, 0.0]", "[0.0, 0.0, 0.0, 1.0]");
    assert_refused(&up, 1, &["does not meet the plane at z = 0.016 m"]);
    assert_refused(&teach("text.yaml", "image_width: 640", "no camera"), 1, &["text.yaml", "camera_calibration"]);
    let table = WRIST_CAMERA.find("table:").unwrap();
    let alone = teach("alone.yaml", &WRIST_CAMERA[table..], "");
    assert_refused(&alone, 1, &["alone.yaml", "pose above the table"]);

    let camera = files.text("wrist.yaml", WRIST_CAMERA);
    assert_refused(&files.teach("part.sdg", &["--camera", &camera]), 2, &["--mark-height-mm"]);
    let metres = files.teach("part.sdg", &["--camera", &camera, "--mark-height-mm", "1600"]);
    assert_refused(&metres, 2, &["0 to 500 millimetres", "1600"]);

    taught_pendulum(files.path("no_camera.sdg"), None);
    let (model, photo) = (files.path("no_camera.sdg"), shipped("pendulum", "image.png"));
    let found = sdg(&["detect", "--grasp-model", &model, "--camera", &camera, photo.to_str().unwrap()]);
    assert_refused(&found, 1, &["no_camera.sdg", "taught with a camera", "--mark-height-mm"]);
}

/// A second camera with distortion and another pose, and its picture of the pendulum.
struct SecondCamera {
    file: String,
    picture: RgbImage,
    /// The marks, in pixels.
    marks: [[f64; 2]; 2],
}

fn second_camera(files: &Folder) -> SecondCamera {
    let part = ObjectSpec::by_name("pendulum").unwrap();
    let shown = other_view(&part, OnTable::Part, &OTHER_CAMERAS[0], (5, 20), 31).unwrap();
    let posed = shown.view.camera;
    let table =
        TablePose { frame: Frame::Base, height_m: 0.0, frame_from_camera: posed.world_from_camera, workspace: None };
    let camera = CalibratedCamera {
        name: "webcam".into(),
        intrinsics: posed.intrinsics,
        table: Some(table),
        flange_from_camera: None,
    };
    let line = shown.truth.unwrap().line;
    SecondCamera {
        file: files.text("webcam.yaml", &camera.to_yaml()),
        picture: shown.view.image,
        marks: [line.start, line.end].map(|mark| [mark.x, mark.y]),
    }
}

/// A LabelMe file: a box and the two points of the grasp.
fn labelled(marks: [[f64; 2]; 2], file: &str, [width, height]: [u32; 2]) -> Value {
    let [[x1, y1], [x2, y2]] = marks;
    let [left, right, top, bottom] = [x1.min(x2) - 30.0, x1.max(x2) + 30.0, y1.min(y2) - 30.0, y1.max(y2) + 30.0];
    let shape = |label: &str, kind: &str, points: Value| json!({"label": label, "group_id": 1, "shape_type": kind, "points": points, "flags": {}});
    json!({
        "version": "5.0.1", "flags": {}, "imagePath": file, "imageData": null, "imageWidth": width, "imageHeight": height,
        "shapes": [
            shape("pendulum", "rectangle", json!([[left, top], [right, bottom]])),
            shape("grasp_start", "point", json!([[x1, y1]])),
            shape("grasp_end", "point", json!([[x2, y2]])),
        ],
    })
}

#[test]
fn a_model_taught_with_one_camera_is_tested_and_rehearsed_with_another() {
    let files = Folder::new();
    let first = files.text("wrist.yaml", WRIST_CAMERA);
    let model = files.path("part.sdg");
    taught_pendulum(&model, Some(Path::new(&first)));
    let second = second_camera(&files);

    let folder = PathBuf::from(files.path("pictures"));
    fs::create_dir(&folder).unwrap();
    second.picture.save(folder.join("a.png")).unwrap();
    fs::write(folder.join("a.json"), labelled(second.marks, "a.png", [640, 480]).to_string()).unwrap();
    let (folder, report) = (folder.to_str().unwrap().to_owned(), files.path("report"));
    let evaluate = |camera: &str| {
        sdg(&[
            "evaluate",
            "--pictures",
            &folder,
            "--grasp-model",
            &model,
            "--camera",
            camera,
            "--report",
            &report,
            "--json",
        ])
    };
    let tested = evaluate(&second.file);
    assert!(tested.status.success(), "{}", String::from_utf8_lossy(&tested.stderr));
    let told: Value = serde_json::from_slice(&tested.stdout).unwrap();
    assert_eq!((&told["found"], &told["wrong"]), (&json!(1), &json!(0)), "{told}");
    let off = told["errors"]["median_mm"].as_f64().unwrap();
    assert!(off < 3.0, "{off} mm");

    // The photo from which the model was taught is not used as a test; this also holds in the plan view.
    for (from, to) in [("image.png", "image.png"), ("annotation.json", "image.json")] {
        fs::copy(shipped("pendulum", from), Path::new(&folder).join(to)).unwrap();
    }
    for name in ["a.png", "a.json"] {
        fs::remove_file(Path::new(&folder).join(name)).unwrap();
    }
    assert_refused(&evaluate(&first), 1, &["was not taught from", "image.png"]);

    let rehearse = |camera: &str| {
        sdg(&[
            "rehearse",
            "--grasp-model",
            &model,
            "--object",
            "pendulum",
            "--attempts",
            "2",
            "--camera",
            camera,
            "--out",
            &report,
            "--json",
        ])
    };
    let rehearsed = rehearse(&second.file);
    assert!(rehearsed.status.success(), "{}", String::from_utf8_lossy(&rehearsed.stderr));
    let told: Value = serde_json::from_slice(&rehearsed.stdout).unwrap();
    assert_eq!(told["successes"], 2, "{told}");
    taught_pendulum(files.path("no_camera.sdg"), None);
    let without = files.path("no_camera.sdg");
    let refused = sdg(&[
        "rehearse",
        "--grasp-model",
        &without,
        "--object",
        "pendulum",
        "--camera",
        &second.file,
        "--out",
        &report,
    ]);
    assert_refused(&refused, 1, &["no_camera.sdg", "taught with a camera"]);
}
