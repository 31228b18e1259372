//! Tests that a small detector learns, that the result is repeatable, and that every parameter contributes.

use burn::module::{Module, ModuleVisitor, Param};
use burn::optim::{AdamWConfig, GradientsParams};
use burn::tensor::{Device, Gradients, Tensor};
use image::{Rgb, RgbImage};
use sdg_detection::config::{Freeze, KeypointReadout, NormKind, RcnnConfig, ResizeRule};
use sdg_detection::presets::RcnnKind;
use sdg_detection::{DetectionError, GeneralizedRcnn, ObjectMask, Target, TransformedImage, presets};
use sdg_geometry::{BoundingBox, GraspLine, Mask, Polygon};

const NUM_KEYPOINTS: usize = 3;

/// `edge`, reduced for a test: fewer channels, blocks and pixels, otherwise the same structure.
fn tiny() -> RcnnConfig {
    tiny_of(RcnnKind::Keypoint { num_keypoints: NUM_KEYPOINTS })
}

fn tiny_of(kind: RcnnKind) -> RcnnConfig {
    let mut config = presets::edge_of(kind);
    config.input.resize = ResizeRule::FitWithin { width_px: 128, height_px: 96 };
    config.backbone.stem_channels = 8;
    config.backbone.res2_channels = 8;
    config.backbone.num_blocks = [1, 1, 1, 1];
    config.backbone.norm = NormKind::Group { num_groups: 4 };
    config.fpn.channels = 16;
    config.roi_heads.sampler.batch_size_per_image = 32;
    config.roi_heads.box_head.fc_channels = 64;
    if let Some(head) = &mut config.roi_heads.keypoint_head {
        head.conv_channels = vec![16, 16];
        head.max_train_rois_per_image = Some(4);
    }
    if let Some(head) = &mut config.roi_heads.mask_head {
        head.conv_channels = vec![16, 16];
        head.deconv_channels = 16;
        head.max_train_rois_per_image = Some(4);
    }
    config
}

/// A red bar on a dim ramp, 256×192 px.
fn scene() -> (RgbImage, Target) {
    let bar = BoundingBox { x1: 60.0, y1: 70.0, x2: 160.0, y2: 110.0 };
    let image = RgbImage::from_fn(256, 192, |x, y| {
        let inside = (60..160).contains(&x) && (70..110).contains(&y);
        Rgb(if inside { [230, 40, 30] } else { [(x / 4) as u8, (y / 4) as u8, 60] })
    });
    let line = GraspLine::new([70.0, 90.0].into(), [150.0, 90.0].into());
    let target = Target {
        boxes: vec![bar],
        labels: vec![0],
        keypoints: vec![line.keypoints(NUM_KEYPOINTS)],
        masks: vec![Polygon::from_box(&bar).into()],
    };
    (image, target)
}

fn transformed(detector: &GeneralizedRcnn, image: &RgbImage) -> TransformedImage {
    detector.image_transform().apply(image).unwrap()
}

fn total(detector: &GeneralizedRcnn, images: &[TransformedImage], targets: &[Target], seed: u64) -> f32 {
    detector.losses(images, targets, seed).unwrap().total().into_scalar()
}

#[test]
fn a_tiny_detector_learns_one_image() {
    let device = Device::flex().autodiff();
    let mut detector = tiny().init(&device, 3).unwrap();
    let (image, target) = scene();
    let images = [transformed(&detector, &image)];
    let targets = [target.clone()];
    let first = total(&detector, &images, &targets, 0);
    let mut optimizer = AdamWConfig::new().init();
    for step in 0..80 {
        let losses = detector.losses(&images, &targets, step).unwrap();
        let gradients = GradientsParams::from_grads(losses.total().backward(), &detector);
        detector = optimizer.step(3e-3, detector, gradients);
    }
    let last = total(&detector, &images, &targets, 0);
    assert!(last < first / 3.0, "loss {first} -> {last}");

    let found = detector.valid().detect(&images).remove(0);
    assert!(!found.boxes.is_empty(), "nothing found at loss {last}");
    let overlap = found.boxes[0].iou(&target.boxes[0]);
    assert!(overlap > 0.7, "IoU {overlap}, found {:?}", found.boxes[0]);
    assert!(found.scores[0] > 0.5, "score {}", found.scores[0]);
    for (keypoint, wanted) in found.keypoints[0].iter().zip(&target.keypoints[0]) {
        let distance = (keypoint.x - wanted.x).hypot(keypoint.y - wanted.y);
        // Maximum distance: a tenth of the bar's length.
        assert!(distance < 10.0, "{keypoint:?} is {distance} px from {wanted:?}");
    }
}

