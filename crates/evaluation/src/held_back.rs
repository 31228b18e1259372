//! Tests a finished model on held-out samples, which are used neither for teaching nor for calibration. Results are
//! counted as by `sdg evaluate --pictures`.

use std::ops::RangeInclusive;

use anyhow::{Context, Result};
use rayon::prelude::*;
use sdg_cell::Perception;
use sdg_demonstration::{
    AugmentationConfig, AugmentationStyle, Augmenter, Demonstration, LabelledInstance, Sample, SceneStyle, sample_size,
};
use sdg_grasp::{GraspDetection, GraspModel, TurnedGrasp, Verification, turned_grasps, without_unmarked_parts};
use serde_json::{Value, json};

use crate::labelled_pictures::{DEFAULT_MIN_SCORE, Errors, Instance, LabelledPicture, Tested, Totals, Truth, judge};
use crate::statistics::{Share, wilson_interval};

/// Index of the first held-out sample, far beyond the samples for validation and calibration.
const FIRST: u64 = 1 << 40;
/// Number of samples, three quarters of which contain the part. Chosen to save time: a sample takes 0.15 s on one core.
const COUNT: u64 = 24;
/// Maximum number of pixels of a sample: that of the pictures in the paper that this project implements. Larger samples
/// take longer.
const MAX_PIXELS: f64 = 640.0 * 480.0;
/// Minimum length of the part at its smallest size in a sample, unless it is shorter in its photo. In samples in which
/// key, pliers and rod end were 54 to 60 px long at their smallest size, model S found 16 to 18 of 19 parts; with 45 px
/// it found 12 to 16, with 22 px 4 to 10.
const MIN_PART_PX: f64 = 55.0;

/// The held-out samples of a teaching run. If the part would be too small in samples of the photo's size, they are made
/// from the photo's surroundings of the part.
pub struct HeldBackSamples {
    augmenter: Augmenter,
    /// Width and height of the whole first photo at the scale of the samples.
    whole: [u32; 2],
    /// Pixels of the first photo per pixel of a sample.
    photo_px: f64,
}

impl HeldBackSamples {
    /// Creates samples from photos and a seed, with the part's size within `sizes`, and with a limited picture size.
    ///
    /// # Errors
    /// No samples can be made from the photos.
    pub fn new(demonstrations: &[Demonstration], sizes: &RangeInclusive<f64>, seed: u64) -> Result<Self> {
        let mut style = SceneStyle::default();
        style.scale = [style.scale[0].max(*sizes.start() as f32), style.scale[1].min(*sizes.end() as f32)];
        let photo = demonstrations.first().context("expected a demonstration, found none")?.image.dimensions();
        let [width, height] = sample_size(photo.into(), MAX_PIXELS);
        let cropped = surroundings(demonstrations, [width, height], style.scale[0].into());
        let demonstrations = cropped.as_deref().unwrap_or(demonstrations);
        let shown_width = f64::from(demonstrations[0].image.width());
        let whole = [width, height].map(|side| (f64::from(side) * f64::from(photo.0) / shown_width).round() as u32);
        let config = AugmentationConfig { style: AugmentationStyle::Scenes(style), ..AugmentationConfig::default() };
        let augmenter = Augmenter::new(demonstrations, config.with_output_size(width, height), seed)?;
        Ok(Self { augmenter, whole, photo_px: shown_width / f64::from(width) })
    }

    /// The sample with this index.
    pub fn sample(&self, number: u64) -> Sample {
        self.augmenter.held_out(FIRST + number)
    }

    /// The detections of a model without a region in a sample, with the sizes of parts in the whole photo.
    ///
    /// # Errors
    /// Detection fails.
    pub fn detect(&self, model: &GraspModel, sample: &Sample) -> Result<Vec<GraspDetection>> {
        Ok(model.detect_in_middle(&sample.image, self.whole, Verification::ByShape)?)
    }
}

