//! Compares every stage of the detector with a reference's outputs for the same image and weights.
//!
//! ```text
//! preprocessed ─ features.p2…p6 ─ anchors.p2…p6 ─ proposals.* ─ detections.*      one image in inference
//! targets.* ─ losses.* ─ gradients.<parameter>                                   one step of training
//! ```
//!
//! The reference is a list of tensors with these names. Tensors that it lacks are not compared. Detections are in
//! pixels of the given image, targets in pixels of the resized image; polygons are x0 y0 x1 y1 …, one per box; masks
//! are 0 or 1.

use std::fmt;

use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::{Gradients, Tensor, read_sync};
use image::RgbImage;
use sdg_geometry::{Keypoint, Mask, Polygon, Visibility};
use serde::Serialize;

use crate::boxes::Corners;
use crate::config::RcnnConfig;
use crate::error::{DetectionError, Result};
use crate::generalized_rcnn::{Detections, GeneralizedRcnn};
use crate::host::host_values;
use crate::image_transform::TransformedImage;
use crate::rpn::Mode;
use crate::target::ObjectMask;
use crate::target::ResizedTarget;
use sdg_layers::state_dict::{StateDict, WeightTensor};

/// Number of samples per image, large enough that every anchor and proposal enters the losses, as in the reference.
const ALL_SAMPLES: usize = 1_000_000;

/// Gradients smaller than this fraction of the network's largest gradient are zero except for rounding, so their
/// relative differences are only noise. An example is the gradient of a bias before a softmax over positions: adding a
/// constant to all positions changes nothing.
const NOISE_OF_GRADIENTS: f32 = 1e-6;

/// Tolerances of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Tolerance {
    /// Maximum difference, relative to the largest expected magnitude.
    Relative(f64),
    /// Maximum difference, in the tensor's own unit.
    Absolute(f64),
    /// Maximum fraction of an image's pixels that differ.
    Pixels(f64),
}

/// The comparison of one tensor.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StageDifference {
    /// Name in the reference.
    pub name: String,
    /// Number of compared values.
    pub count: usize,
    /// Maximum difference; infinite if shapes differ or a value is not finite.
    pub max_absolute: f64,
    /// Maximum difference, relative to the largest expected magnitude.
    pub max_relative: f64,
    /// The tolerance of the difference.
    pub tolerance: Tolerance,
    /// Whether the difference is within the tolerance.
    pub passed: bool,
    /// A further remark, for example about two different shapes.
    pub remark: Option<String>,
}

/// All comparisons, in the order of the stages.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct GoldenReport {
    /// One comparison for each tensor; two for the keypoints: positions and scores.
    pub stages: Vec<StageDifference>,
}

impl GoldenReport {
    /// Whether at least one tensor was compared and all are within their tolerances.
    pub fn passed(&self) -> bool {
        !self.stages.is_empty() && self.stages.iter().all(|stage| stage.passed)
    }
}

impl fmt::Display for GoldenReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for stage in &self.stages {
            let verdict = if stage.passed { "ok" } else { "FAILED" };
            write!(f, "{verdict:6} {:60}", stage.name)?;
            write!(f, " absolute {:.1e} relative {:.1e}", stage.max_absolute, stage.max_relative)?;
            match stage.tolerance {
                Tolerance::Relative(bound) => write!(f, " (relative up to {bound:.0e})")?,
                Tolerance::Absolute(bound) => write!(f, " (absolute up to {bound})")?,
                Tolerance::Pixels(bound) => write!(f, " (up to {bound} of the pixels)")?,
            }
            match &stage.remark {
                Some(remark) => writeln!(f, ": {remark}")?,
                None => writeln!(f)?,
            }
        }
        Ok(())
    }
}

impl RcnnConfig {
    /// The configuration with every anchor and proposal in the losses, as in the reference outputs.
    pub fn without_sampling(mut self) -> Self {
        self.rpn.sampler.batch_size_per_image = ALL_SAMPLES;
        self.roi_heads.sampler.batch_size_per_image = ALL_SAMPLES;
        self
    }
}