#[test]
fn a_tiny_mask_detector_learns_one_image() {
    let device = Device::flex().autodiff();
    let mut detector = tiny_of(RcnnKind::Mask { num_classes: 1 }).init(&device, 3).unwrap();
    let (image, target) = scene();
    let images = [transformed(&detector, &image)];
    // The lower right half of the bar, which the box alone does not determine.
    let corners = [[160.0, 70.0], [160.0, 110.0], [60.0, 110.0]];
    let triangle = Polygon { vertices: corners.map(Into::into).to_vec() };
    let targets = [Target { masks: vec![triangle.clone().into()], ..target }];
    let mut optimizer = AdamWConfig::new().init();
    for step in 0..100 {
        let losses = detector.losses(&images, &targets, step).unwrap();
        let gradients = GradientsParams::from_grads(losses.total().backward(), &detector);
        detector = optimizer.step(3e-3, detector, gradients);
    }
    let found = detector.valid().detect(&images).remove(0);
    assert_eq!((found.masks.len(), found.keypoints.iter().flatten().count()), (found.boxes.len(), 0));
    let overlap = found.masks[0].iou(&triangle.rasterize(256, 192));
    assert!(overlap > 0.7, "IoU {overlap}, box {:?}", found.boxes[0]);
}

#[test]
fn a_bitmap_teaches_as_its_polygon_does() {
    let detector = tiny_of(RcnnKind::Mask { num_classes: 1 }).init(&Device::flex().autodiff(), 1).unwrap();
    let (image, target) = scene();
    let images = [transformed(&detector, &image)];
    let loss = |mask: ObjectMask| {
        let targets = [Target { masks: vec![mask], ..target.clone() }];
        let losses = detector.losses(&images, &targets, 0).unwrap();
        losses.values().into_iter().find(|(name, _)| *name == "mask").unwrap().1
    };
    let polygon = Polygon::from_box(&target.boxes[0]);
    let bitmap = loss(polygon.rasterize(256, 192).into());
    let empty = loss(Mask::empty(256, 192).into());
    let polygon = loss(polygon.into());
    // An untrained network's loss is nearly ln 2 per cell for every mask; only cells in which the masks differ make a
    // difference.
    assert!((bitmap - polygon).abs() < 0.1 * (empty - polygon).abs(), "{bitmap} {polygon} {empty}");
}

#[test]
fn the_seed_decides_every_bit() {
    let device = Device::flex().autodiff();
    let (image, target) = scene();
    let run = |init_seed, step_seed| {
        let detector = tiny().init(&device, init_seed).unwrap();
        let images = [transformed(&detector, &image)];
        let losses = detector.losses(&images, std::slice::from_ref(&target), step_seed).unwrap();
        let gradients = losses.total().backward();
        let weight = &detector.backbone.bottom_up.stem.conv1.weight;
        let gradient = weight.val().grad(&gradients).unwrap().into_data();
        (losses.values(), gradient)
    };
    assert_eq!(run(1, 1), run(1, 1));
    assert_ne!(run(1, 1), run(2, 1));
    assert_ne!(run(1, 1), run(1, 2));
}

/// Collects the paths of the parameters that a gradient reaches, and those of the others.
struct GradientCheck<'a> {
    path: Vec<String>,
    gradients: &'a Gradients,
    reached: Vec<String>,
    unreached: Vec<String>,
}

impl ModuleVisitor for GradientCheck<'_> {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.path.push(name.to_owned());
    }
    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.pop();
    }
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let largest = param.val().grad(self.gradients).map(|g| g.abs().max().into_scalar::<f32>());
        let list = match largest {
            Some(value) if value > 0.0 && value.is_finite() => &mut self.reached,
            _ => &mut self.unreached,
        };
        list.push(self.path.join("."));
    }
}

fn gradient_paths(config: &RcnnConfig) -> (Vec<String>, Vec<String>) {
    let detector = config.init(&Device::flex().autodiff(), 5).unwrap();
    let (image, target) = scene();
    let images = [transformed(&detector, &image)];
    let gradients = detector.losses(&images, &[target], 0).unwrap().total().backward();
    let mut check =
        GradientCheck { path: Vec::new(), gradients: &gradients, reached: Vec::new(), unreached: Vec::new() };
    detector.visit(&mut check);
    (check.reached, check.unreached)
}

#[test]
fn gradients_reach_every_parameter() {
    let (reached, unreached) = gradient_paths(&tiny_of(RcnnKind::Mask { num_classes: 1 }));
    assert!(unreached.is_empty(), "{unreached:?}");
    for path in ["mask_fcn.0.weight", "deconv.bias", "predictor.weight"] {
        assert!(reached.contains(&format!("roi_heads.mask_head.{path}")), "{path} not in {reached:?}");
    }
    let (reached, unreached) = gradient_paths(&tiny());
    assert!(unreached.is_empty(), "{unreached:?}");
    for path in [
        "backbone.bottom_up.stem.conv1.norm.weight",
        "backbone.bottom_up.res3.0.shortcut.weight",
        "backbone.fpn.fpn_lateral2.bias",
        "proposal_generator.rpn_head.anchor_deltas.weight",
        "roi_heads.box_predictor.bbox_pred.weight",
        "roi_heads.keypoint_head.conv_fcn.0.weight",
        "roi_heads.keypoint_head.score_lowres.bias",
    ] {
        assert!(reached.iter().any(|p| p == path), "{path} not in {reached:?}");
    }
}

