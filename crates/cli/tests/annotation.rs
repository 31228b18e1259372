//! `sdg annotation convert`, and annotations of every format as demonstrations.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::support::{sdg, shipped};
use serde_json::Value;
use tempfile::TempDir;

/// A file of another tool.
fn foreign(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../demonstration/tests/formats").join(name)
}

fn convert(input: &Path, output: &Path, options: &[&str]) -> Output {
    let mut arguments = vec![Path::new("annotation"), Path::new("convert"), input, output];
    arguments.extend(options.iter().map(Path::new));
    sdg(&arguments)
}

fn converted(input: &Path, output: &Path, options: &[&str]) -> Value {
    let mut options = options.to_vec();
    options.push("--json");
    let done = convert(input, output, &options);
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    serde_json::from_slice(&done.stdout).unwrap()
}

fn assert_refused(done: &Output, code: i32, parts: &[&str]) {
    let stderr = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(code), "{stderr}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    for part in parts {
        assert!(stderr.contains(part), "expected \"{part}\" in: {stderr}");
    }
}

#[test]
fn coco_to_labelme_and_back_is_the_same_file() {
    let folder = tempfile::tempdir().unwrap();
    let [coco, labelme, again] = ["a.json", "b.json", "c.json"].map(|name| folder.path().join(name));
    let first = converted(&shipped("fuel_line", "annotation.json"), &coco, &[]);
    assert_eq!((first["in_format"].as_str(), first["left_out"].as_array().unwrap().len()), (Some("coco"), 0));
    let second = converted(&coco, &labelme, &["--format", "labelme"]);
    assert_eq!((second["out_format"].as_str(), second["image"]["width"].as_u64()), (Some("labelme"), Some(640)));
    let third = converted(&labelme, &again, &[]);
    assert_eq!(third["in_format"], "labelme");
    assert_eq!(fs::read(&coco).unwrap(), fs::read(&again).unwrap());
}

#[test]
fn the_flag_optional_comes_back_or_is_left_out_aloud() {
    let folder = tempfile::tempdir().unwrap();
    let [labelme, coco, again, yolo] = ["a.json", "b.json", "c.json", "d.txt"].map(|name| folder.path().join(name));
    fs::write(
        &labelme,
        r#"{"imagePath": "a.png", "imageWidth": 640, "imageHeight": 480, "shapes": [
            {"label": "rod", "shape_type": "rectangle", "points": [[10, 10], [90, 60]], "group_id": 1},
            {"label": "rod", "shape_type": "rectangle", "points": [[110, 10], [190, 60]], "group_id": 2,
             "flags": {"optional": true}}]}"#,
    )
    .unwrap();
    let read = |path: &Path| -> Value { serde_json::from_slice(&fs::read(path).unwrap()).unwrap() };
    assert_eq!(converted(&labelme, &coco, &[])["left_out"], serde_json::json!([]));
    let annotations = &read(&coco)["annotations"];
    assert_eq!(annotations[1]["attributes"]["optional"], true);
    assert_ne!(annotations[0]["attributes"]["optional"], true);
    converted(&coco, &again, &["--format", "labelme"]);
    let shapes = &read(&again)["shapes"];
    assert_eq!(
        [&shapes[0]["flags"], &shapes[1]["flags"]],
        [&serde_json::json!({}), &serde_json::json!({"optional": true})]
    );
    let left_out = &converted(&again, &yolo, &[])["left_out"];
    assert_eq!(left_out.as_array().unwrap().len(), 1);
    assert!(left_out[0].as_str().unwrap().contains("the flag `optional` of `rod`"), "{left_out}");
}

