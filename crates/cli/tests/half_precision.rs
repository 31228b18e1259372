//! `sdg weights convert --f16`: the detections of a trained network, compared with those in full precision.
//!
//! Rounding to half precision moves every box a little. Non-maximum suppression keeps the highest score of overlapping
//! boxes; if two scores are nearly equal, rounding may change which box is kept, although no box has moved. Each
//! detection is therefore compared with the same box before suppression, and changes of the kept box are counted
//! separately: each must be a tie. In the same way a keypoint is the highest place of a heat map; if two places are
//! nearly equally high, rounding may change which of them is read. The heights must then be nearly equal.

use std::cell::LazyCell;
use std::collections::HashMap;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::Command;

use image::RgbImage;
use safetensors::{Dtype, tensor::TensorView};
use sdg_demonstration::{AugmentationConfig, Augmenter};
use sdg_detection::config::{KeypointReadout, RcnnConfig};
use sdg_detection::{Detections, GeneralizedRcnn, presets};
use sdg_evaluation::shipped;
use sdg_grasp::{Device, NUM_KEYPOINTS};
use sdg_inputs::base_weights;
use sdg_layers::state_dict;
use sdg_training::{Outcome, SampleSource, TrainingConfig, ValidationConfig, train};

/// Maximum difference of boxes and keypoints, in pixels of the original image.
const MAX_PX: f64 = 0.1;
/// Minimum score of detections that are compared.
const SURE: f64 = 0.5;
/// Maximum difference of two scores that tie.
const TIE: f64 = 2e-3;
/// Number of training steps, enough to detect most parts with a high score.
const STEPS: usize = 90;
/// Number of unseen pictures, with and without parts.
const PICTURES: u64 = 45;
/// Minimum number of compared detections. Training is rounded differently on processors with other vector instructions,
/// so that the networks give different numbers of detections.
const MIN_COMPARED: usize = 15;

/// The `edge` network, trained on the pendulum from random initialisation.
fn trained() -> GeneralizedRcnn {
    let demonstration = [shipped::demonstration("pendulum").unwrap()];
    let samples = AugmentationConfig::default().with_output_size(320, 240);
    let augmenter = Augmenter::new(&demonstration, samples, 1).unwrap();
    let network = presets::edge(NUM_KEYPOINTS);
    let windows = augmenter.windows(network.input.size_divisibility as u32);
    let training = TrainingConfig {
        steps: STEPS,
        validation: ValidationConfig { every: STEPS, first: STEPS, samples: 1 },
        early_stop: None,
        ..TrainingConfig::edge(1)
    };
    let source = SampleSource { frames: &|i| augmenter.sample(i), windows: &|i| windows.sample(i) };
    // The only validation is at the last step; its result is a dummy.
    let unexamined = &mut |_: &GeneralizedRcnn| Ok(vec![Outcome::Missed]);
    let detector = network.init(&Device::flex().autodiff(), 1).unwrap();
    train(detector, &training, source, unexamined, &mut |_| ControlFlow::Continue(())).unwrap().detector
}

/// Writes a detector's weights in full precision, in the format of a converted file.
fn write_checkpoint(detector: &GeneralizedRcnn, path: &Path) {
    let weights = state_dict::export(detector);
    let bytes: Vec<(String, Vec<usize>, Vec<u8>)> = weights
        .into_iter()
        .map(|(name, w)| (name, w.shape, w.values.iter().flat_map(|value| value.to_le_bytes()).collect()))
        .collect();
    let views =
        bytes.iter().map(|(name, shape, bytes)| (name, TensorView::new(Dtype::F32, shape.clone(), bytes).unwrap()));
    let network = serde_json::to_string(detector.config()).unwrap();
    let metadata = HashMap::from([("network".to_owned(), network)]);
    safetensors::serialize_to_file(views, Some(metadata), path).unwrap();
}

/// Converts a checkpoint and reads the result; also returns the file's size.
fn converted(checkpoint: &Path, network: &RcnnConfig, flags: &[&str]) -> (u64, state_dict::StateDict) {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("converted.safetensors");
    let status = Command::new(env!("CARGO_BIN_EXE_sdg"))
        .args(["weights", "convert"])
        .args([checkpoint, &out])
        .args(flags)
        .output()
        .unwrap();
    assert!(status.status.success(), "{status:?}");
    let base = base_weights::read(&out, network, &[], &mut |_| Ok(())).unwrap();
    (std::fs::metadata(&out).unwrap().len(), base.parameters)
}

/// A detector, and the same detector without suppression, which gives all boxes.
struct Detector {
    whole: GeneralizedRcnn,
    unsuppressed: GeneralizedRcnn,
}

impl Detector {
    fn new(network: &RcnnConfig, weights: &state_dict::StateDict) -> Self {
        let build = |network: &RcnnConfig| {
            let (detector, report) = state_dict::import(network.init(&Device::flex(), 1).unwrap(), weights);
            assert!(report.is_complete(), "{report:?}");
            detector
        };
        let mut unsuppressed = network.clone();
        unsuppressed.rpn.nms_threshold = 1.0;
        unsuppressed.rpn.post_nms_top_n.test = 10_000;
        let heads = &mut unsuppressed.roi_heads.box_head;
        (heads.nms_threshold, heads.detections_per_image, heads.score_threshold) = (1.0, 10_000, SURE - 0.1);
        Self { whole: build(network), unsuppressed: build(&unsuppressed) }
    }
}