/// Runs `detector` on `image` and compares each stage with the values in `reference`.
///
/// Names after `gradients.` are paths of this project's parameters. For losses and gradients the detector must be
/// on a device with autodiff and configured by [`RcnnConfig::without_sampling`].
///
/// # Errors
/// An image without pixels, or targets in the reference that do not fit each other.
pub fn verify(detector: &GeneralizedRcnn, image: &RgbImage, reference: &StateDict) -> Result<GoldenReport> {
    let mut comparer = Comparer::new(reference);
    let transformed = detector.image_transform().apply(image)?;
    comparer.inference(&detector.valid(), &transformed);
    if reference.keys().any(|name| name.starts_with("losses.") || name.starts_with("gradients.")) {
        comparer.training(detector, &transformed)?;
    }
    Ok(GoldenReport { stages: comparer.stages })
}

/// Runs `detector` on `image` and returns the tensors that [`verify`] would compare, as a reference for another device
/// or another precision. If `targets` has the tensors of a training step, the result also contains the losses, the
/// gradients of all parameters, and the targets themselves.
///
/// # Errors
/// An image without pixels, or targets that do not fit each other.
pub fn record(detector: &GeneralizedRcnn, image: &RgbImage, targets: &StateDict) -> Result<StateDict> {
    let mut comparer = Comparer { recorded: Some(targets.clone()), ..Comparer::new(targets) };
    let transformed = detector.image_transform().apply(image)?;
    comparer.inference(&detector.valid(), &transformed);
    if targets.contains_key("targets.boxes") {
        comparer.training(detector, &transformed)?;
    }
    Ok(comparer.recorded.unwrap_or_default())
}

struct Comparer<'a> {
    reference: &'a StateDict,
    stages: Vec<StageDifference>,
    /// If present, computed tensors are stored here instead of compared.
    recorded: Option<StateDict>,
}

impl<'a> Comparer<'a> {
    fn new(reference: &'a StateDict) -> Self {
        Self { reference, stages: Vec::new(), recorded: None }
    }

    /// Compares one tensor if the reference contains it, or records the tensor.
    fn compare(&mut self, name: &str, shape: &[usize], values: &[f32], tolerance: Tolerance) {
        if let Some(recorded) = &mut self.recorded {
            recorded.insert(name.to_owned(), WeightTensor { shape: shape.to_vec(), values: values.to_vec() });
            return;
        }
        let Some(expected) = self.reference.get(name) else {
            return;
        };
        let stage = |max_absolute: f64, scale: f64, measured: f64, bound: f64, remark| StageDifference {
            name: name.to_owned(),
            count: values.len(),
            max_absolute,
            max_relative: if scale > 0.0 { max_absolute / scale } else { max_absolute },
            tolerance,
            passed: measured <= bound,
            remark,
        };
        if expected.shape != shape || expected.values.len() != values.len() {
            let remark = format!("expected shape {:?}, found {shape:?}", expected.shape);
            self.stages.push(stage(f64::INFINITY, 1.0, f64::INFINITY, 0.0, Some(remark)));
            return;
        }
        let difference = |(a, b): (&f32, &f32)| {
            let difference = (f64::from(*a) - f64::from(*b)).abs();
            if difference.is_nan() { f64::INFINITY } else { difference }
        };
        let max_absolute = values.iter().zip(&expected.values).map(difference).fold(0.0, f64::max);
        let scale = expected.values.iter().map(|v| f64::from(v.abs())).fold(0.0, f64::max);
        let relative = if scale > 0.0 { max_absolute / scale } else { max_absolute };
        let done = match tolerance {
            Tolerance::Relative(bound) => stage(max_absolute, scale, relative, bound, None),
            Tolerance::Absolute(bound) => stage(max_absolute, scale, max_absolute, bound, None),
            Tolerance::Pixels(bound) => {
                let pixels: usize = shape.iter().skip(1).product();
                let images = values.chunks(pixels.max(1)).zip(expected.values.chunks(pixels.max(1)));
                let worst = images
                    .map(|(a, b)| a.iter().zip(b).filter(|(a, b)| (**a >= 0.5) != (**b >= 0.5)).count())
                    .max()
                    .unwrap_or(0);
                let remark = format!("{worst} of {pixels} pixels differ in the worst mask");
                stage(max_absolute, scale, worst as f64 / pixels.max(1) as f64, bound, Some(remark))
            }
        };
        self.stages.push(done);
    }