/// The photos, cropped about their parts as far as a part would otherwise be shorter than [`MIN_PART_PX`] in a sample
/// of this width and height at the `smallest` size; `None` if none would.
fn surroundings(demonstrations: &[Demonstration], size: [u32; 2], smallest: f64) -> Option<Vec<Demonstration>> {
    let [width, height] = size.map(f64::from);
    // Pixels of a sample per pixel of a whole photo.
    let scale =
        |one: &Demonstration| (width / f64::from(one.image.width())).min(height / f64::from(one.image.height()));
    let enlargement = |one: &Demonstration| {
        let part = &one.annotation.bbox;
        (MIN_PART_PX / (smallest * part.width().max(part.height()))).min(1.0) / scale(one)
    };
    // The same for all photos, because photos from one distance must keep their ratio of sizes.
    let enlargement = demonstrations.iter().map(enlargement).fold(1.0, f64::max);
    let cropped = |one: &Demonstration| {
        let marks = one.annotation.extent();
        // With room for the part at any angle, and not enlarged beyond the photo's own pixels.
        let room = 2.0 * marks.width().max(marks.height()) / width.min(height);
        let photo_px = (1.0 / (enlargement * scale(one))).max(1.0).max(room);
        one.cropped(size.map(|side| (f64::from(side) * photo_px).ceil() as u32))
    };
    (enlargement > 1.0).then(|| demonstrations.iter().map(cropped).collect())
}

/// The labels of the objects in a sample.
pub fn labels_of(sample: &Sample, label: &str) -> Vec<LabelledInstance> {
    // A part whose grasp is outside the picture is optional.
    let annotations = sample.objects.iter().map(|object| object.annotation(label, &sample.image));
    annotations.map(|annotation| LabelledInstance::new(annotation.clone(), annotation.grasp.is_none())).collect()
}

/// As [`HeldBackFigures::failure`], for these numbers of found parts and of samples without the part in which a
/// detection was accepted.
pub(crate) fn failure_of(found: Share, false_alarms: Share) -> Option<String> {
    let reason = if 2 * found.count < found.of {
        format!("it finds {} of {} parts", found.count, found.of)
    } else if 2 * false_alarms.count > false_alarms.of {
        format!("it accepts a detection in {} of {} without the part", false_alarms.count, false_alarms.of)
    } else {
        return None;
    };
    Some(format!("the model fails on its own held-out samples: {reason}; check that the marks are on the part"))
}

/// Results of a model on its held-out samples.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldBackFigures {
    samples: u64,
    /// Totals; distances are in pixels of the samples.
    totals: Totals,
    /// Pixels of the photo per pixel of a sample.
    photo_px: f64,
    /// Number of unmarked parts that were detected in the photos and removed from the samples.
    others_in_photo: usize,
    /// Photos whose grasp points in another direction than that of the first photo.
    turned: Vec<TurnedGrasp>,
}