fn detect(detector: &GeneralizedRcnn, image: &RgbImage) -> Detections {
    let transformed = detector.image_transform().apply(image).unwrap();
    detector.detect(&[transformed]).remove(0)
}

/// The largest difference between two boxes' corners.
fn box_difference(a: &Detections, i: usize, b: &Detections, j: usize) -> f64 {
    let (a, b) = (&a.boxes[i], &b.boxes[j]);
    [a.x1 - b.x1, a.y1 - b.y1, a.x2 - b.x2, a.y2 - b.y2].into_iter().fold(0.0f64, |most, d| most.max(d.abs()))
}

/// For each keypoint, the larger of its distances in x and y, and the difference of its scores.
fn keypoint_differences(a: &Detections, i: usize, b: &Detections, j: usize) -> Vec<[f64; 2]> {
    let pairs = a.keypoints[i].iter().zip(&b.keypoints[j]);
    pairs.map(|(a, b)| [(a.x - b.x).abs().max((a.y - b.y).abs()), (a.score - b.score).abs()]).collect()
}

/// The detection of `among` whose box is nearest.
fn nearest(found: &Detections, i: usize, among: &Detections) -> Option<usize> {
    let distance = |j: &usize| box_difference(found, i, among, *j);
    (0..among.boxes.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// The effects of rounding on the detections of all pictures.
#[derive(Debug, Default)]
struct Comparison {
    /// Number of compared detections in full precision.
    sure: usize,
    /// Number of these that are replaced by a neighbour whose score differs by less than [`TIE`].
    ties: usize,
    box_px: f64,
    keypoint_px: f64,
    /// Number of keypoints, and of those that are read at another place whose score differs by less than
    /// [`TIE`].
    keypoints: usize,
    keypoint_ties: usize,
    score: f64,
}

fn compare(exact: &Detector, rounded: &Detector, pictures: &[RgbImage]) -> Comparison {
    let mut made = Comparison::default();
    for picture in pictures {
        let [expected, found] = [&exact.whole, &rounded.whole].map(|detector| detect(detector, picture));
        // Computed only for the few pictures with a tie.
        let unsuppressed =
            LazyCell::new(|| [&exact.unsuppressed, &rounded.unsuppressed].map(|detector| detect(detector, picture)));
        for i in (0..expected.boxes.len()).filter(|&i| expected.scores[i] >= SURE) {
            made.sure += 1;
            let j = nearest(&expected, i, &found).expect("half precision finds what full precision is sure of");
            let kept_the_same = box_difference(&expected, i, &found, j) < MAX_PX;
            let (of, j) = if kept_the_same {
                (&found, j)
            } else {
                made.ties += 1;
                let [neighbours, candidates] = &*unsuppressed;
                // Before rounding, the neighbour that is kept instead had nearly the same score.
                let other = nearest(&found, j, neighbours).unwrap();
                let margin = expected.scores[i] - neighbours.scores[other];
                println!("a tie: {:.5} and {:.5}", expected.scores[i], neighbours.scores[other]);
                assert!(margin.abs() < TIE, "kept instead of a box that scores {margin} more");
                (candidates, nearest(&expected, i, candidates).unwrap())
            };
            made.box_px = made.box_px.max(box_difference(&expected, i, of, j));
            for [moved_px, score] in keypoint_differences(&expected, i, of, j) {
                made.keypoints += 1;
                if moved_px >= MAX_PX && score < TIE {
                    made.keypoint_ties += 1;
                    println!("a keypoint's tie: moved {moved_px:.3} px, scores differ by {score:.5}");
                } else {
                    made.keypoint_px = made.keypoint_px.max(moved_px);
                }
            }
            made.score = made.score.max((expected.scores[i] - of.scores[j]).abs());
        }
    }
    made
}

#[test]
fn half_precision_moves_no_detection_of_a_trained_network_by_a_tenth_of_a_pixel() {
    let folder = tempfile::tempdir().unwrap();
    let checkpoint = folder.path().join("trained.safetensors");
    let detector = trained();
    write_checkpoint(&detector, &checkpoint);
    let network = detector.config();
    let [(bytes, exact), (half_bytes, rounded)] =
        [converted(&checkpoint, network, &[]), converted(&checkpoint, network, &["--f16"])];
    assert!(exact == state_dict::export(&detector) && exact != rounded);
    assert!(half_bytes * 100 < bytes * 52, "{half_bytes} of {bytes} bytes");

    let demonstration = [shipped::demonstration("pendulum").unwrap()];
    let unseen = AugmentationConfig::default().with_output_size(640, 480);
    let unseen = Augmenter::new(&demonstration, unseen, 2).unwrap();
    let pictures: Vec<RgbImage> = (0..PICTURES).map(|i| unseen.held_out(i).image).collect();
    for readout in [network.roi_heads.keypoint_head.as_ref().unwrap().readout, KeypointReadout::BicubicArgmax] {
        let mut network = network.clone();
        network.roi_heads.keypoint_head.as_mut().unwrap().readout = readout;
        let made = compare(&Detector::new(&network, &exact), &Detector::new(&network, &rounded), &pictures);
        println!("{bytes} and {half_bytes} bytes, {readout:?}: {made:?}");
        assert!(made.sure >= MIN_COMPARED, "{made:?}");
        assert!(made.box_px < MAX_PX && made.keypoint_px < MAX_PX, "{made:?}");
        assert!(made.ties * 10 <= made.sure && made.keypoint_ties * 50 <= made.keypoints, "{made:?}");
    }
}