    fn inference(&mut self, detector: &GeneralizedRcnn, image: &TransformedImage) {
        let images = std::slice::from_ref(image);
        let (tensor, sizes) = detector.batch(images);
        let dims = tensor.dims();
        self.compare("preprocessed", &dims, &host_values(tensor.clone()), Tolerance::Relative(1e-4));
        let features = detector.backbone.forward(tensor);
        for (level, feature) in (2..).zip(&features) {
            let values = host_values(feature.clone());
            self.compare(&format!("features.p{level}"), &feature.dims(), &values, Tolerance::Relative(1e-4));
        }
        let [_, _, height, width] = dims;
        let predictions = detector.proposal_generator.predict(&features, [height, width]);
        for (level, anchors) in (2..).zip(&predictions.anchors) {
            self.boxes(&format!("anchors.p{level}"), anchors, Tolerance::Relative(1e-4));
        }
        let proposals = detector.proposal_generator.propose(&predictions, &sizes, Mode::Test);
        self.boxes("proposals.boxes", &proposals[0].boxes, Tolerance::Relative(1e-4));
        let logits = &proposals[0].objectness_logits;
        self.compare("proposals.objectness_logits", &[logits.len()], logits, Tolerance::Relative(1e-4));
        let mut found = read_sync(detector.detections(images, &features, &proposals));
        self.detections(&found.remove(0));
    }

    fn boxes(&mut self, name: &str, boxes: &[Corners], tolerance: Tolerance) {
        self.compare(name, &[boxes.len(), 4], boxes.as_flattened(), tolerance);
    }

    fn detections(&mut self, found: &Detections) {
        let count = found.boxes.len();
        let boxes: Vec<Corners> = found.boxes.iter().map(|b| [b.x1, b.y1, b.x2, b.y2].map(|v| v as f32)).collect();
        self.boxes("detections.boxes", &boxes, Tolerance::Absolute(0.01));
        let scores: Vec<f32> = found.scores.iter().map(|score| *score as f32).collect();
        self.compare("detections.scores", &[count], &scores, Tolerance::Absolute(1e-4));
        let classes: Vec<f32> = found.classes.iter().map(|class| *class as f32).collect();
        self.compare("detections.classes", &[count], &classes, Tolerance::Absolute(0.0));
        self.keypoints(found);
        if let Some(mask) = found.masks.first() {
            let (width, height) = (mask.width(), mask.height());
            let pixels = |mask: &Mask| -> Vec<f32> {
                (0..height).flat_map(|y| (0..width).map(move |x| f32::from(u8::from(mask.get(x, y))))).collect()
            };
            let values: Vec<f32> = found.masks.iter().flat_map(pixels).collect();
            let shape = [count, height as usize, width as usize];
            self.compare("detections.masks", &shape, &values, Tolerance::Pixels(1e-3));
        } else if let Some(expected) = self.reference.get("detections.masks") {
            let shape: Vec<usize> = [&[0], expected.shape.get(1..).unwrap_or_default()].concat();
            self.compare("detections.masks", &shape, &[], Tolerance::Pixels(1e-3));
        }
    }

