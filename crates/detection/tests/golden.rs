//! Compares every stage with the outputs of Detectron2 and torchvision for small random networks of all three kinds.
//!
//! The files and the scripts that made them are in `tests/golden`. `make test-torch` also compares a whole R50 network,
//! with a Python that has torch and torchvision (`SDG_TORCH_PYTHON`).

use std::path::{Path, PathBuf};
use std::process::Command;

use burn::tensor::Device;
use safetensors::{Dtype, SafeTensors};
use sdg_detection::golden::{GoldenReport, StageDifference, record, verify};
use sdg_detection::{GeneralizedRcnn, RcnnConfig};
use sdg_layers::state_dict::{self, StateDict, WeightTensor};

fn golden(path: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden").join(path)
}

fn read(path: &Path) -> StateDict {
    let bytes = std::fs::read(path).unwrap();
    let tensors = SafeTensors::deserialize(&bytes).unwrap();
    let values = |dtype, data: &[u8]| -> Vec<f32> {
        match dtype {
            Dtype::F32 => data.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect(),
            Dtype::I64 => data.as_chunks().0.iter().map(|b| i64::from_le_bytes(*b) as f32).collect(),
            Dtype::U8 => data.iter().map(|b| f32::from(*b)).collect(),
            other => panic!("{} holds {other:?}", path.display()),
        }
    };
    tensors
        .iter()
        .map(|(name, view)| {
            let tensor = WeightTensor { shape: view.shape().to_vec(), values: values(view.dtype(), view.data()) };
            (renamed(name), tensor)
        })
        .collect()
}

/// Converts Detectron2's and torchvision's names to this project's.
fn renamed(name: &str) -> String {
    let mut name = name.replace("backbone.fpn_", "backbone.fpn.fpn_");
    for number in 1..=8 {
        for layer in ["conv_fcn", "mask_fcn"] {
            name = name.replace(&format!("{layer}{number}."), &format!("{layer}.{}.", number - 1));
        }
    }
    for (theirs, ours) in [
        ("backbone.body.conv1.", "backbone.bottom_up.stem.conv1."),
        ("backbone.body.bn1.", "backbone.bottom_up.stem.conv1.norm."),
        ("backbone.body.layer1.", "backbone.bottom_up.res2."),
        ("backbone.body.layer2.", "backbone.bottom_up.res3."),
        ("backbone.body.layer3.", "backbone.bottom_up.res4."),
        ("backbone.body.layer4.", "backbone.bottom_up.res5."),
        (".downsample.0.", ".shortcut."),
        (".downsample.1.", ".shortcut.norm."),
        (".bn1.", ".conv1.norm."),
        (".bn2.", ".conv2.norm."),
        (".bn3.", ".conv3.norm."),
        ("rpn.head.conv.0.0.", "proposal_generator.rpn_head.conv."),
        ("rpn.head.cls_logits.", "proposal_generator.rpn_head.objectness_logits."),
        ("rpn.head.bbox_pred.", "proposal_generator.rpn_head.anchor_deltas."),
        ("box_head.fc6.", "box_head.fc1."),
        ("box_head.fc7.", "box_head.fc2."),
        ("keypoint_predictor.kps_score_lowres.", "keypoint_head.score_lowres."),
        ("mask_predictor.conv5_mask.", "mask_head.deconv."),
        ("mask_predictor.mask_fcn_logits.", "mask_head.predictor."),
    ] {
        name = name.replace(theirs, ours);
    }
    for level in 0..4 {
        let (inner, outer) = (format!("fpn.inner_blocks.{level}.0."), format!("fpn.layer_blocks.{level}.0."));
        name = name.replace(&inner, &format!("fpn.fpn_lateral{}.", level + 2));
        name = name.replace(&outer, &format!("fpn.fpn_output{}.", level + 2));
        name = name.replace(&format!("mask_head.{level}.0."), &format!("mask_head.mask_fcn.{level}."));
    }
    for layer in 0..8 {
        // torchvision also numbers the activations between the convolutions.
        let theirs = format!("keypoint_head.{}.", 2 * layer);
        name = name.replace(&theirs, &format!("keypoint_head.conv_fcn.{layer}."));
    }
    name
}