impl HeldBackFigures {
    /// Tests a model, as read from its file, on samples of the photos from which it was taught.
    ///
    /// # Errors
    /// Samples cannot be made, or detection fails.
    pub fn of(model: &GraspModel, demonstrations: &[Demonstration], seed: u64) -> Result<Self> {
        // The part may be anywhere in a sample.
        let detector = Perception::of_any_camera(model.clone().with_region(None)?);
        let model = detector.model();
        let facts = model.facts();
        let (alone, others_in_photo) = without_unmarked_parts(model, demonstrations)?;
        let samples = HeldBackSamples::new(&alone, &model.held_out_sizes(), seed)?;
        let photo_px = samples.photo_px;
        let judged = (0..COUNT).into_par_iter().map(|number| {
            let sample = samples.sample(number);
            let detections = samples.detect(model, &sample)?;
            let of_label = |labelled: LabelledInstance| {
                let LabelledInstance { annotation, optional, .. } = labelled;
                Instance { bbox: annotation.bbox, grasp: annotation.grasp, optional, extent: None }
            };
            let instances: Vec<Instance> = labels_of(&sample, model.object()).into_iter().map(of_label).collect();
            // The demonstrations of a model that knows lengths are plan views, whose pixel size is uniform.
            let metres_per_pixel = facts.lengths.as_ref().map(|lengths| photo_px / lengths.pixels_per_m);
            let truth = |instance: &Instance| {
                let mut truth = Truth::new(instance, &detector);
                if let Some(grasp) = &mut truth.grasp {
                    grasp.pixel_m = metres_per_pixel;
                }
                truth
            };
            let truths = instances.iter().map(truth).collect();
            let picture = LabelledPicture {
                path: format!("sample {number}").into(),
                labels: "augmentation".into(),
                size: sample.image.dimensions().into(),
                instances,
                kind: None,
            };
            let tested = Tested { picture, truths, detections, seconds: 0.0 };
            Ok(judge(&tested, DEFAULT_MIN_SCORE))
        });
        let judged = judged.collect::<Result<Vec<_>>>()?;
        let turned = turned_grasps(model, demonstrations)?;
        Ok(Self { samples: COUNT, totals: Totals::of(&judged), photo_px, others_in_photo, turned })
    }

    /// The reason why the model is unusable: it finds fewer than half of the parts, or accepts a detection in more than
    /// half of the samples without the part. `None` if it is usable.
    pub fn failure(&self) -> Option<String> {
        failure_of(self.found(), self.false_alarms())
    }

    /// Fraction of the parts that were found.
    pub fn found(&self) -> Share {
        self.totals.found
    }

    /// Number of wrong detections in samples with the part.
    pub fn wrong(&self) -> usize {
        self.totals.wrong
    }

    /// Fraction of the samples without the part in which a detection was accepted.
    pub fn false_alarms(&self) -> Share {
        self.totals.false_alarms
    }

    /// Median errors of found parts: distance in pixels of the photo, and angle in degrees.
    pub fn median_errors(&self) -> Option<[f64; 2]> {
        self.errors().map(|errors| [errors.median_px, errors.median_deg])
    }

    /// The errors of found parts, with distances in pixels of the photo.
    fn errors(&self) -> Option<Errors> {
        let in_photo = |errors: Errors| Errors {
            median_px: self.photo_px * errors.median_px,
            p95_px: self.photo_px * errors.p95_px,
            ..errors
        };
        self.totals.errors.map(in_photo)
    }

    /// The median distance with its unit: millimetres if the model knows lengths.
    pub fn median_distance(&self) -> Option<(f64, &'static str)> {
        let millimetres = self.totals.errors?.median_mm.map(|mm| (mm, "mm"));
        millimetres.or(self.median_errors().map(|[px, _]| (px, "px")))
    }

    /// Number of unmarked parts that were detected in the photos and removed from the samples.
    pub fn others_in_photo(&self) -> usize {
        self.others_in_photo
    }

    /// Photos whose grasp points in another direction than that of the first photo.
    pub fn turned(&self) -> &[TurnedGrasp] {
        &self.turned
    }

    /// A warning for each photo whose grasp points in another direction than that of the first photo.
    pub fn warnings(&self) -> Vec<String> {
        let warning = |turned: &TurnedGrasp| {
            let TurnedGrasp { photo, turn_deg } = turned;
            format!(
                "the grasp in photo {photo} is turned by {turn_deg:.0}° against that in photo 1: unless the part looks \
                 the same in both directions, the model turns the hand at random; mark both photos in the same direction"
            )
        };
        self.turned.iter().map(warning).collect()
    }