    /// Compares the keypoints with the reference's `[N, K, 3]`; positions and scores have separate tolerances.
    fn keypoints(&mut self, found: &Detections) {
        let name = "detections.keypoints";
        if self.recorded.is_some() {
            let shape = [found.keypoints.len(), found.keypoints.first().map_or(0, Vec::len), 3];
            if shape[1] > 0 {
                self.compare(name, &shape, &keypoint_values(found), Tolerance::Absolute(0.0));
            }
            return;
        }
        let Some(expected) = self.reference.get(name) else {
            return;
        };
        let column = |values: &[f32], columns: std::ops::Range<usize>| -> Vec<f32> {
            values.chunks_exact(3).flat_map(|row| row[columns.clone()].to_vec()).collect()
        };
        let values = keypoint_values(found);
        let shape = [
            found.keypoints.len(),
            found.keypoints.first().map_or(expected.shape.get(1).copied().unwrap_or(0), Vec::len),
            3,
        ];
        let parts = [("places", 0..2, Tolerance::Absolute(0.05)), ("scores", 2..3, Tolerance::Relative(1e-4))];
        for (part, columns, tolerance) in parts {
            let wanted =
                WeightTensor { shape: expected.shape.clone(), values: column(&expected.values, columns.clone()) };
            let name = format!("detections.keypoints.{part}");
            let reference = StateDict::from([(name.clone(), wanted)]);
            let mut comparer = Comparer::new(&reference);
            comparer.compare(&name, &shape, &column(&values, columns), tolerance);
            self.stages.append(&mut comparer.stages);
        }
    }

    fn training(&mut self, detector: &GeneralizedRcnn, image: &TransformedImage) -> Result<()> {
        let target = self.target(detector.config())?;
        let losses = detector.losses_of_resized(std::slice::from_ref(image), &[target], 0);
        for (name, value) in losses.values() {
            let name = format!("losses.loss_{name}");
            self.compare(&name, &[1], &[value as f32], Tolerance::Relative(1e-4));
        }
        let mut visitor = GradientVisitor {
            path: Vec::new(),
            gradients: &losses.total().backward(),
            wanted: self.recorded.is_none().then_some(self.reference),
            found: StateDict::new(),
        };
        detector.visit(&mut visitor);
        let found = visitor.found;
        if let Some(recorded) = &mut self.recorded {
            recorded.extend(found);
            return Ok(());
        }
        let gradients = self.reference.iter().filter(|(name, _)| name.starts_with("gradients."));
        let sizes: Vec<(&String, f32)> = gradients.map(|(name, gradient)| (name, largest(&gradient.values))).collect();
        let noise = NOISE_OF_GRADIENTS * sizes.iter().map(|(_, size)| *size).fold(0.0, f32::max);
        for (name, size) in sizes {
            let (shape, values) = found.get(name).map_or((&[][..], &[][..]), |g| (&g.shape, &g.values));
            let tolerance =
                if size < noise { Tolerance::Absolute(f64::from(noise)) } else { Tolerance::Relative(1e-3) };
            self.compare(name, shape, values, tolerance);
        }
        Ok(())
    }

    /// Masks of `count` objects from `targets.masks`, as large as the resized image, or else from `targets.polygons`.
    fn target_masks(&self, count: usize) -> Result<Vec<ObjectMask>> {
        let named = |name| self.reference.get(name).filter(|tensor| tensor.shape.first() == Some(&count));
        if let Some(WeightTensor { shape, values }) = named("targets.masks")
            && let [_, height, width] = shape[..]
        {
            let bitmap = |pixels: &[f32]| {
                Mask::from_fn(width as u32, height as u32, |x, y| pixels[y as usize * width + x as usize] >= 0.5)
            };
            return Ok(values.chunks_exact((height * width).max(1)).map(|pixels| bitmap(pixels).into()).collect());
        }
        let Some(WeightTensor { values, .. }) = named("targets.polygons") else {
            return Err(DetectionError::Target {
                image_idx: 0,
                field: "targets.polygons",
                expected: format!("polygons or targets.masks of {count} objects"),
                found: "neither".to_owned(),
            });
        };
        let vertex = |xy: &[f32]| [f64::from(xy[0]), f64::from(xy[1])].into();
        let polygon = |row: &[f32]| Polygon { vertices: row.chunks_exact(2).map(vertex).collect() };
        Ok(values.chunks_exact((values.len() / count.max(1)).max(1)).map(|row| polygon(row).into()).collect())
    }