fn detector(folder: &Path) -> GeneralizedRcnn {
    let text = std::fs::read_to_string(folder.join("config.json")).unwrap();
    let config = RcnnConfig::from_json(&text).unwrap().without_sampling();
    let detector = config.init(&Device::flex().autodiff(), 1).unwrap();
    let (detector, report) = state_dict::import(detector, &read(&folder.join("weights.safetensors")));
    assert!(report.is_complete(), "{report:?}");
    detector
}

fn compared(detector: &GeneralizedRcnn, folder: &Path) -> GoldenReport {
    let image = image::open(golden("detectron2/input.png")).unwrap().to_rgb8();
    verify(detector, &image, &read(&folder.join("expected.safetensors"))).unwrap()
}

fn agrees(folder: &Path) {
    agrees_but_for(folder, &|_| false);
}

/// Like `agrees`, but a stage for which `excused` returns true may be outside its tolerance.
fn agrees_but_for(folder: &Path, excused: &dyn Fn(&StageDifference) -> bool) {
    let report = compared(&detector(folder), folder);
    println!("{}\n{report}", folder.display());
    assert!(!report.stages.is_empty() && report.stages.iter().all(|s| s.passed || excused(s)), "{report}");
    // Every tensor of the reference except the targets was compared; keypoints have two stages.
    let reference = read(&folder.join("expected.safetensors"));
    for name in reference.keys().filter(|name| !name.starts_with("targets.")) {
        assert!(report.stages.iter().any(|stage| stage.name.starts_with(name)), "{name} was passed over");
    }
}

#[test]
fn detectron2_faster_agrees_at_every_stage() {
    agrees(&golden("detectron2/faster"));
}

#[test]
fn detectron2_keypoint_agrees_at_every_stage() {
    agrees(&golden("detectron2/keypoint"));
}

#[test]
fn detectron2_mask_agrees_at_every_stage() {
    agrees(&golden("detectron2/mask"));
}

#[test]
fn torchvision_faster_agrees_at_every_stage() {
    agrees(&golden("torchvision/faster"));
}

#[test]
fn torchvision_keypoint_agrees_at_every_stage() {
    agrees(&golden("torchvision/keypoint"));
}

#[test]
fn torchvision_mask_agrees_at_every_stage() {
    agrees(&golden("torchvision/mask"));
}

/// Maximum relative difference of a gradient from double precision.
///
/// In a whole network, some of the millions of activations are so near zero that rounding decides whether a ReLU passes
/// their gradient. So torch's gradients in single precision differ by up to 1.65e-3 from torch's gradients in double
/// precision (after the keypoint head's eight convolutions with a ReLU each). Ours differ by 1.1e-3 from the latter,
/// and by 1.7e-3 from torch's single precision. Therefore both are compared with double precision: our gradients must
/// be within this bound, or at least as close as torch's.
const WHOLE_GRADIENTS: f64 = 1e-3;

/// The maximum difference, relative to the largest expected magnitude.
fn relative_difference(found: &WeightTensor, expected: &WeightTensor) -> f64 {
    assert_eq!(found.shape, expected.shape);
    assert!(found.values.iter().all(|value| value.is_finite()));
    let largest = |values: &mut dyn Iterator<Item = f32>| f64::from(values.fold(0.0f32, |most, v| most.max(v.abs())));
    let difference = largest(&mut found.values.iter().zip(&expected.values).map(|(a, b)| a - b));
    difference / largest(&mut expected.values.iter().copied())
}

