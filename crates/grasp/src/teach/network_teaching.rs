//! The settings for teaching a model with a network: detector, conversion to poses, samples, steps.

use sdg_demonstration::{AugmentationConfig, AugmentationStyle};
use sdg_training::TrainingConfig;

use super::detector_teaching::DetectorTeaching;
use super::fine_tuning::FineTuning;
use super::options::TeachOptions;
use super::paper;
use super::preset::{OrientationTeaching, Preset};
use crate::base_weights::BaseWeights;
use crate::facts::ModelKind;

/// Minimum fraction of the held-out samples with the part in which a useful network finds the part. Chosen by hand, not
/// measured.
const MIN_HIT_RATE: f64 = 0.5;

/// All settings for teaching a model with a network, except the demonstrations and the initial weights.
#[derive(Debug, Clone)]
pub(crate) struct NetworkTeaching {
    /// The detector.
    pub(crate) detector: DetectorTeaching,
    /// The conversion of detections to poses, and the training that it needs.
    pub(crate) reading: ReadingTeaching,
    /// The detector's training.
    pub(crate) training: TrainingConfig,
    /// The training samples.
    pub(crate) samples: AugmentationConfig,
    /// Number of samples before they repeat; `None` for unlimited new samples.
    pub(crate) distinct_samples: Option<u64>,
    /// The samples for validation and calibration.
    pub(crate) held_back: AugmentationConfig,
    /// Minimum fraction of the held-out samples with the part in which the network must find the part.
    pub(crate) min_hit_rate: f64,
    /// Number of generated parts shown during teaching, beside the part and in its place.
    pub(crate) num_other_parts: usize,
}

/// The conversion of detections to poses of the demonstration.
#[derive(Debug, Clone)]
pub(crate) enum ReadingTeaching {
    /// Model A, which has a second network.
    BoxAndCrop(Box<OrientationTeaching>),
    /// Model B.
    BoxAndKeypoints,
    /// Model C.
    Keypoints,
    /// Model D.
    Mask,
}

impl NetworkTeaching {
    /// The settings for options with initial weights already read, and for a first photo of this width and height;
    /// `None` for model S, which has no network.
    pub(crate) fn new(options: &TeachOptions, photo: [u32; 2]) -> Option<Self> {
        let &TeachOptions { kind, preset, seed, symmetry, .. } = options;
        let reading = match kind {
            ModelKind::A => ReadingTeaching::BoxAndCrop(Box::new(preset.orientation(symmetry, seed))),
            ModelKind::B => ReadingTeaching::BoxAndKeypoints,
            ModelKind::C => ReadingTeaching::Keypoints,
            ModelKind::D => ReadingTeaching::Mask,
            ModelKind::S => return None,
        };
        let weights = options.start.weights();
        let mut teaching = Self {
            detector: preset.detector(kind, weights.is_some())?,
            reading,
            training: preset.training(kind, seed),
            samples: preset.samples(photo),
            distinct_samples: (preset == Preset::Paper).then_some(paper::DISTINCT_SAMPLES),
            held_back: match preset {
                Preset::Paper => AugmentationConfig::paper(),
                // Samples of the photo's size, so that verification is calibrated at the same resolution. Those of a
                // large photo are smaller, as is the resolution at which a long part is compared.
                _ => AugmentationConfig::default(),
            },
            min_hit_rate: MIN_HIT_RATE,
            num_other_parts: 0,
        };
        let of_our_weights = || weights.is_some_and(BaseWeights::is_ours).then(|| FineTuning::new(seed));
        if let Some(fine_tuning) = options.fine_tuning.clone().or_else(of_our_weights) {
            teaching.fine_tune(fine_tuning);
        }
        if let Some(steps) = options.steps {
            teaching.set_steps(steps);
        }
        Some(teaching)
    }

    fn fine_tune(&mut self, fine_tuning: FineTuning) {
        let FineTuning { training, freeze, num_other_parts, positive_share, hard_negative_share } = fine_tuning;
        self.training = training;
        self.detector.network.backbone.freeze = freeze;
        self.detector.network.roi_heads.hard_negative_share = hard_negative_share;
        self.num_other_parts = num_other_parts;
        if let AugmentationStyle::Scenes(style) = &mut self.samples.style {
            style.positive_share = positive_share;
        }
    }

    /// Sets the number of detector steps; the number for the orientation CNN changes in proportion.
    fn set_steps(&mut self, steps: usize) {
        if let ReadingTeaching::BoxAndCrop(orientation) = &mut self.reading {
            let training = &mut orientation.training;
            training.steps = (training.steps * steps).div_ceil(self.training.steps);
        }
        self.training.steps = steps;
        self.training.validation.first = self.training.validation.first.min(steps);
    }
}

#[cfg(test)]
mod tests {
    use sdg_detection::image_transform::resized_size;

    use super::*;

    #[test]
    fn samples_show_the_part_at_the_scale_of_detection() {
        // Sizes are rounded to whole pixels.
        const TOLERANCE: f64 = 0.01;
        for preset in Preset::ALL {
            let options = TeachOptions { preset, ..TeachOptions::new(1) };
            for photo in [[640, 480], [4032, 3024], [1920, 1080], [480, 640], [480, 480], [3000, 500]] {
                let teaching = NetworkTeaching::new(&options, photo).unwrap();
                let sample = teaching.samples.output_size.unwrap();
                let rule = teaching.detector.network.input.resize;
                let resized = |[width, height]: [u32; 2]| resized_size(rule, width, height).0 as f64 / f64::from(width);
                let fitted = |axis: usize| f64::from(sample[axis]) / f64::from(photo[axis]);
                let ratio = fitted(0).min(fitted(1)) * resized(sample) / resized(photo);
                assert!((ratio - 1.0).abs() < TOLERANCE, "{} {photo:?}: {ratio}", preset.name());
                if preset != Preset::Edge && 3 * photo[0] == 4 * photo[1] {
                    assert_eq!(sample, [640, 480], "{} {photo:?}", preset.name());
                }
            }
        }
    }
}