    /// A summary on one line.
    pub fn in_words(&self) -> String {
        let interval = |share: Share| {
            let [low, high] = wilson_interval(share).map(|bound| 100.0 * bound);
            format!("95 % interval: {low:.0} to {high:.0} %")
        };
        let (found, false_alarms) = (self.found(), self.false_alarms());
        let errors = self.median_distance().zip(self.median_errors());
        let errors = errors.map(|((off, unit), [_, deg])| format!("; median {off:.1} {unit} and {deg:.1}°"));
        let others = self.others_in_photo;
        let others = (others > 0)
            .then(|| format!("; {others} further instances found in the photo were removed from the samples"));
        format!(
            "on {} held-out samples, it finds {found} parts ({}), {} wrong; false alarms in {false_alarms} without \
             the part ({}){}{}",
            self.samples,
            interval(found),
            self.wrong(),
            interval(false_alarms),
            errors.unwrap_or_default(),
            others.unwrap_or_default()
        )
    }

    /// The results as JSON: fractions as count and total, their intervals, and the errors. Distances are in pixels of
    /// the photo, in percent of the diagonal and, if the model knows lengths, in millimetres.
    pub fn to_json(&self) -> Value {
        json!({
            "samples": self.samples,
            "found": self.totals.found,
            "found_interval": wilson_interval(self.totals.found),
            "wrong": self.totals.wrong,
            "false_alarms": self.totals.false_alarms,
            "false_alarms_interval": wilson_interval(self.totals.false_alarms),
            "errors": self.errors(),
            "others_in_photo": self.others_in_photo,
            "turned_photos": self.turned.iter().map(|turned| turned.photo).collect::<Vec<_>>(),
        })
    }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use image::{Rgb, RgbImage, imageops};
    use sdg_demonstration::Annotation;
    use sdg_geometry::{BoundingBox, GraspLine, PlanarSimilarity};
    use sdg_grasp::{ModelKind, TeachOptions, teach};

    fn figures(found: usize, false_alarms: usize) -> HeldBackFigures {
        let share = |count, of| Share { count, of };
        let totals = Totals {
            found: share(found, 18),
            missed: 18 - found,
            wrong: 0,
            optional: share(0, 0),
            clean: share(found, 18),
            false_alarms: share(false_alarms, 6),
            errors: None,
        };
        HeldBackFigures { samples: COUNT, totals, photo_px: 1.0, others_in_photo: 0, turned: Vec::new() }
    }

    #[test]
    fn a_model_fails_that_finds_less_than_half_or_accepts_more_than_half_without() {
        assert_eq!(figures(9, 3).failure(), None);
        assert!(figures(8, 0).failure().unwrap().contains("finds 8 of 18 parts"));
        assert!(figures(18, 4).failure().unwrap().contains("in 4 of 6 without the part"));
    }

    #[test]
    fn errors_are_in_pixels_of_the_photo() {
        let mut figures = figures(18, 0);
        let errors = Errors {
            median_px: 1.5,
            median_mm: None,
            median_percent: 2.0,
            median_deg: 0.5,
            p95_px: 2.5,
            p95_mm: None,
            p95_percent: 3.0,
            p95_deg: 1.0,
        };
        (figures.totals.errors, figures.photo_px) = (Some(errors), 6.0);
        let printed = figures.to_json()["errors"].clone();
        assert_eq!((&printed["median_px"], &printed["p95_px"]), (&json!(9.0), &json!(15.0)));
        assert_eq!((&printed["p95_percent"], &printed["p95_deg"]), (&json!(3.0), &json!(1.0)));
        assert!(figures.in_words().contains("median 9.0 px"), "{}", figures.in_words());
    }

    #[test]
    fn a_photo_with_few_pixels_but_a_long_side_has_samples() {
        let annotation = Annotation {
            label: "part".into(),
            bbox: BoundingBox { x1: 40.0, y1: 5.0, x2: 90.0, y2: 25.0 },
            grasp: Some(GraspLine::new([50.0, 15.0].into(), [80.0, 15.0].into())),
            jaw_width: None,
            outline: None,
        };
        let demonstration = Demonstration { image: RgbImage::new(9000, 30), annotation };
        let samples = HeldBackSamples::new(&[demonstration], &(0.75..=1.35), 1).unwrap();
        assert_eq!((samples.augmenter.output_size(), samples.whole), ([8192, 27], [8192, 27]));
    }

