//! `sdg weights`, called as a user would.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use crate::support::sdg;
use serde_json::{Value, json};

/// `sdg weights` with these arguments.
fn sdg_weights(arguments: &[&str]) -> Output {
    sdg(&[&["weights"], arguments].concat())
}

pub(crate) fn fixture(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../weights-conversion/tests/fixtures");
    folder.join(name).to_str().unwrap().to_owned()
}

/// A short configuration: the widths of `detectron2_keypoint.pkl`.
pub(crate) fn config(folder: &Path, classes: usize) -> PathBuf {
    let path = folder.join("config.json");
    let config = json!({
        "kind": "keypoint", "classes": classes, "keypoints": 12, "min_size_test": 240, "max_size_test": 400,
        "pre_nms_topk": 300, "post_nms_topk_test": 100, "post_nms_topk_train": 150, "detections_per_image": 20,
        "score_thresh_test": 0.05, "stem_out_channels": 2, "res2_out_channels": 4, "width_per_group": 1,
        "fpn_channels": 4, "box_head_fc": 8, "keypoint_convs": 4, "mask_convs": 4,
    });
    fs::write(&path, config.to_string()).unwrap();
    path
}

fn one_json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_detectron2_pickle_becomes_a_file_that_says_where_it_comes_from() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("converted.safetensors");
    let config = config(folder.path(), 1);
    let (out, config) = (out.to_str().unwrap(), config.to_str().unwrap());
    let output =
        sdg_weights(&["convert", &fixture("detectron2_keypoint.pkl"), out, "--config", config, "--f16", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let line = one_json(&output);
    let names = |list: &str| line["report"][list].as_array().unwrap().len();
    assert_eq!((names("applied"), names("missing"), names("mismatched"), names("unused")), (313, 0, 0, 0));
    assert_eq!(line["report"]["naming"], "detectron2");

    let inspected = one_json(&sdg_weights(&["inspect", out, "--json"]));
    assert_eq!(inspected["tensors"].as_array().unwrap().len(), 313);
    assert_eq!(inspected["metadata"]["source_sha256"], line["written"]["source_sha256"]);
    let network: Value = serde_json::from_str(inspected["metadata"]["network"].as_str().unwrap()).unwrap();
    assert_eq!(network["fpn"]["channels"], 4);
    // A converted file contains its configuration.
    let again = folder.path().join("again.safetensors");
    assert_eq!(sdg_weights(&["convert", out, again.to_str().unwrap()]).status.code(), Some(0));
}

#[test]
fn what_does_not_fit_is_listed_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("converted.safetensors");
    let config = config(folder.path(), 1);
    let mut wrong: Value = serde_json::from_slice(&fs::read(&config).unwrap()).unwrap();
    wrong["keypoints"] = json!(5);
    fs::write(&config, wrong.to_string()).unwrap();
    let (out, config) = (out.to_str().unwrap(), config.to_str().unwrap());
    let arguments = ["convert", &fixture("detectron2_keypoint.pkl"), out, "--config", config];
    let output = sdg_weights(&arguments);
    assert_eq!(output.status.code(), Some(1));
    let (stdout, stderr) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert!(stdout.contains("mismatched  roi_heads.keypoint_head.score_lowres.bias: expected [5], found [12]"));
    assert!(stderr.lines().count() == 1 && stderr.contains("--reinit"), "{stderr}");
    assert!(!Path::new(out).exists());
    let named = [&arguments[..], &["--reinit", "roi_heads.keypoint_head.score_lowres"]].concat();
    assert_eq!(sdg_weights(&named).status.code(), Some(0));
}

#[test]
fn a_detector_for_another_image_input_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("converted.safetensors");
    let config = config(folder.path(), 1);
    let mut other: Value = serde_json::from_slice(&fs::read(&config).unwrap()).unwrap();
    other["numerics"] = json!("torchvision");
    fs::write(&config, other.to_string()).unwrap();
    let from = fixture("detectron2_keypoint.pkl");
    let arguments = ["convert", &from, out.to_str().unwrap()];
    let convert = |detector: [&str; 2]| {
        let output = sdg_weights(&[&arguments[..], &detector].concat());
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let (code, stderr) = convert(["--preset", "r50-torchvision"]);
    assert_eq!(code, Some(1), "{stderr}");
    assert!(stderr.contains("Detectron2's weights are for r50-detectron2"), "{stderr}");
    assert!(!out.exists());
    // A configuration states the input of its own weights, and is not compared with the names.
    let (_, stderr) = convert(["--config", config.to_str().unwrap()]);
    assert!(!stderr.contains("Detectron2's weights are for r50-detectron2"), "{stderr}");
}