#[test]
fn yolo_pose_says_what_it_has_no_room_for() {
    let folder = tempfile::tempdir().unwrap();
    let (labels, back) = (folder.path().join("image.txt"), folder.path().join("back.json"));
    let done = convert(&shipped("fuel_line", "annotation.json"), &labels, &[]);
    let stderr = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success() && stderr.starts_with("left out: the outline of `fuel_line`"), "{stderr}");
    let yaml = fs::read_to_string(folder.path().join("data.yaml")).unwrap();
    assert!(yaml.contains("kpt_shape: [2, 3]") && yaml.contains("0: 'fuel_line'"), "{yaml}");

    let image = shipped("fuel_line", "image.png");
    let line = converted(&labels, &back, &["--image", image.to_str().unwrap()]);
    assert_eq!((line["in_format"].as_str(), line["objects"][0].as_str()), (Some("yolo-pose"), Some("fuel_line")));

    // There are already labels of another dataset: class 0 must not be renamed.
    fs::write(folder.path().join("data.yaml"), "names: [rod_end]\nkpt_shape: [2, 3]\n").unwrap();
    let other = folder.path().join("other.txt");
    assert_refused(
        &convert(&shipped("fuel_line", "annotation.json"), &other, &[]),
        1,
        &["data.yaml", "fuel_line", "rod_end"],
    );
    assert!(!other.exists());
}

/// The folders of a YOLO dataset with a photo.
fn dataset() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for inner in ["images/train", "labels/train"] {
        fs::create_dir_all(folder.path().join(inner)).unwrap();
    }
    fs::copy(shipped("fuel_line", "image.png"), folder.path().join("images/train/a.png")).unwrap();
    folder
}

#[test]
fn a_dataset_is_found_from_its_inner_folders() {
    let folder = dataset();
    let at = |name: &str| folder.path().join(name);
    converted(&shipped("fuel_line", "annotation.json"), &at("labels/train/a.txt"), &[]);
    fs::rename(at("labels/train/data.yaml"), at("data.yaml")).unwrap();
    let run = |inner: &str, arguments: &[&str]| -> Value {
        let mut sdg = Command::new(env!("CARGO_BIN_EXE_sdg"));
        let done = sdg.args(arguments).arg("--json").current_dir(at(inner)).output().unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        serde_json::from_slice(&done.stdout).unwrap()
    };
    let convert = ["annotation", "convert", "a.txt", "a.json", "--image", "../../images/train/a.png"];
    assert_eq!(run("labels/train", &convert)["objects"][0], "fuel_line");
    let augment = ["augment", "--demo", "a.png", "--count", "1", "--out", "samples"];
    assert_eq!(run("images/train", &augment)["label"], "fuel_line");
}

#[test]
fn the_labels_of_a_dataset_are_not_shadowed() {
    let folder = dataset();
    let at = |name: &str| folder.path().join(name);
    let (marks, labels) = (shipped("fuel_line", "annotation.json"), at("labels/train/a.txt"));
    fs::write(at("data.yaml"), "names: [rod_end]\nkpt_shape: [2, 3]\n").unwrap();
    assert_refused(&convert(&marks, &labels, &[]), 1, &["data.yaml", "fuel_line", "rod_end"]);
    fs::write(at("data.yaml"), "names: [fuel_line]\nkpt_shape: [2, 3]\n").unwrap();
    let line = converted(&marks, &labels, &[]);
    assert_eq!(line["data_yaml"], at("data.yaml").to_str().unwrap());
    assert_eq!(fs::read_dir(at("labels/train")).unwrap().count(), 1);
}

