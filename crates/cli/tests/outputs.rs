//! No output replaces an input of the command, and a model only replaces a model.

use std::fs;
use std::path::Path;

use crate::support::{Folder, sdg, shipped, stdout};
use crate::weights::{config, fixture};

/// A folder with the key's photo and marks.
fn photographed() -> (Folder, String, String) {
    let folder = Folder::new();
    let [photo, marks] = [("image.png", "photo.png"), ("annotation.json", "photo.json")].map(|(shipped_name, name)| {
        fs::copy(shipped("key", shipped_name), folder.path(name)).unwrap();
        folder.path(name)
    });
    (folder, photo, marks)
}

/// Asserts that the call fails with a message that contains `part`, and that none of `files` changes.
fn refused(arguments: &[&str], part: &str, files: &[&str]) {
    let before: Vec<Vec<u8>> = files.iter().map(|file| fs::read(file).unwrap()).collect();
    let output = sdg(arguments);
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && error.contains(part), "expected {part} in: {error}");
    let after: Vec<Vec<u8>> = files.iter().map(|file| fs::read(file).unwrap()).collect();
    assert_eq!(before, after, "{arguments:?}");
}

#[test]
fn a_model_replaces_neither_photo_nor_marks_nor_other_files() {
    let (folder, photo, marks) = photographed();
    let teach = ["teach", "--model", "S", "--demo", &photo, "--out"];
    for out in [&photo, &marks, &folder.path("./photo.png")] {
        refused(&[&teach[..], &[out]].concat(), "found an input of this command", &[&photo, &marks]);
    }
    let notes = folder.text("notes.sdg", "not a model");
    refused(&[&teach[..], &[&notes]].concat(), "a grasp model to replace", &[&notes]);
    // A model may be replaced, and so may an empty file, such as one made by mktemp.
    let model = folder.text("model.sdg", "");
    for _ in 0..2 {
        stdout(&[&teach[..], &[&model]].concat());
        assert!(fs::metadata(&model).unwrap().len() > 10_000);
    }
}

#[test]
fn drawings_replace_no_picture() {
    let (folder, photo, marks) = photographed();
    let model = folder.path("model.sdg");
    stdout(&["teach", "--model", "S", "--demo", &photo, "--out", &model]);
    let bitmap = folder.path("photo.bmp");
    image::open(&photo).unwrap().save(&bitmap).unwrap();
    let here = folder.path("");
    for pictures in [&photo, &bitmap, &here] {
        let detect = ["detect", "--grasp-model", &model, "--draw", &here, pictures];
        refused(&detect, "--draw: expected another folder", &[&photo, &marks, &bitmap]);
    }
    let drawn = folder.path("drawn");
    stdout(&["detect", "--grasp-model", &model, "--draw", &drawn, &photo]);
    assert!(fs::metadata(folder.path("drawn/photo.png")).is_ok());
}

#[test]
fn frames_and_samples_replace_no_picture() {
    let (folder, photo, marks) = photographed();
    let from = format!("file:{photo}");
    let other = folder.path("other.png");
    fs::copy(&photo, &other).unwrap();
    for out in [&photo, &other] {
        refused(&["camera", "grab", "--from", &from, "--out", out], "--out: expected a new name", &[&photo, &other]);
    }
    let pictures = folder.path("pictures");
    fs::create_dir(&pictures).unwrap();
    let first = folder.path("pictures/000000.png");
    fs::copy(&photo, &first).unwrap();
    let from = format!("dir:{pictures}");
    let grab = ["camera", "grab", "--from", &from, "--count", "2", "--out", &pictures];
    refused(&grab, "--out: expected a new or an empty folder", &[&first]);
    let empty = folder.path("empty");
    fs::create_dir(&empty).unwrap();
    let from = format!("dir:{empty}?follow");
    let grab = ["camera", "grab", "--from", &from, "--count", "2", "--out", &empty];
    refused(&grab, "--out: expected another folder than that of --from", &[]);
    let list = folder.path("pictures/annotations.json");
    fs::copy(&marks, &list).unwrap();
    let demo = format!("{photo}:{list}");
    let augment = ["augment", "--demo", &demo, "--count", "2", "--out", &pictures];
    refused(&augment, "--out: expected a new or an empty folder", &[&first, &list]);
}

#[test]
fn weights_replace_neither_their_source_nor_other_files() {
    let (folder, photo, _) = photographed();
    let config = config(Path::new(&folder.path("")), 1);
    let checkpoint = folder.path("model.pkl");
    fs::copy(fixture("detectron2_keypoint.pkl"), &checkpoint).unwrap();
    for (out, part) in [(&checkpoint, "found an input of this command"), (&photo, "found a picture (Png)")] {
        let convert = ["weights", "convert", &checkpoint, out, "--config", config.to_str().unwrap()];
        refused(&convert, part, &[out]);
    }
    let weights = folder.path("edge.safetensors");
    fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("../grasp/weights/edge.safetensors"), &weights).unwrap();
    let teach = ["teach", "--demo", &photo, "--base-weights", &weights, "--out", &weights];
    refused(&teach, "found an input of this command", &[&weights]);
}
