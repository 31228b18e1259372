//! Marks are checked against the photo whenever they are read, and derived values are reported.

use std::fs;

use serde_json::{Value, json};

use crate::picture_kinds::{stored_for, with_orientation};
use crate::support::{Folder, sdg, shipped, stdout, taught_pendulum};

fn photo() -> image::RgbImage {
    image::open(shipped("pendulum", "image.png")).unwrap().into_rgb8()
}

/// The pendulum's LabelMe file.
fn marks() -> Value {
    serde_json::from_slice(&fs::read(shipped("pendulum", "annotation.json")).unwrap()).unwrap()
}

/// The pendulum's marks with every point moved, and without the image size, which would reveal the move.
fn mapped(map: impl Fn([f64; 2]) -> [f64; 2]) -> Value {
    let mut file = marks();
    for key in ["imageWidth", "imageHeight"] {
        file.as_object_mut().unwrap().remove(key);
    }
    for shape in file["shapes"].as_array_mut().unwrap() {
        for point in shape["points"].as_array_mut().unwrap() {
            *point = json!(map([0, 1].map(|axis| point[axis].as_f64().unwrap())));
        }
    }
    file
}

/// The exit code and standard error.
fn run(arguments: &[&str]) -> (Option<i32>, String) {
    let done = sdg(arguments);
    (done.status.code(), String::from_utf8(done.stderr).unwrap())
}

#[test]
fn converting_and_evaluating_tell_marks_on_unturned_pixels() {
    let folder = Folder::new();
    let model = folder.path("model.sdg");
    taught_pendulum(&model, None);
    let pictures = folder.path("pictures");
    fs::create_dir(&pictures).unwrap();
    let at = |name: &str| format!("{pictures}/{name}");
    fs::write(at("photo.json"), marks().to_string()).unwrap();
    for orientation in [3, 6, 8] {
        fs::write(at("photo.jpg"), with_orientation(&photo().into(), orientation)).unwrap();
        let convert =
            run(&["annotation", "convert", &at("photo.json"), &folder.path("o.json"), "--image", &at("photo.jpg")]);
        let evaluate =
            run(&["evaluate", "--pictures", &pictures, "--grasp-model", &model, "--report", &folder.path("r")]);
        for (code, told) in [convert, evaluate] {
            assert_eq!((code, told.lines().count()), (Some(1), 1), "{orientation}: {told}");
            assert!(told.contains("photo.json") && told.contains("Exif"), "{orientation}: {told}");
        }
        let stored = stored_for(&photo(), orientation);
        fs::write(at("photo.jpg"), with_orientation(&stored, orientation)).unwrap();
        stdout(&["annotation", "convert", &at("photo.json"), &folder.path("o.json"), "--image", &at("photo.jpg")]);
    }
}

#[test]
fn marks_in_another_reading_are_told_as_that() {
    let folder = Folder::new();
    let image = shipped("pendulum", "image.png").display().to_string();
    type Map = fn([f64; 2]) -> [f64; 2];
    let readings: [(Map, &str); 4] = [
        (|[x, y]| [x / 640.0, y / 480.0], "shares"),
        (|[x, y]| [x / 2.0, y / 2.0], "half scale"),
        (|[x, y]| [y, x], "x and y exchanged"),
        (|[x, y]| [x / 6.4, y / 4.8], "percentages"),
    ];
    for (map, words) in readings {
        let marks = folder.text("marks.json", &mapped(map).to_string());
        let demonstration = format!("{image}:{marks}");
        let teach = run(&["teach", "--model", "S", "--demo", &demonstration, "--out", &folder.path("o.sdg")]);
        let convert = run(&["annotation", "convert", &marks, &folder.path("o.json"), "--image", &image]);
        for (code, told) in [teach, convert] {
            assert_eq!((code, told.lines().count()), (Some(1), 1), "{told}");
            assert!(
                told.contains("marks.json") && told.contains(words) && !told.contains("plain background"),
                "{told}"
            );
        }
    }
}

#[test]
fn marks_of_another_picture_that_is_there_are_told() {
    let folder = Folder::new();
    let marks = folder.text("marks.json", &marks().to_string().replace("image.png", "other.png"));
    // The part is in the centre of both pictures (rotated by 180° in the second), so the box fits both.
    let convert = |image: &str| run(&["annotation", "convert", &marks, &folder.path("o.json"), "--image", image]);
    fs::copy(shipped("pendulum", "image.png"), folder.path("other.png")).unwrap();
    photo().save(folder.path("renamed.bmp")).unwrap();
    assert_eq!(convert(&folder.path("renamed.bmp")).0, Some(0), "the same picture by another name");
    image::imageops::rotate180(&photo()).save(folder.path("turned.png")).unwrap();
    let (code, told) = convert(&folder.path("turned.png"));
    assert!(code == Some(1) && told.contains("imagePath") && told.contains("other.png"), "{told}");
}

#[test]
fn other_objects_without_a_grasp_are_passed_over_in_teaching() {
    let folder = Folder::new();
    let mut file = marks();
    let box_of_another =
        json!({"label": "screw", "shape_type": "rectangle", "points": [[20, 20], [60, 60]], "group_id": 2});
    file["shapes"].as_array_mut().unwrap().push(box_of_another);
    let marks = folder.text("marks.json", &file.to_string());
    let demonstration = format!("{}:{marks}", shipped("pendulum", "image.png").display());
    let (code, told) = run(&["teach", "--model", "S", "--demo", &demonstration, "--out", &folder.path("o.sdg")]);
    assert!(code == Some(0) && told.contains("skipped `screw`, which has no grasp"), "{told}");
}

#[test]
fn an_opening_that_is_the_box_s_is_said() {
    let folder = Folder::new();
    let teach = |file: &Value| {
        let marks = folder.text("marks.json", &file.to_string());
        let demonstration = format!("{}:{marks}", shipped("pendulum", "image.png").display());
        run(&["teach", "--model", "S", "--demo", &demonstration, "--out", &folder.path("o.sdg")]).1
    };
    let mut without_outline = marks();
    without_outline["shapes"].as_array_mut().unwrap().retain(|shape| shape["shape_type"] != "polygon");
    assert!(teach(&without_outline).contains("is taken from the box of \"pendulum\""));
    assert!(!teach(&marks()).contains("is taken from the box"));
}

#[test]
fn one_picture_that_cannot_be_read_is_one_line() {
    let folder = Folder::new();
    let model = folder.path("model.sdg");
    taught_pendulum(&model, None);
    let broken = folder.text("broken.png", "no picture");
    for arguments in
        [&["detect", "--grasp-model", &model, &broken][..], &["detect", "--json", "--grasp-model", &model, &broken]]
    {
        let (code, told) = run(arguments);
        assert_eq!((code, told.lines().count()), (Some(1), 1), "{told}");
        assert!(told.contains("broken.png: not a readable image"), "{told}");
    }
}