/// The outputs of Detectron2 and torchvision.
fn golden(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden");
    folder.join(name).to_str().unwrap().to_owned()
}

#[test]
fn verification_tells_the_right_image_from_another() {
    let [weights, config, against] = ["weights.safetensors", "config.json", "expected.safetensors"]
        .map(|n| golden(&format!("detectron2/faster/{n}")));
    let verify = |image: &str| {
        sdg_weights(&["verify", &weights, "--config", &config, "--image", image, "--against", &against, "--json"])
    };
    let right = verify(&golden("detectron2/input.png"));
    assert_eq!(right.status.code(), Some(0), "{right:?}");
    let line = one_json(&right);
    let stages: Vec<_> = line["stages"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    for stage in ["preprocessed", "features.p2", "detections.boxes", "gradients.backbone.fpn.fpn_lateral3.weight"] {
        assert!(stages.contains(&stage), "{stage} in {stages:?}");
    }
    let other = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets/demonstrations/pendulum/image.png");
    let wrong = verify(other.to_str().unwrap());
    assert_eq!(wrong.status.code(), Some(1));
    let stderr = String::from_utf8(wrong.stderr).unwrap();
    assert!(stderr.lines().count() == 1 && stderr.contains("first: preprocessed"), "{stderr}");
}

#[test]
fn verification_knows_torchvision_s_numerics_from_detectron2_s() {
    let case = |name: &str| golden(&format!("torchvision/keypoint/{name}"));
    let (weights, against, image) =
        (case("weights.safetensors"), case("expected.safetensors"), golden("detectron2/input.png"));
    let verify = |config: &str| {
        sdg_weights(&["verify", &weights, "--config", config, "--image", &image, "--against", &against, "--json"])
    };
    let config = case("config.json");
    let right = verify(&config);
    assert_eq!(right.status.code(), Some(0), "{right:?}");
    let line = one_json(&right);
    let stages: Vec<_> = line["stages"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    for stage in ["anchors.p6", "proposals.boxes", "detections.keypoints.places", "losses.loss_keypoint"] {
        assert!(stages.contains(&stage), "{stage} in {stages:?}");
    }
    let gradient = "gradients.roi_heads.keypoint_head.score_lowres.weight";
    assert!(stages.contains(&gradient), "gradients come under torchvision's names: {stages:?}");

    let mut other: Value = serde_json::from_slice(&fs::read(&config).unwrap()).unwrap();
    other["numerics"] = json!("detectron2");
    let folder = tempfile::tempdir().unwrap();
    let other_config = folder.path().join("config.json");
    fs::write(&other_config, other.to_string()).unwrap();
    let wrong = verify(other_config.to_str().unwrap());
    assert_eq!(wrong.status.code(), Some(1));
    let failed = one_json(&wrong)["stages"].as_array().unwrap().iter().filter(|s| s["passed"] == false).count();
    assert!(failed > 10, "{failed} stages");
}

#[test]
fn verification_of_a_file_without_a_detector_asks_for_an_option_that_it_has() {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("../grasp/weights/edge.safetensors");
    let [image, against] = ["input.png", "faster/expected.safetensors"].map(|n| golden(&format!("detectron2/{n}")));
    let output = sdg_weights(&["verify", own.to_str().unwrap(), "--image", &image, "--against", &against]);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("expected --config for a file with this project's names"), "{stderr}");
}

#[test]
fn wrong_input_is_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str, content: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, content).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let code = at("code.pkl", b"\x80\x02cposix\nsystem\nX\x02\x00\x00\x00id\x85R.");
    let torn = at("torn.pth", b"PK\x03\x04");
    let out = folder.path().join("out.safetensors");
    for (arguments, exit, part) in [
        (["inspect", &code, "--json"], 1, "posix.system"),
        (["inspect", &torn, "--json"], 1, "an end record"),
        (["inspect", "/nowhere.pkl", "--json"], 1, "/nowhere.pkl"),
        (["convert", &fixture("arrays_protocol4.pkl"), out.to_str().unwrap()], 1, "expected names as Detectron2"),
    ] {
        let output = sdg_weights(&arguments);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(exit), "{stderr}");
        assert!(stderr.lines().count() == 1 && stderr.contains(part), "{stderr}");
    }
    let preset = ["convert", &fixture("detectron2_keypoint.pkl"), out.to_str().unwrap(), "--preset", "yolo"];
    let output = sdg_weights(&preset);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8(output.stderr).unwrap().contains("r50-detectron2"));
    assert!(!out.exists());
}