#[test]
fn gradients_spare_the_frozen() {
    let mut config = tiny();
    config.backbone.norm = NormKind::FrozenBatch { eps: 1e-5 };
    config.backbone.freeze = Freeze::ThroughRes2;
    let (reached, unreached) = gradient_paths(&config);
    let is_frozen = |path: &String| path.contains(".norm.") || path.contains(".stem.") || path.contains(".res2.");
    assert!(unreached.iter().all(is_frozen), "{unreached:?}");
    assert!(!reached.iter().any(is_frozen), "{reached:?}");
    assert!(unreached.len() > 8 && reached.len() > 20);

    let mut config = tiny();
    config.backbone.freeze = Freeze::FirstStage;
    let (reached, unreached) = gradient_paths(&config);
    assert!(reached.iter().all(|path| path.starts_with("roi_heads.")) && reached.len() > 10, "{reached:?}");
    assert!(unreached.iter().all(|path| !path.starts_with("roi_heads.")) && unreached.len() > 20, "{unreached:?}");
}

#[test]
fn an_image_without_objects_teaches_background() {
    let detector = tiny().init(&Device::flex().autodiff(), 1).unwrap();
    let images = [transformed(&detector, &scene().0)];
    let losses = detector.losses(&images, &[Target::default()], 0).unwrap();
    let values = losses.values();
    assert!(values.iter().all(|(_, v)| v.is_finite()), "{values:?}");
    assert!(values[0].1 > 0.0 && values[2].1 > 0.0, "{values:?}");
    assert_eq!((values[1].1, values[3].1, values[4].1), (0.0, 0.0, 0.0), "{values:?}");
    losses.total().backward();
}

#[test]
fn targets_are_checked() {
    let detector = tiny().init(&Device::flex().autodiff(), 1).unwrap();
    let (image, target) = scene();
    let images = [transformed(&detector, &image)];
    let error = |target: Target| detector.losses(&images, &[target], 0).unwrap_err();
    let class = error(Target { labels: vec![1], ..target.clone() });
    assert!(matches!(class, DetectionError::Target { field: "labels", .. }), "{class}");
    let mut flat = target.clone();
    flat.boxes[0].x2 = flat.boxes[0].x1;
    assert!(matches!(error(flat), DetectionError::Target { field: "boxes", .. }));
    let mut short = target.clone();
    short.keypoints[0].pop();
    assert!(matches!(error(short), DetectionError::Target { field: "keypoints", .. }));
    let mut nan = target.clone();
    nan.keypoints[0][1].x = f64::NAN;
    assert!(matches!(error(nan), DetectionError::Target { field: "keypoints", .. }));
    let with_masks = tiny_of(RcnnKind::Mask { num_classes: 1 }).init(&Device::flex().autodiff(), 1).unwrap();
    for masks in [Vec::new(), vec![Mask::empty(3, 3).into()], vec![ObjectMask::Polygons(Vec::new())]] {
        let error = with_masks.losses(&images, &[Target { masks, ..target.clone() }], 0).unwrap_err();
        assert!(matches!(error, DetectionError::Target { field: "masks", .. }), "{error}");
    }
    let number = detector.losses(&images, &[], 0).unwrap_err();
    assert_eq!(number, DetectionError::BatchSize { expected: 1, found: 0 });
}

#[test]
fn a_batch_of_different_sizes_and_both_readouts_work() {
    let mut config = tiny();
    config.roi_heads.box_head.score_threshold = 0.0;
    for readout in [KeypointReadout::BicubicArgmax, KeypointReadout::LocalMean { radius: 2 }] {
        if let Some(head) = &mut config.roi_heads.keypoint_head {
            head.readout = readout;
        }
        let detector = config.init(&Device::flex(), 1).unwrap();
        let wide = transformed(&detector, &scene().0);
        let tall = transformed(&detector, &RgbImage::from_pixel(50, 90, Rgb([90, 20, 10])));
        let found = detector.detect(&[wide, tall]);
        assert_eq!(found.len(), 2);
        for (detections, (width, height)) in found.iter().zip([(256.0, 192.0), (50.0, 90.0)]) {
            assert!(!detections.boxes.is_empty());
            assert!(detections.keypoints.iter().all(|k| k.len() == NUM_KEYPOINTS));
            assert!(detections.boxes.iter().all(|b| *b == b.clip(width, height)));
            assert!(detections.scores.is_sorted_by(|a, b| a >= b));
        }
    }
}