    /// The objects with which the reference was trained for one step.
    fn target(&self, config: &RcnnConfig) -> Result<ResizedTarget> {
        let get = |name: &'static str, columns: usize| -> Result<&[f32]> {
            let found = self.reference.get(name);
            match found {
                Some(tensor) if columns > 0 && tensor.values.len().is_multiple_of(columns) => Ok(&tensor.values),
                _ => Err(DetectionError::Target {
                    image_idx: 0,
                    field: name,
                    expected: format!("a tensor with rows of {columns}"),
                    found: found.map_or("none".to_owned(), |tensor| format!("shape {:?}", tensor.shape)),
                }),
            }
        };
        let boxes: Vec<Corners> = get("targets.boxes", 4)?.as_chunks::<4>().0.to_vec();
        let count = boxes.len();
        let mut target = ResizedTarget {
            boxes,
            labels: get("targets.classes", 1)?.iter().map(|class| *class as usize).collect(),
            ..Default::default()
        };
        if let Some(head) = &config.roi_heads.keypoint_head {
            let keypoint = |row: &[f32]| Keypoint {
                x: f64::from(row[0]),
                y: f64::from(row[1]),
                visibility: if row[2] > 0.0 { Visibility::Visible } else { Visibility::Unlabelled },
            };
            let rows = get("targets.keypoints", 3 * head.num_keypoints)?.chunks_exact(3 * head.num_keypoints);
            target.keypoints = rows.map(|row| row.chunks_exact(3).map(keypoint).collect()).collect();
        }
        if config.roi_heads.mask_head.is_some() {
            target.masks = self.target_masks(count)?;
        }
        let broken = |field, found: usize| DetectionError::Target {
            image_idx: 0,
            field,
            expected: format!("{count}, one per box"),
            found: found.to_string(),
        };
        let heads = &config.roi_heads;
        match () {
            () if target.labels.len() != count => Err(broken("targets.classes", target.labels.len())),
            () if target.labels.iter().any(|label| *label >= heads.num_classes) => Err(DetectionError::Target {
                image_idx: 0,
                field: "targets.classes",
                expected: format!("classes below {}", heads.num_classes),
                found: format!("{:?}", target.labels),
            }),
            () if heads.keypoint_head.is_some() && target.keypoints.len() != count => {
                Err(broken("targets.keypoints", target.keypoints.len()))
            }
            () if heads.mask_head.is_some() && target.masks.len() != count => {
                Err(broken("targets.masks or targets.polygons", target.masks.len()))
            }
            () => Ok(target),
        }
    }
}

/// The largest magnitude of the values.
fn largest(values: &[f32]) -> f32 {
    values.iter().fold(0.0, |most, value| most.max(value.abs()))
}

fn keypoint_values(found: &Detections) -> Vec<f32> {
    found.keypoints.iter().flatten().flat_map(|k| [k.x as f32, k.y as f32, k.score as f32]).collect()
}

/// Collects the network's gradients: those named in `wanted`, or all gradients if `wanted` is `None`.
struct GradientVisitor<'a> {
    path: Vec<String>,
    gradients: &'a Gradients,
    wanted: Option<&'a StateDict>,
    found: StateDict,
}

impl ModuleVisitor for GradientVisitor<'_> {
    fn enter_module(&mut self, name: &str, _container_type: &str) {
        self.path.push(name.to_owned());
    }

    fn exit_module(&mut self, _name: &str, _container_type: &str) {
        self.path.pop();
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let name = format!("gradients.{}", self.path.join("."));
        if self.wanted.is_some_and(|wanted| !wanted.contains_key(&name)) {
            return;
        }
        if let Some(gradient) = param.val().grad(self.gradients) {
            let shape = gradient.dims().to_vec();
            self.found.insert(name, WeightTensor { shape, values: host_values(gradient) });
        }
    }
}
