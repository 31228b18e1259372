//! Compares every other device of the build with flex, for the models with a network: stage by stage, end to end, and
//! in teaching.
//!
//! Requires the features of the devices: `make test-wgpu`, `make test-ndarray`.

use burn::tensor::Device;
use sdg_detection::RcnnConfig;
use sdg_detection::golden::{record, verify};
use sdg_layers::state_dict::{self, StateDict, WeightTensor};

use super::tests::{demonstration, small_teaching, taught};
use super::*;
use crate::check_config::CheckConfig;
use crate::detection::GraspDetection;
use crate::device::ComputeBackend;
use crate::model::Verification;

/// Tolerance of a position, in pixels of the given image: a fifth of the shift that half precision may cause.
const PLACE_PX: f64 = 0.02;
/// Tolerance of an angle, in degrees.
const TURN_DEGREES: f64 = 0.02;
/// Tolerance of a score or an agreement.
const SCORE: f64 = 1e-3;
/// Relative tolerance of the losses of the first steps: the differences of a step affect the weights of the next.
const LOSSES: f64 = 1e-3;
/// Number of steps whose losses are compared.
const COMPARED_STEPS: usize = 4;

const NETWORK_MODELS: [ModelKind; 4] = [ModelKind::A, ModelKind::B, ModelKind::C, ModelKind::D];

fn devices() -> Vec<(ComputeBackend, Device)> {
    let others = ComputeBackend::ALL.into_iter().filter(|backend| *backend != ComputeBackend::Flex);
    others.filter(|backend| backend.is_built()).map(|backend| (backend, backend.open().unwrap())).collect()
}

/// The photo's marks as targets of a training step, in pixels of the resized image.
fn targets(network: &RcnnConfig) -> StateDict {
    let Demonstration { image, annotation } = demonstration();
    let transformed = sdg_detection::ImageTransform::new(&network.input).apply(&image).unwrap();
    let [sx, sy] =
        [transformed.width as f64 / f64::from(image.width()), transformed.height as f64 / f64::from(image.height())]
            .map(|scale| scale as f32);
    let b = annotation.bbox;
    let tensor = |shape: &[usize], values: Vec<f32>| WeightTensor { shape: shape.to_vec(), values };
    let grasp = annotation.grasp.unwrap();
    let along = |t: f64| grasp.start + (grasp.end - grasp.start) * t;
    let keypoints: Vec<f32> = (0..crate::NUM_KEYPOINTS)
        .map(|i| along(i as f64 / (crate::NUM_KEYPOINTS - 1) as f64))
        .flat_map(|p| [p.x as f32 * sx, p.y as f32 * sy, 2.0])
        .collect();
    let vertices = annotation.outline.unwrap().vertices;
    let outline: Vec<f32> = vertices.iter().flat_map(|v| [v.x as f32 * sx, v.y as f32 * sy]).collect();
    let corners = vec![b.x1 as f32 * sx, b.y1 as f32 * sy, b.x2 as f32 * sx, b.y2 as f32 * sy];
    StateDict::from([
        ("targets.boxes".to_owned(), tensor(&[1, 4], corners)),
        ("targets.classes".to_owned(), tensor(&[1], vec![0.0])),
        ("targets.keypoints".to_owned(), tensor(&[1, crate::NUM_KEYPOINTS, 3], keypoints)),
        ("targets.polygons".to_owned(), tensor(&[1, outline.len()], outline)),
    ])
}

#[test]
fn every_stage_of_every_network_agrees() {
    for kind in [ModelKind::A, ModelKind::C, ModelKind::D] {
        let Network { detector, .. } = taught(Preset::Edge, kind).network.unwrap();
        let config = detector.config().clone().without_sampling();
        let weights = state_dict::export(&detector);
        let on = |device: &Device| {
            let (detector, report) = state_dict::import(config.init(&device.clone().autodiff(), 1).unwrap(), &weights);
            assert!(report.is_complete());
            detector
        };
        let photo = demonstration().image;
        let reference = record(&on(&Device::flex()), &photo, &targets(&config)).unwrap();
        assert!(!reference["detections.scores"].values.is_empty(), "{kind}: nothing to compare");
        assert!(reference.keys().filter(|name| name.starts_with("gradients.")).count() > 50);
        for (backend, device) in devices() {
            let report = verify(&on(&device), &photo, &reference).unwrap();
            println!("{kind} on {backend}\n{report}");
            assert!(report.passed(), "{kind} on {backend}\n{report}");
        }
    }
}

