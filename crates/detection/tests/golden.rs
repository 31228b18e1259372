//! Every stage against what Detectron2 itself gave for small random networks of all three kinds.
//!
//! The files and the script that made them stand in `tests/golden/detectron2`.
#![allow(clippy::unwrap_used)]

use std::path::PathBuf;

use burn::tensor::Device;
use safetensors::{Dtype, SafeTensors};
use sdg_detection::state_dict::{self, StateDict, WeightTensor};
use sdg_detection::verification::{VerificationReport, verify};
use sdg_detection::{GeneralizedRcnn, RcnnConfig};

fn golden(path: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden/detectron2").join(path)
}

fn read(path: &str, rename: fn(&str) -> String) -> StateDict {
    let bytes = std::fs::read(golden(path)).unwrap();
    let tensors = SafeTensors::deserialize(&bytes).unwrap();
    let values = |dtype, data: &[u8]| -> Vec<f32> {
        match dtype {
            Dtype::F32 => data.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect(),
            Dtype::I64 => data.as_chunks().0.iter().map(|b| i64::from_le_bytes(*b) as f32).collect(),
            Dtype::U8 => data.iter().map(|b| f32::from(*b)).collect(),
            other => panic!("{path} holds {other:?}"),
        }
    };
    tensors
        .iter()
        .map(|(name, view)| {
            let tensor = WeightTensor { shape: view.shape().to_vec(), values: values(view.dtype(), view.data()) };
            (rename(name), tensor)
        })
        .collect()
}

/// Detectron2's names in this project's words.
fn renamed(name: &str) -> String {
    let mut name = name.replace("backbone.fpn_", "backbone.fpn.fpn_");
    for number in 1..=8 {
        for layer in ["conv_fcn", "mask_fcn"] {
            name = name.replace(&format!("{layer}{number}."), &format!("{layer}.{}.", number - 1));
        }
    }
    name
}

fn detector(kind: &str) -> GeneralizedRcnn {
    let text = std::fs::read_to_string(golden(&format!("{kind}/config.json"))).unwrap();
    let config = RcnnConfig::from_json(&text).unwrap().without_sampling();
    let detector = config.init(&Device::flex().autodiff(), 1).unwrap();
    let weights = read(&format!("{kind}/weights.safetensors"), renamed);
    let (detector, report) = state_dict::import(detector, &weights);
    assert!(report.is_complete(), "{report:?}");
    detector
}

fn compared(detector: &GeneralizedRcnn, kind: &str) -> VerificationReport {
    let image = image::open(golden("input.png")).unwrap().to_rgb8();
    verify(detector, &image, &read(&format!("{kind}/expected.safetensors"), renamed)).unwrap()
}

fn agrees(kind: &str) {
    let report = compared(&detector(kind), kind);
    println!("{kind}\n{report}");
    assert!(report.passed(), "{report}");
    // Every tensor was compared: all but the targets, and keypoints twice.
    let reference = read(&format!("{kind}/expected.safetensors"), renamed);
    for name in reference.keys().filter(|name| !name.starts_with("targets.")) {
        assert!(report.stages.iter().any(|stage| stage.name.starts_with(name)), "{name} was passed over");
    }
}

#[test]
fn faster_agrees_at_every_stage() {
    agrees("faster");
}

#[test]
fn keypoint_agrees_at_every_stage() {
    agrees("keypoint");
}

#[test]
fn mask_agrees_at_every_stage() {
    agrees("mask");
}

#[test]
fn another_weight_is_noticed() {
    let (kind, name) = ("faster", "roi_heads.box_head.fc1.bias");
    let mut weights = read(&format!("{kind}/weights.safetensors"), renamed);
    weights.get_mut(name).unwrap().values[3] += 0.05;
    let (detector, _) = state_dict::import(detector(kind), &weights);
    let report = compared(&detector, kind);
    let failed: Vec<&str> =
        report.stages.iter().filter(|stage| !stage.passed).map(|stage| stage.name.as_str()).collect();
    assert!(!report.passed() && failed.contains(&"detections.scores"), "{report}");
    assert!(!failed.iter().any(|name| name.starts_with("features") || name.starts_with("proposals")), "{report}");
}