#[test]
#[ignore = "needs a Python with torchvision: make test-torch"]
fn a_whole_torchvision_network_agrees() {
    let python = std::env::var("SDG_TORCH_PYTHON").expect("SDG_TORCH_PYTHON names a Python that has torchvision");
    let folder = std::env::temp_dir().join(format!("sdg-whole-torchvision-{}", std::process::id()));
    let script = golden("torchvision/export.py");
    let status = Command::new(python).arg(script).arg("--whole").arg(&folder).status().unwrap();
    assert!(status.success(), "the exporter ended with {status}");
    agrees_but_for(&folder, &|stage| stage.name.starts_with("gradients."));
    let theirs = read(&folder.join("expected.safetensors"));
    assert!(theirs["detections.scores"].values.len() >= 4, "nothing to compare");

    let exact = read(&folder.join("exact.safetensors"));
    let targets = theirs.iter().filter(|(name, _)| name.starts_with("targets."));
    let targets: StateDict = targets.map(|(name, target)| (name.clone(), target.clone())).collect();
    let image = image::open(golden("detectron2/input.png")).unwrap().to_rgb8();
    let ours = record(&detector(&folder), &image, &targets).unwrap();
    assert!(exact.len() >= 8, "{:?}", exact.keys());
    for (name, exact) in &exact {
        let [ours, theirs] = [&ours[name], &theirs[name]].map(|found| relative_difference(found, exact));
        println!("{name}: from double precision {ours:.1e}, torch {theirs:.1e}");
        assert!(ours <= WHOLE_GRADIENTS.max(theirs), "{name}: from double precision {ours:.1e}, torch {theirs:.1e}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

/// A tensor's name, shape and values.
type Named<'a> = (&'a str, &'a [usize], &'a [f32]);

#[test]
fn references_without_objects_and_of_other_shapes_do_not_panic() {
    let text = std::fs::read_to_string(golden("detectron2/mask/config.json")).unwrap();
    let mut config = RcnnConfig::from_json(&text).unwrap().without_sampling();
    // Nothing is detected.
    config.roi_heads.box_head.score_threshold = 1.0;
    let detector = config.init(&Device::flex().autodiff(), 1).unwrap();
    let image = image::open(golden("detectron2/input.png")).unwrap().to_rgb8();
    let compared = |tensors: &[Named<'_>]| {
        let tensor = |shape: &[usize], values: &[f32]| WeightTensor { shape: shape.to_vec(), values: values.to_vec() };
        let reference: StateDict =
            tensors.iter().map(|(name, shape, values)| ((*name).to_owned(), tensor(shape, values))).collect();
        verify(&detector, &image, &reference)
    };
    assert!(!compared(&[("detections.masks", &[], &[0.0])]).unwrap().passed());
    let loss: Named<'_> = ("losses.loss_mask", &[1], &[0.5]);
    for (name, row) in [("targets.polygons", &[0][..]), ("targets.masks", &[0, 4][..])] {
        let shape = |count: usize| [&[count], row].concat();
        let (none, one) = (shape(0), shape(1));
        let tensors: [Named<'_>; 4] =
            [loss, ("targets.boxes", &[0, 4], &[]), ("targets.classes", &[0], &[]), (name, &none, &[])];
        assert!(!compared(&tensors).unwrap().passed(), "the loss without objects is 0");
        let tensors: [Named<'_>; 4] = [
            loss,
            ("targets.boxes", &[1, 4], &[10.0, 10.0, 60.0, 60.0]),
            ("targets.classes", &[1], &[0.0]),
            (name, &one, &[]),
        ];
        let refused = compared(&tensors).unwrap_err().to_string();
        assert!(refused.contains("one per box") && refused.contains("targets.masks"), "{refused}");
    }
}

#[test]
fn another_weight_is_noticed() {
    let folder = golden("detectron2/faster");
    let mut weights = read(&folder.join("weights.safetensors"));
    weights.get_mut("roi_heads.box_head.fc1.bias").unwrap().values[3] += 0.05;
    let (detector, _) = state_dict::import(detector(&folder), &weights);
    let report = compared(&detector, &folder);
    let failed: Vec<&str> =
        report.stages.iter().filter(|stage| !stage.passed).map(|stage| stage.name.as_str()).collect();
    assert!(!report.passed() && failed.contains(&"detections.scores"), "{report}");
    assert!(!failed.iter().any(|name| name.starts_with("features") || name.starts_with("proposals")), "{report}");
}