    /// The shipped key, 65 pixels long, in a photo of a plain table of this width and height.
    fn key_on_a_table(width: u32, height: u32) -> Demonstration {
        let photo = include_bytes!("../../../datasets/demonstrations/key/image.png");
        let marks = include_bytes!("../../../datasets/demonstrations/key/annotation.json");
        let Demonstration { image: shipped, annotation } =
            Demonstration::decode(photo, marks, Some("image.png")).unwrap();
        let [left, top] = [(width - shipped.width()) / 2, (height - shipped.height()) / 2];
        let table = shipped.get_pixel(0, 0).0;
        let mut image = RgbImage::from_fn(width, height, |x, y| {
            // Noise of up to 4 grey values.
            let noise = (x.wrapping_mul(2_654_435_761) ^ y.wrapping_mul(2_246_822_519)) >> 13;
            Rgb(table.map(|value| value.saturating_add((noise % 5) as u8)))
        });
        imageops::replace(&mut image, &shipped, left.into(), top.into());
        let (dx, dy) = (f64::from(left), f64::from(top));
        let photo_from_shipped = PlanarSimilarity::translation(dx, dy);
        let BoundingBox { x1, y1, x2, y2 } = annotation.bbox;
        let annotation = Annotation {
            bbox: BoundingBox { x1: x1 + dx, y1: y1 + dy, x2: x2 + dx, y2: y2 + dy },
            grasp: annotation.grasp.map(|grasp| grasp.transformed(&photo_from_shipped)),
            outline: annotation.outline.map(|outline| outline.transformed(&photo_from_shipped)),
            ..annotation
        };
        Demonstration { image, annotation }
    }

    #[test]
    fn a_model_of_a_part_that_is_small_in_a_large_photo_is_usable() {
        let demonstrations = [key_on_a_table(4032, 3024)];
        let mut options = TeachOptions::new(1);
        options.kind = ModelKind::S;
        let model = teach(&demonstrations, &options, &mut |_| ControlFlow::Continue(())).unwrap().model;
        let figures = HeldBackFigures::of(&model, &demonstrations, 1).unwrap();
        assert_eq!(figures.failure(), None);
        assert!(figures.found().count >= 15 && figures.found().of == 19, "{}", figures.in_words());
        // The samples have the photo's own pixels.
        assert_eq!(figures.photo_px, 1.0);
        assert!(figures.median_errors().unwrap()[0] < 2.0, "{}", figures.in_words());
    }

    #[test]
    fn samples_show_the_whole_photo_if_the_part_is_large_enough_in_them() {
        let size = [640, 480];
        let mut one = key_on_a_table(1280, 960);
        // The key is 27 px long at its smallest size in a sample, and 54 px in the photo's own pixels.
        let cropped = surroundings(&[one.clone()], size, 0.83).unwrap();
        assert_eq!(cropped[0].image.dimensions(), (640, 480));
        // A part of 130 px would be 54 px long: it is cropped only so far that 55 px remain.
        let BoundingBox { x1, y1, .. } = one.annotation.bbox;
        one.annotation.bbox = BoundingBox { x1, y1, x2: x1 + 130.0, y2: y1 + 50.0 };
        let width = surroundings(&[one.clone()], size, 0.83).unwrap()[0].image.width();
        assert_eq!(width, (640.0_f64 * 0.83 * 130.0 / 55.0).ceil() as u32);
        // 55.2 px.
        one.annotation.bbox = BoundingBox { x1, y1, x2: x1 + 133.0, y2: y1 + 50.0 };
        assert!(surroundings(&[one], size, 0.83).is_none());
    }
}