#[test]
fn a_refused_output_leaves_no_labels() {
    let folder = tempfile::tempdir().unwrap();
    let [marks, photo] = ["a.json", "photo.png"].map(|name| folder.path().join(name));
    fs::copy(shipped("fuel_line", "annotation.json"), &marks).unwrap();
    fs::copy(shipped("fuel_line", "image.png"), &photo).unwrap();
    let yolo = ["--format", "yolo-pose"];
    assert_refused(&convert(&marks, &marks, &yolo), 2, &["an output file other than the input"]);
    let with_image = [&yolo[..], &["--image", photo.to_str().unwrap()]].concat();
    assert_refused(&convert(&marks, &photo, &with_image), 1, &["found an input of this command"]);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn opendr_s_row_is_the_image_s_number() {
    let folder = tempfile::tempdir().unwrap();
    let image = folder.path().join("3.png");
    fs::copy(shipped("fuel_line", "image.png"), &image).unwrap();
    let out = folder.path().join("3.json");
    let line = converted(&foreign("boxes_train.npy"), &out, &["--image", image.to_str().unwrap()]);
    assert_eq!(line["in_format"], "opendr");
    let written: Value = serde_json::from_slice(&fs::read(&out).unwrap()).unwrap();
    assert_eq!(written["images"][0]["file_name"], "3.png");
    assert_eq!(written["annotations"][0]["num_keypoints"], 2);
}

#[test]
fn wrong_calls_are_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let annotation = shipped("fuel_line", "annotation.json");
    let refused = |input: &Path, output: &str, options: &[&str], code: i32, parts: &[&str]| {
        assert_refused(&convert(input, &at(output), options), code, parts);
        assert!(!at(output).exists());
    };
    refused(&annotation, "a.xml", &[], 2, &["a.xml", ".json (COCO) or .txt (YOLO-pose)"]);
    refused(&annotation, "a.json", &["--format", "opendr"], 2, &["--format", "coco, labelme, yolo-pose", "opendr"]);
    refused(&foreign("yolo-pose.txt"), "a.json", &[], 2, &["--image", "does not state the size of its image"]);
    refused(Path::new("/nowhere.json"), "a.json", &[], 1, &["/nowhere.json", "cannot read"]);

    fs::copy(&annotation, at("same.json")).unwrap();
    assert_refused(&convert(&at("same.json"), &at("same.json"), &[]), 2, &["an output file other than the input"]);

    fs::copy(foreign("boxes_train.npy"), at("boxes_alone.npy")).unwrap();
    let image = shipped("fuel_line", "image.png");
    let with_image = ["--image", image.to_str().unwrap()];
    refused(&at("boxes_alone.npy"), "a.json", &with_image, 1, &["boxes_alone.npy", "together with kps_*.npy"]);
    let cut = fs::read(foreign("boxes_train.npy")).unwrap();
    fs::write(at("cut.npy"), &cut[..cut.len() - 3]).unwrap();
    refused(&at("cut.npy"), "a.json", &with_image, 1, &["cut.npy", "expected 96 bytes"]);
    fs::write(at("nan.txt"), "0 0.5 0.5 nan 0.5\n").unwrap();
    refused(&at("nan.txt"), "a.json", &with_image, 1, &["nan.txt", "line 1", "finite"]);
    fs::write(at("huge.npy"), huge_header()).unwrap();
    refused(&at("huge.npy"), "a.json", &with_image, 1, &["huge.npy", "expected 64000000000 bytes"]);
}

/// A header that announces sixteen thousand million numbers, without the data.
fn huge_header() -> Vec<u8> {
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (4000000000, 4), }\n";
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes
}

#[test]
fn every_format_is_a_demonstration() {
    // Row 3 of OpenDR's file has the marks of the part rotated by 180°; `augment` accepts these, too.
    let folder = tempfile::tempdir().unwrap();
    let numbered = folder.path().join("3.png");
    fs::copy(shipped("fuel_line", "image.png"), &numbered).unwrap();
    for (image, annotation) in [
        (shipped("fuel_line", "image.png"), foreign("labelme.json")),
        (shipped("fuel_line", "image.png"), foreign("yolo-pose.txt")),
        (numbered, foreign("boxes_train.npy")),
    ] {
        let out = tempfile::tempdir_in(folder.path()).unwrap();
        let demonstration = format!("{}:{}", image.display(), annotation.display());
        let done = Command::new(env!("CARGO_BIN_EXE_sdg"))
            .args(["augment", "--count", "1", "--demo", &demonstration, "--out", out.path().to_str().unwrap()])
            .output()
            .unwrap();
        assert!(done.status.success(), "{demonstration}: {}", String::from_utf8_lossy(&done.stderr));
    }
}