/// The detections with enough agreement, or without verification. With less agreement the part is absent and the pose
/// undetermined: the refinement ends at a pose that depends on the last bits of the values.
fn placed(detections: &[GraspDetection]) -> Vec<&GraspDetection> {
    let is_placed = |agreement: f64| agreement >= CheckConfig::DEFAULT.search.min_agreement;
    detections.iter().filter(|detection| detection.agreement.is_none_or(is_placed)).collect()
}

fn assert_same(found: &[GraspDetection], expected: &[GraspDetection], about: &str) {
    let [found, expected] = [found, expected].map(placed);
    assert_eq!(found.len(), expected.len(), "{about}: {found:#?}\n{expected:#?}");
    for (found, expected) in found.iter().zip(&expected) {
        let (a, b) = (&found.bbox, &expected.bbox);
        let place = [a.x1 - b.x1, a.y1 - b.y1, a.x2 - b.x2, a.y2 - b.y2]
            .into_iter()
            .chain((found.grasp.center() - expected.grasp.center()).iter().copied())
            .fold(0.0f64, |most, difference| most.max(difference.abs()));
        let turn = sdg_geometry::Angle::distance(found.grasp.angle, expected.grasp.angle).to_degrees();
        let score = (found.score - expected.score).abs().max((found.network_score - expected.network_score).abs());
        println!("{about}: {place:.1e} px, {turn:.1e}°, score {score:.1e}");
        assert!(place < PLACE_PX && turn < TURN_DEGREES && score < SCORE, "{about}: {found:?}\n{expected:?}");
    }
}

#[test]
fn every_model_detects_the_same() {
    let photo = demonstration().image;
    for kind in NETWORK_MODELS {
        let model = taught(Preset::Edge, kind);
        let bytes = model.to_bytes().unwrap();
        for (backend, device) in devices() {
            let there = GraspModel::from_bytes(&bytes, &device).unwrap();
            for verification in [Verification::Off, Verification::ByShape] {
                let expected = model.detect(&photo, verification).unwrap();
                let found = there.detect(&photo, verification).unwrap();
                // After so few steps the mask may find nothing, but the verification finds the part in its own photo.
                assert!(verification == Verification::Off || expected[0].is_accepted(), "{kind}: {expected:?}");
                assert_same(&found, &expected, &format!("{kind} on {backend}, {verification:?}"));
            }
        }
    }
}

#[test]
fn teaching_goes_the_same_way() {
    let losses = |device: Device, kind: ModelKind| {
        let options = TeachOptions { kind, device, ..TeachOptions::new(1) };
        let mut losses = Vec::new();
        let taught = teach_network(
            &[demonstration()],
            &[demonstration()],
            &small_teaching(&options),
            &options,
            &mut |event| {
                if let TeachingEvent::Step { record, .. } = event {
                    losses.push(record.losses.total());
                }
                ControlFlow::Continue(())
            },
            Instant::now(),
        )
        .unwrap();
        // The part is found in its own photo with any state of the network.
        let found = taught.model.detect(&demonstration().image, Verification::ByShape).unwrap();
        assert!(found[0].is_accepted(), "{kind}: {found:?}");
        losses
    };
    for kind in [ModelKind::A, ModelKind::C, ModelKind::D] {
        let expected = losses(Device::flex(), kind);
        for (backend, device) in devices() {
            let found = losses(device, kind);
            println!("{kind} on {backend}: {found:?}, on flex {expected:?}");
            assert_eq!(found.len(), expected.len());
            for (found, expected) in found.iter().zip(&expected).take(COMPARED_STEPS) {
                assert!((found - expected).abs() < LOSSES * expected, "{kind} on {backend}: {found}, {expected}");
            }
        }
    }
}
