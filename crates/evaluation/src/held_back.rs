//! Tests a finished model on held-out samples, which are used neither for teaching nor for calibration. Results are
//! counted as by `sdg evaluate --pictures`.

use std::ops::RangeInclusive;

use anyhow::{Context, Result};
use rayon::prelude::*;
use sdg_cell::Perception;
use sdg_demonstration::{
    AugmentationConfig, AugmentationStyle, Augmenter, Demonstration, LabelledInstance, Sample, SceneStyle, sample_size,
};
use sdg_grasp::{GraspModel, TurnedGrasp, Verification, turned_grasps, without_unmarked_parts};
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

/// The held-out samples of a teaching run.
pub struct HeldBackSamples(Augmenter);

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
        let config = AugmentationConfig { style: AugmentationStyle::Scenes(style), ..AugmentationConfig::default() };
        let config = config.with_output_size(width, height);
        Ok(Self(Augmenter::new(demonstrations, config, seed)?))
    }

    /// The sample with this index.
    pub fn sample(&self, number: u64) -> Sample {
        self.0.held_out(FIRST + number)
    }
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
        let photo_px = f64::from(demonstrations[0].image.width()) / f64::from(samples.0.output_size()[0]);
        let judged = (0..COUNT).into_par_iter().map(|number| {
            let sample = samples.sample(number);
            let found = detector.detect(&sample.image, Verification::ByShape)?;
            let detections = found.into_iter().map(|found| found.detection).collect();
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
    use super::*;
    use image::RgbImage;
    use sdg_demonstration::Annotation;
    use sdg_geometry::{BoundingBox, GraspLine};

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
        assert_eq!(samples.0.output_size(), [8192, 27]);
    }
}
