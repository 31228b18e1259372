//! `sdg teach --base-weights` as a user calls it.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::{Command, Output};

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde_json::{Map, Value, json};

fn sdg(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sdg")).args(arguments).output().unwrap()
}

fn fixture(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../weights-conversion/tests/fixtures");
    folder.join(name).to_str().unwrap().to_owned()
}

fn demonstration() -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets/demonstrations/pendulum");
    format!("{}:{}", folder.join("image.png").display(), folder.join("annotation.json").display())
}

fn text(bytes: Vec<u8>) -> String {
    String::from_utf8(bytes).unwrap()
}

/// A checkpoint with names and shapes of torchvision's own model and random values of a size that features keep.
fn write_torchvision_model(model: &str, path: &Path) {
    let models: BTreeMap<String, BTreeMap<String, Vec<usize>>> =
        serde_json::from_slice(&fs::read(fixture("torchvision_names.json")).unwrap()).unwrap();
    let names = &models[model];
    let mut entries = Map::new();
    let mut offset = 0;
    for (name, shape) in names {
        let end = offset + 4 * shape.iter().product::<usize>();
        entries.insert(name.clone(), json!({"dtype": "F32", "shape": shape, "data_offsets": [offset, end]}));
        offset = end;
    }
    let header = Value::Object(entries).to_string();
    let mut file = BufWriter::new(File::create(path).unwrap());
    file.write_all(&(header.len() as u64).to_le_bytes()).unwrap();
    file.write_all(header.as_bytes()).unwrap();
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    for (name, shape) in names {
        let count = shape.iter().product();
        let values: Vec<f32> = match shape.len() {
            // Scales and variances of norms are 1; their shifts and every bias 0.
            0 | 1 => {
                vec![
                    if name.ends_with("var") || name.contains("bn") && name.ends_with("weight") { 1.0 } else { 0.0 };
                    count
                ]
            }
            _ => {
                let fan_in: usize = shape[1..].iter().product();
                let most = (3.0 / fan_in as f32).sqrt();
                (0..count).map(|_| rng.random_range(-most..most)).collect()
            }
        };
        values.iter().for_each(|value| file.write_all(&value.to_le_bytes()).unwrap());
    }
    file.flush().unwrap();
}

#[test]
fn a_whole_r50_is_converted_and_taught_for_a_few_steps() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (theirs, ours, out) = (at("torchvision.safetensors"), at("converted.safetensors"), at("part.sdg"));
    write_torchvision_model("keypointrcnn_resnet50_fpn", Path::new(&theirs));
    let converted = sdg(&["weights", "convert", &theirs, &ours]);
    assert_eq!(converted.status.code(), Some(0), "{converted:?}");
    fs::remove_file(&theirs).unwrap();

    let demonstration = demonstration();
    let teach = ["teach", "--preset", "r50-torchvision", "--demo", &demonstration, "--out", &out, "--steps", "3"];
    let teach = [&teach[..], &["--base-weights", &ours]].concat();
    // People have 17 keypoints, a grasp line 12.
    let refused = sdg(&teach);
    let (stdout, stderr) = (text(refused.stdout), text(refused.stderr));
    assert_eq!(refused.status.code(), Some(1));
    let mismatch = "mismatched  roi_heads.keypoint_head.score_lowres.bias: expected [12], found [17] of F32";
    assert!(stdout.contains(mismatch) && stdout.contains("2 mismatched"), "{stdout}");
    assert!(stderr.lines().count() == 1 && stderr.contains("--reinit"), "{stderr}");

    let taught = sdg(&[&teach[..], &["--reinit", "roi_heads.keypoint_head.score_lowres"]].concat());
    let (stdout, stderr) = (text(taught.stdout), text(taught.stderr));
    assert!(stdout.contains("reinit      roi_heads.keypoint_head.score_lowres.weight"), "{stdout}");
    assert!(stdout.contains("0 missing, 0 mismatched, 0 unused, 2 re-initialised"), "{stdout}");
    // Three steps teach a random network nothing: it is examined, found useless and not kept.
    assert!(stderr.contains("teaching: step 3 of 3"), "{stderr}");
    assert!(stderr.lines().last().unwrap().contains("held-back samples after 3 steps: too few to keep"), "{stderr}");
    assert_eq!(taught.status.code(), Some(1));
    assert!(!Path::new(&out).exists());
}

#[test]
fn weights_that_cannot_be_a_start_are_refused_before_teaching() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("part.sdg");
    let (demonstration, out) = (demonstration(), out.to_str().unwrap());
    let narrow = fixture("detectron2_keypoint.pkl");
    for (arguments, exit, part) in [
        (
            &["--preset", "r50-torchvision"][..],
            2,
            "--base-weights: the preset r50-torchvision fine-tunes imported weights",
        ),
        (&["--reinit", "roi_heads"], 2, "--base-weights"),
        (&["--base-weights", "/nowhere.pth"], 1, "/nowhere.pth"),
        (&["--preset", "r50-detectron2", "--base-weights", &narrow], 1, "of another shape"),
        (&["--preset", "r50-torchvision", "--base-weights", &narrow], 1, "Detectron2's weights are for r50-detectron2"),
        (
            &["--preset", "r50-detectron2", "--base-weights", &narrow, "--reinit", "roi_heads.box"],
            1,
            "roi_heads.box_head, roi_heads.box_predictor, roi_heads.keypoint_head, found \"roi_heads.box\"",
        ),
    ] {
        let output = sdg(&[&["teach", "--demo", &demonstration, "--out", out], arguments].concat());
        let stderr = text(output.stderr);
        assert!(stderr.contains(part), "{arguments:?}: {stderr}");
        assert_eq!(output.status.code(), Some(exit), "{arguments:?}: {stderr}");
    }
    assert!(!Path::new(out).exists());
}
