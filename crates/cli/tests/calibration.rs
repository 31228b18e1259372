//! `sdg camera board`, `calibrate`, `table` and `hand-eye`, from the printed sheet to a file for `sdg detect --camera`;
//! and rejected inputs.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use crate::camera::WRIST_CAMERA;
use crate::rendering::cameras::{CAMERAS, board, poses};
use crate::rendering::{Exposure, Random, camera_from_board, render, render_with, turn};
use crate::support::{Folder, sdg, stdout, taught_pendulum};
use image::GrayImage;
use nalgebra::{Isometry3, Point2, Vector3};
use sdg_geometry::PinholeCamera;
use serde_json::Value;

/// Maximum relative error of the focal length from 15 pictures.
const MAX_FOCAL_ERROR: f64 = 0.002;
/// Maximum error of the camera's position at 0.3 m above the table, if the focal length has an error of at most
/// [`MAX_FOCAL_ERROR`].
const MAX_PLACE_ERROR_M: f64 = 0.001;

fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&stdout(arguments)).unwrap()
}

/// Asserts the exit code, and a message that contains every part.
fn assert_refused(arguments: &[&str], code: i32, parts: &[&str]) {
    let output = sdg(arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{stderr}");
    for part in parts {
        assert!(stderr.contains(part), "expected \"{part}\" in: {stderr}");
    }
}

impl Folder {
    fn picture(&self, name: &str, picture: &GrayImage) -> String {
        picture.save(self.path(name)).unwrap();
        self.path(name)
    }

    /// A picture of the board of [`board`].
    fn board(&self, name: &str, camera: &PinholeCamera, pose: &Isometry3<f64>) -> String {
        self.picture(name, &render(&board(), camera, pose, &Exposure::ORDINARY, &mut Random(8)))
    }

    /// The file of a camera with known intrinsics.
    fn camera(&self, camera: &PinholeCamera) -> String {
        let camera = sdg_calibration::CalibratedCamera {
            name: "known".to_owned(),
            intrinsics: *camera,
            table: None,
            flange_from_camera: None,
        };
        self.text("known.yaml", &camera.to_yaml())
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

fn translation(pose: &Value) -> Vector3<f64> {
    let values = &pose["translation_m"];
    Vector3::new(number(&values[0]), number(&values[1]), number(&values[2]))
}

/// The value of a numeric attribute of an SVG element.
fn attribute(element: &str, name: &str) -> Option<f64> {
    element.split_once(&format!(" {name}=\""))?.1.split_once('"')?.0.parse().ok()
}

/// Whether the SVG's squares and dots print a position. Positions are in squares, from the lower left corner of the
/// first square.
fn printed(svg: &str) -> impl Fn(&Point2<f64>) -> bool + use<> {
    let squares: Vec<[f64; 3]> = svg
        .lines()
        .filter(|line| line.starts_with("<rect x"))
        .map(|line| [attribute(line, "x").unwrap(), attribute(line, "y").unwrap(), attribute(line, "width").unwrap()])
        .filter(|[.., width]| *width == 25.0)
        .collect();
    let dots: Vec<([f64; 3], bool)> = svg
        .lines()
        .filter(|line| line.starts_with("<circle"))
        .map(|line| (["cx", "cy", "r"].map(|name| attribute(line, name).unwrap()), line.contains("fill=\"black\"")))
        .collect();
    assert_eq!(squares.len(), 27);
    let [left, top, side] = squares[0];
    // There are millions of queries, so only shapes near the cell of the position are tested.
    const CELLS: usize = 32;
    let cell = move |value: f64, start: f64| ((value - start) / side).floor() + (CELLS / 2) as f64;
    let mut near = Vec::new();
    for k in 0..CELLS * CELLS {
        let is_near = |x: f64, y: f64| {
            let [column, row] = [cell(x, left), cell(y, top)].map(|at| at as i64);
            column.abs_diff((k % CELLS) as i64) <= 1 && row.abs_diff((k / CELLS) as i64) <= 1
        };
        near.push((
            squares.iter().copied().filter(|[left, top, _]| is_near(*left, *top)).collect::<Vec<_>>(),
            dots.iter().copied().filter(|([cx, cy, _], _)| is_near(*cx, *cy)).collect::<Vec<_>>(),
        ));
    }
    assert!(dots.iter().all(|([.., radius], _)| *radius < side));
    move |place| {
        let [x, y] = [left + side * place.x, top + side - side * place.y];
        let [column, row] = [cell(x, left), cell(y, top)];
        let is_known = [column, row].iter().all(|at| (0.0..CELLS as f64).contains(at));
        let Some((squares, dots)) = is_known.then(|| &near[row as usize * CELLS + column as usize]) else {
            return false;
        };
        let dot = dots.iter().find(|([cx, cy, radius], _)| (x - cx).powi(2) + (y - cy).powi(2) < radius * radius);
        let is_in = |value: f64, low: f64| (low..low + side).contains(&value);
        dot.map_or_else(
            || squares.iter().any(|[left, top, _]| is_in(x, *left) && is_in(y, *top)),
            |(_, is_dark)| *is_dark,
        )
    }
}

#[test]
fn from_the_sheet_to_a_camera_file_that_detects() {
    let files = Folder::new();
    let (svg, pdf) = (files.path("board.svg"), files.path("board.pdf"));
    stdout(&["camera", "board", "--out", &svg, "--pdf", &pdf]);
    assert_refused(&["camera", "board", "--out", &pdf], 2, &["--out: expected a file that ends in .svg"]);
    assert_refused(&["camera", "board", "--pdf", &svg], 2, &["--pdf: expected a file that ends in .pdf"]);
    assert!(fs::read(&pdf).unwrap().starts_with(b"%PDF-1.7"));
    let sheet = printed(&fs::read_to_string(&svg).unwrap());

    let camera = CAMERAS[0].1;
    let mut random = Random(12);
    let pictures: Vec<String> = poses(&camera)
        .iter()
        .enumerate()
        .map(|(k, pose)| {
            let picture = render_with(&sheet, &board(), &camera, pose, &Exposure::ORDINARY, &mut random);
            files.picture(&format!("{k}.png"), &picture)
        })
        .collect();
    for input in [&svg, &pictures[0]] {
        let before = fs::read(input).unwrap();
        let mut arguments = vec!["camera", "calibrate", "--board", &svg, "--out", input];
        arguments.extend(pictures.iter().map(String::as_str));
        let refused = sdg(&arguments);
        let error = String::from_utf8(refused.stderr).unwrap();
        assert!(!refused.status.success() && error.contains("found an input of this command"), "{error}");
        assert_eq!(fs::read(input).unwrap(), before);
    }
    let out = files.text("camera.yaml", "# the one above the bench\nexposure_us: 4000\n");
    let mut arguments = vec!["camera", "calibrate", "--board", &svg, "--out", &out, "--camera-name", "bench", "--json"];
    arguments.extend(pictures.iter().map(String::as_str));
    let found = json(&arguments);
    assert!((number(&found["intrinsics"]["fx"]) / camera.fx - 1.0).abs() < MAX_FOCAL_ERROR, "{found}");
    // In the file, the first pixel's centre is at (0, 0).
    assert!((number(&found["intrinsics"]["cx"]) - (camera.cx - 0.5)).abs() < 1.0, "{found}");
    assert!(number(&found["rms_px"]) < 0.06 && number(&found["sigma"]["fx"]) > 0.0, "{found}");
    assert_eq!(found["pictures"].as_array().unwrap().len(), pictures.len());
    let written = fs::read_to_string(&out).unwrap();
    assert!(written.starts_with("# the one above the bench\nexposure_us: 4000\n") && written.contains("\"bench\""));

    let pose = camera_from_board(&board(), &camera, [330.0, 260.0], 0.3, [0.15, -0.1, 0.3]);
    let picture = render_with(&sheet, &board(), &camera, &pose, &Exposure::ORDINARY, &mut random);
    let on_table = files.picture("table.png", &picture);
    let table = json(&["camera", "table", &on_table, "--camera", &out, "--board", &svg, "--json"]);
    assert_eq!(table["frame"], "table");
    let off = (translation(&table["frame_from_camera"]) - pose.inverse().translation.vector).norm();
    assert!(off < MAX_PLACE_ERROR_M, "{off} m");
    assert!(number(&table["sigma_height_mm"]) < 0.2 && number(&table["rms_px"]) < 0.1, "{table}");
    let written = fs::read_to_string(&out).unwrap();
    assert!(written.contains("exposure_us: 4000\n") && written.contains("table:\n  frame: table\n"), "{written}");

    // The sheet's x is the base's -y; the sheet is 400 mm in front of the robot, on a plate of 3 mm.
    let based = files.path("based.yaml");
    let common = ["camera", "table", &on_table, "--camera", &out, "--board", &svg, "--json"];
    let place =
        ["--sheet-in-base-mm", "400,-50", "--sheet-yaw-deg", "-90", "--sheet-thickness-mm", "3", "--out", &based];
    let in_base = json(&[&common[..], &place].concat());
    let at = translation(&table["frame_from_camera"]);
    let expected = Vector3::new(0.4 + at.y, -0.05 - at.x, 0.003 + at.z);
    assert_eq!(in_base["frame"], "base");
    assert!((translation(&in_base["frame_from_camera"]) - expected).norm() < 1e-9, "{in_base}");

    // The printer prints 100 mm as 98 mm, so the camera is nearer.
    let scaled = json(&[&common[..], &["--measured-mm", "98", "--out", &based]].concat());
    assert!((translation(&scaled["frame_from_camera"]) - at * 0.98).norm() < 1e-6, "{scaled}");

    let model = files.path("part.sdg");
    taught_pendulum(&model, Some(Path::new(&files.text("wrist.yaml", WRIST_CAMERA))));
    let detected = sdg(&["detect", "--grasp-model", &model, "--camera", &out, "--json", &on_table]);
    // The pendulum is not on the sheet.
    assert_eq!(detected.status.code(), Some(3), "{}", String::from_utf8_lossy(&detected.stderr));
    let line: Value = serde_json::from_slice(&detected.stdout).unwrap();
    assert_eq!(line["width"], 640, "{line}");
}

#[test]
fn a_camera_s_frames_are_taken_where_they_show_something_new() {
    let files = Folder::new();
    let camera = CAMERAS[0].1;
    let frames = files.path("frames");
    fs::create_dir(&frames).unwrap();
    let poses = poses(&camera);
    let mut random = Random(4);
    // Each view twice, and after every fifth view a picture without the board.
    for (k, pose) in poses.iter().enumerate() {
        for copy in 0..2 {
            let picture = render(&board(), &camera, pose, &Exposure::ORDINARY, &mut random);
            picture.save(Path::new(&frames).join(format!("{k:02}-{copy}.png"))).unwrap();
        }
        if k % 5 == 0 {
            let nothing = GrayImage::from_pixel(camera.width, camera.height, image::Luma([90]));
            nothing.save(Path::new(&frames).join(format!("{k:02}-z.png"))).unwrap();
        }
    }
    let (from, taken, out) = (format!("dir:{frames}"), files.path("taken"), files.path("camera.yaml"));
    let arguments =
        ["camera", "calibrate", "--from", &from, "--taken", &taken, "--no-browser", "--out", &out, "--json"];
    let output = sdg(&arguments);
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{told}");
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let used = found["pictures"].as_array().unwrap();
    // No view is taken twice, and taking ends when no view is missing.
    assert!((12..=poses.len()).contains(&used.len()), "{told}");
    assert_eq!(fs::read_dir(&taken).unwrap().count(), used.len());
    assert_eq!(told.lines().filter(|line| line.starts_with("taken: ")).count(), used.len(), "{told}");
    assert!(told.contains("; next: tilt the board another way"), "{told}");
    assert!((number(&found["intrinsics"]["fx"]) / camera.fx - 1.0).abs() < 2.0 * MAX_FOCAL_ERROR, "{found}");
    assert_eq!(found["advice"], serde_json::json!([]), "{found}");
    // The pictures are kept, and give the same camera in a second calibration.
    let again = files.path("again.yaml");
    let pictures: Vec<String> = (0..used.len()).map(|k| format!("{taken}/{k:03}.png")).collect();
    let mut arguments = vec!["camera", "calibrate", "--out", &again, "--json"];
    arguments.extend(pictures.iter().map(String::as_str));
    assert_eq!(json(&arguments)["intrinsics"], found["intrinsics"]);

    assert_refused(
        &["camera", "calibrate", "--from", &from, "--taken", &taken, "--no-browser", "--out", &out],
        2,
        &["--taken: expected a new or an empty folder"],
    );
    assert_refused(
        &["camera", "calibrate", &pictures[0], "--taken", &taken, "--size", "640x480"],
        2,
        &["--taken, --size: expected live pictures (--from ADDRESS), found 1 pictures"],
    );
    let empty = files.path("empty");
    fs::create_dir(&empty).unwrap();
    fs::copy(Path::new(&frames).join("00-z.png"), Path::new(&empty).join("a.png")).unwrap();
    let (from, taken) = (format!("dir:{empty}"), files.path("none"));
    assert_refused(
        &["camera", "calibrate", "--from", &from, "--taken", &taken, "--no-browser", "--out", &out],
        1,
        &["the board was never at rest in a frame"],
    );
}

/// A phone's camera, without lens distortion and never calibrated.
const PHONE: PinholeCamera = PinholeCamera {
    width: 1280,
    height: 720,
    fx: 1000.0,
    fy: 1000.0,
    cx: 640.0,
    cy: 360.0,
    lens: sdg_geometry::PlumbBob::NONE,
};

#[test]
fn a_camera_without_file_gets_a_plane_and_the_cost_of_its_focal_length() {
    let files = Folder::new();
    let out = files.path("phone.yaml");
    let table = |name: &str, tilt: f64, further: &[&str]| {
        let pose = camera_from_board(&board(), &PHONE, [640.0, 360.0], 0.4, [tilt, 0.4 * tilt, 0.1]);
        let picture = files.board(name, &PHONE, &pose);
        json(&[&["camera", "table", &picture, "--out", &out, "--json"], further].concat())
    };
    let tilted = table("tilted.png", 0.3, &[]);
    assert_eq!(tilted["focal"]["source"], "perspective");
    let focal = &tilted["focal"];
    assert!((number(&focal["px"]) - PHONE.fx).abs() < 3.0 * number(&focal["sigma_px"]), "{tilted}");
    let above = table("above.png", 0.0, &["--mark-height-mm", "20"]);
    assert_eq!(above["focal"]["source"], "guess");
    let cost = &above["focal_cost"];
    assert_eq!(number(&cost["mark_height_mm"]), 20.0);
    // From straight above at 0.44 m (1108 px assumed for 1000), for a point 20 mm above the table at a horizontal
    // distance of 294 mm: 294 · 20 · (1 / (0.9 · 443) - 1 / 443) mm.
    assert!((number(&cost["at_border_mm"]) - 1.47).abs() < 0.1, "{above}");
    assert!(number(&cost["at_sheet_mm"]) < 0.2, "{above}");
    assert_eq!(table("given.png", 0.0, &["--focal-px", "1000"])["focal"]["source"], "given");
    let told = stdout(&["camera", "table", &files.path("above.png"), "--out", &out]);
    assert!(
        told.contains("assumed for a view of 60 degrees")
            && told.contains("an error of 10 % in the focal length gives"),
        "{told}"
    );
    // Another estimate keeps the rest of the file.
    let kept = "  workspace_m: {x: [-0.1, 0.1], y: [-0.2, 0.2]}\n# mine\n";
    fs::write(&out, fs::read_to_string(&out).unwrap() + kept).unwrap();
    stdout(&["camera", "table", &files.path("given.png"), "--out", &out, "--focal-px", "1000"]);
    let written = fs::read_to_string(&out).unwrap();
    assert!(written.ends_with(kept) && written.contains("1000.0"), "{written}");
    // The pose on the hand was measured with the old focal length.
    let pose = "{translation_m: [0.05, 0.0, 0.06], rotation_xyzw: [0.0, 0.0, 0.0, 1.0]}";
    fs::write(&out, format!("{written}hand_eye:\n  flange_from_camera: {pose}\n")).unwrap();
    let given = files.path("given.png");
    let again: [&str; 7] = ["camera", "table", &given, "--out", &out, "--focal-px", "1000"];
    let output = sdg(&again);
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && told.contains("pose on the hand was measured with the old estimate"), "{told}");
    assert!(!fs::read_to_string(&out).unwrap().contains("hand_eye"));
    // A comment in another encoding is not changed.
    let latin = [written.as_bytes(), &b"# K\xfcche\n"[..]].concat();
    fs::write(&out, &latin).unwrap();
    assert_refused(&again, 2, &["--out: ", "phone.yaml: expected YAML, found bytes that are not text"]);
    assert_eq!(fs::read(&out).unwrap(), latin);
}

/// `poses.yaml` of a camera on the hand, and its pictures. With the inverse poses, in `beside.yaml`, the same result
/// is that of a camera beside the robot.
fn hand_eye(files: &Folder, camera: &PinholeCamera, scale: f64) -> (String, Isometry3<f64>) {
    let flange_from_camera = Isometry3::from_parts(Vector3::new(0.05, -0.02, 0.06).into(), turn([0.0, 0.0, 1.0], 0.4));
    let base_from_board = Isometry3::from_parts(Vector3::new(0.4, -0.1, 0.0).into(), turn([0.0, 0.0, 1.0], 0.1));
    let [mut on_hand, mut beside] = ["poses:\n".to_owned(), "poses:\n".to_owned()];
    let tilts =
        [[0.0, 0.0], [0.25, 0.0], [-0.25, 0.1], [0.1, 0.25], [0.1, -0.25], [0.2, 0.2], [-0.2, -0.2], [0.0, 0.28]];
    for (k, [x, y]) in tilts.into_iter().enumerate() {
        let roll = 0.12 * (k as f64 - 3.5);
        let pose = camera_from_board(&board(), camera, [320.0, 240.0], 0.42 + 0.02 * k as f64, [x, y, roll]);
        files.board(&format!("{k}.png"), camera, &pose);
        let base_from_flange = base_from_board * pose.inverse() * flange_from_camera.inverse();
        for (text, pose) in [(&mut on_hand, base_from_flange), (&mut beside, base_from_flange.inverse())] {
            let translation: [f64; 3] = (pose.translation.vector * scale).into();
            let rotation: [f64; 4] = pose.rotation.coords.into();
            writeln!(text, "  - picture: {k}.png\n    base_from_flange: {{translation_m: {translation:?}, rotation_xyzw: {rotation:?}}}").unwrap();
        }
    }
    files.text("beside.yaml", &beside);
    (files.text("poses.yaml", &on_hand), flange_from_camera)
}

#[test]
fn a_camera_on_the_hand_is_found_and_written() {
    let files = Folder::new();
    let camera = CAMERAS[0].1;
    let known = files.camera(&camera);
    let (poses, truth) = hand_eye(&files, &camera, 1.0);
    let out = files.path("hand.yaml");
    let common = ["camera", "hand-eye", "--camera", &known, "--poses", &poses];
    let found = json(&[&common[..], &["--mount", "hand", "--out", &out, "--json"]].concat());
    let off = (translation(&found["flange_from_camera"]) - truth.translation.vector).norm();
    assert!(off < 0.0005, "{found}");
    assert!(
        number(&found["spread_mm"]) < 0.5 && number(&found["sigma_mm"]) < 0.3 && number(&found["rms_px"]) < 0.1,
        "{found}"
    );
    assert_eq!(found["pictures"].as_array().unwrap().len(), 8);
    assert!(fs::read_to_string(&out).unwrap().contains("hand_eye:\n  flange_from_camera:\n"));
    let told = stdout(&[&common[..], &["--mount", "hand"]].concat());
    assert!(told.contains("flange_from_camera: (") && told.contains("leaving out one picture"), "{told}");
    assert_refused(
        &[&common[..], &["--mount", "base"]].concat(),
        1,
        &["the mount to be the other one", "with --mount"],
    );

    // An impossible height of the table is reported as such, whatever file is written.
    let beside = files.path("beside.yaml");
    let beside = ["camera", "hand-eye", "--camera", &known, "--poses", &beside, "--mount", "base", "--out", &out];
    stdout(&beside);
    let of_table = |height: &str, code, parts: &[&str]| {
        assert_refused(&[&beside[..], &["--table-height-mm", height]].concat(), code, parts);
    };
    of_table("5000", 1, &["hand.yaml: expected the camera 0.05 to 20 m above the table, found -4.9"]);
    of_table("nan", 2, &["expected the table's z in millimetres, found nan"]);

    let of_hand = |poses: &str, measured: &str, parts: &[&str]| {
        let arguments = ["camera", "hand-eye", "--camera", &known, "--poses", poses, "--mount", "hand"];
        assert_refused(&[&arguments[..], &["--measured-mm", measured]].concat(), 1, parts);
    };
    of_hand(&poses, "97", &["% of that size", "--measured-mm; about"]);
    let text = fs::read_to_string(&poses).unwrap();
    of_hand(&files.text("missing.yaml", &text.replace(" 3.png", " away.png")), "100", &["away.png", "no such file"]);
    let swapped = text.replace(" 3.png", " x.png").replace(" 5.png", " 3.png").replace(" x.png", " 5.png");
    of_hand(&files.text("swapped.yaml", &swapped), "100", &["5.png", "3.png", "seem to be exchanged"]);

    let (millimetres, _) = hand_eye(&files, &camera, 1000.0);
    let arguments = ["camera", "hand-eye", "--camera", &known, "--poses", &millimetres, "--mount", "hand"];
    assert_refused(&arguments, 1, &["0.png", "millimetres given as metres?"]);
    let other = files.camera(&CAMERAS[1].1);
    let (poses, _) = hand_eye(&files, &camera, 1.0);
    let arguments = ["camera", "hand-eye", "--camera", &other, "--poses", &poses, "--mount", "hand"];
    assert_refused(&arguments, 1, &["1280 × 720", "640 × 480", "at least 4 pictures"]);
    // The file of a camera on the hand has no table.
    let with_table = [&arguments[..], &["--table-height-mm", "10"]].concat();
    assert_refused(&with_table, 2, &["--table-height-mm: expected --mount base"]);
}

#[test]
fn pictures_and_files_that_cannot_be_used_are_refused_with_what_is_missing() {
    let files = Folder::new();
    let camera = CAMERAS[0].1;
    let seen = |name: &str, pixel: [f64; 2], tilts: [f64; 3]| {
        files.board(name, &camera, &camera_from_board(&board(), &camera, pixel, 0.3, tilts))
    };
    let out = files.path("camera.yaml");
    let alike: Vec<String> =
        (0..4).map(|k| seen(&format!("alike{k}.png"), [310.0 + 5.0 * f64::from(k), 240.0], [0.1, 0.1, 0.0])).collect();
    let [a, b, c, d] = [0, 1, 2, 3].map(|k| alike[k].as_str());
    let calibrate = |further: &[&str], code, parts: &[&str]| {
        assert_refused(&[&["camera", "calibrate", "--out", &out], further].concat(), code, parts);
        assert!(!Path::new(&out).exists());
    };
    calibrate(&[a, b, c, d], 1, &["poses are similar", "tilt the board by 20 to 40 degrees"]);
    calibrate(&[a, b], 1, &["at least 3 pictures", "found 2"]);
    calibrate(&[a, b, c, "--squares", "8x6"], 1, &["8 x 6 squares", "at least 9 x 6", "--squares"]);
    calibrate(&[a, b, c, "--square-mm", "0.025"], 2, &["0.5 to 500 mm", "0.025 mm"]);
    calibrate(&[a, b, c, "--measured-mm", "9.8"], 2, &["90 to 110 mm"]);
    calibrate(&[a, b, c, "--squares", "9"], 2, &["such as 9x6"]);
    let edge_on = seen("edge_on.png", [320.0, 240.0], [0.93, 0.0, 0.0]);
    let cut = seen("cut.png", [790.0, 240.0], [0.1, 0.0, 0.0]);
    calibrate(
        &[&edge_on, &cut, a],
        1,
        &["edge_on.png: expected the board", "edge-on, cut off", "cut.png: expected", "found 1"],
    );
    let other = files.board("other.png", &PHONE, &camera_from_board(&board(), &PHONE, [640.0, 360.0], 0.5, [0.0; 3]));
    calibrate(&[a, b, &other], 1, &["other.png", "640 x 480", "1280 x 720"]);
    let text = files.text("text.png", "no picture");
    calibrate(&[&text], 1, &["text.png", "found none among 1"]);

    // A file that cannot be updated is reported before pictures are taken.
    let unusable = files.text("unusable.yaml", "{a: 1}");
    let (from, taken) = (format!("dir:{}?loop", files.path("")), files.path("taken"));
    let live = ["camera", "calibrate", "--from", &from, "--taken", &taken, "--no-browser", "--out", &unusable];
    assert_refused(&live, 1, &["unusable.yaml"]);
    assert!(!Path::new(&taken).exists());

    let known = files.camera(&camera);
    let table = |further: &[&str], code, parts: &[&str]| {
        assert_refused(&[&["camera", "table"], further].concat(), code, parts);
    };
    table(&[&other, "--camera", &known], 1, &["other.png", "640 × 480", "1280 × 720"]);
    table(&[a], 2, &["--out FILE"]);
    let before = fs::read(&known).unwrap();
    table(
        &[a, "--out", &known],
        2,
        &["known.yaml: expected --camera ", "known.yaml, which keeps its lens, or another"],
    );
    assert_eq!(fs::read(&known).unwrap(), before);
    // Another program's calibration, whose lens model is not ours, is not replaced either.
    let eight = String::from_utf8(before).unwrap().replace("data: [-0.31", "data: [0.0, 0.0, 0.0, -0.31");
    let rational = files.text("rational.yaml", &eight);
    table(&[a, "--out", &rational], 2, &["--out: expected a new file or that of an estimated camera", "with 8"]);
    assert_eq!(fs::read_to_string(&rational).unwrap(), eight);
    table(&[a, "--camera", &known, "--sheet-in-base-mm", "400"], 2, &["X,Y"]);
    table(&[a, "--camera", &known, "--sheet-in-base-mm", "400000,0"], 2, &["5000 mm"]);
    table(&[a, "--camera", &known, "--sheet-in-base-mm", "0.4,-0.05"], 2, &["0.4,-0.05: metres given as millimetres?"]);
    let based = [a, "--camera", &known, "--sheet-in-base-mm", "400,-50"];
    table(&[&based[..], &["--sheet-yaw-deg", "720"]].concat(), 2, &["--sheet-yaw-deg: expected -360 to 360 degrees"]);
    table(&[&based[..], &["--table-height-mm", "-0.0125"]].concat(), 2, &["metres given as millimetres?"]);
    let nonsense = files.text("nonsense.yaml", &fs::read_to_string(&known).unwrap().replace("450.0", "-450.0"));
    table(&[a, "--camera", &nonsense], 1, &["nonsense.yaml", "positive focal length"]);
    let steep =
        files.board("steep.png", &camera, &camera_from_board(&board(), &camera, [320.0, 240.0], 0.2, [0.78, 0.0, 0.0]));
    table(&[&steep, "--camera", &known], 1, &["steep.png", "horizon"]);
}
