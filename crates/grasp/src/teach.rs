//! From demonstrations to a grasp model.
//!
//! ```text
//! demonstrations ─ Augmenter ─ train ─ network ─┐
//!                     │                         ├─ calibrate on held-back samples ─ GraspModel
//!                     └─ held-back samples ─────┘
//! ```

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::str::FromStr;
use std::time::{Duration, Instant};

use burn::tensor::Device;
use sdg_demonstration::{AugmentationConfig, Augmenter, Demonstration, Sample};
use sdg_detection::config::ResizeRule;
use sdg_detection::presets::{self, RcnnKind};
use sdg_detection::{GeneralizedRcnn, RcnnConfig};
use sdg_geometry::{PlanarGrasp, PlanarSimilarity};
use sdg_shape::GradientField;
use sdg_training::{
    Event, History, OneCycle, Outcome, SampleSource, TrainingConfig, TrainingError, ValidationConfig, WindowPhase,
    median, train,
};

use crate::base_weights::BaseWeights;
use crate::calibration::Calibration;
use crate::error::{GraspError, Result};
use crate::facts::{ModelKind, TeachingFacts};
use crate::model::GraspModel;
use crate::model_file::Calibrations;
use crate::reading;
use crate::taught::TaughtDemonstration;
use crate::verification::verify;

/// A network, its training and its augmentation under one name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Preset {
    /// Made for two cores: minutes from photo to grasp.
    #[default]
    Edge,
    /// Detectron2's R50-FPN, fine-tuned from imported weights.
    R50Detectron2,
    /// torchvision's R50-FPN, fine-tuned from imported weights.
    R50Torchvision,
}

impl Preset {
    /// Every preset of this version.
    pub const ALL: [Self; 3] = [Self::Edge, Self::R50Detectron2, Self::R50Torchvision];

    /// The name on the command line and in the file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Edge => "edge",
            Self::R50Detectron2 => "r50-detectron2",
            Self::R50Torchvision => "r50-torchvision",
        }
    }

    /// Whether its frozen stages are worth nothing without imported weights.
    fn needs_base_weights(self) -> bool {
        match self {
            Self::Edge => false,
            Self::R50Detectron2 | Self::R50Torchvision => true,
        }
    }

    fn network(self, kind: RcnnKind) -> RcnnConfig {
        match self {
            Self::Edge => presets::edge_of(kind),
            Self::R50Detectron2 => on_two_cores(presets::r50_detectron2(kind)),
            Self::R50Torchvision => on_two_cores(presets::r50_torchvision(kind)),
        }
    }

    /// Width and height of the training samples: the network's input, so that nothing is computed to be thrown away.
    fn sample_size(self) -> [u32; 2] {
        match self {
            Self::Edge => [320, 240],
            Self::R50Detectron2 | Self::R50Torchvision => [640, R50_SHORT_SIDE_PX],
        }
    }

    fn training(self, seed: u64) -> TrainingConfig {
        match self {
            Self::Edge => TrainingConfig::edge(seed),
            Self::R50Detectron2 | Self::R50Torchvision => fine_tuning(seed),
        }
    }
}

/// Short side of the images that an R50 is taught on and looks at.
const R50_SHORT_SIDE_PX: u32 = 480;

/// An R50 with the numerics of its weights, but for what would cost an ordinary computer minutes. Images are not enlarged
/// to 800 pixels, which adds no detail to a photo of 480. And where COCO's images show dozens of objects, a
/// demonstration's show one: fewer regions go through the heads, of which the keypoint head takes 7 GFLOP for each.
fn on_two_cores(mut config: RcnnConfig) -> RcnnConfig {
    const MOST_PROPOSALS: usize = 100;
    const MOST_DETECTIONS: usize = 5;
    const ROIS_PER_IMAGE: usize = 128;
    const MOST_KEYPOINT_OR_MASK_ROIS: usize = 2;
    if let ResizeRule::ShortSide { short_px, .. } = &mut config.input.resize {
        *short_px = R50_SHORT_SIDE_PX;
    }
    config.rpn.post_nms_top_n.test = MOST_PROPOSALS;
    config.roi_heads.sampler.batch_size_per_image = ROIS_PER_IMAGE;
    config.roi_heads.box_head.detections_per_image = MOST_DETECTIONS;
    if let Some(head) = &mut config.roi_heads.keypoint_head {
        head.max_train_rois_per_image = Some(MOST_KEYPOINT_OR_MASK_ROIS);
    }
    if let Some(head) = &mut config.roi_heads.mask_head {
        head.max_train_rois_per_image = Some(MOST_KEYPOINT_OR_MASK_ROIS);
    }
    config
}

impl FromStr for Preset {
    type Err = GraspError;

    fn from_str(text: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|preset| preset.name() == text).ok_or_else(|| GraspError::UnknownPreset {
            known: Self::ALL.map(Self::name).to_vec(),
            found: text.to_owned(),
        })
    }
}

/// A lower learning rate, so that imported weights are not forgotten, and fewer, costlier steps.
fn fine_tuning(seed: u64) -> TrainingConfig {
    TrainingConfig {
        steps: 200,
        batch_size: 2,
        windows: Some(WindowPhase { share: 0.7, batch_size: 6 }),
        schedule: OneCycle { peak: 2e-4, warm_up: 0.2 },
        validation: ValidationConfig { every: 40, first: 80, samples: 24 },
        ..TrainingConfig::edge(seed)
    }
}

/// How to teach.
#[derive(Debug, Clone)]
pub struct TeachOptions {
    /// Which model.
    pub kind: ModelKind,
    /// Which network and training.
    pub preset: Preset,
    /// Decides every random choice.
    pub seed: u64,
    /// Wall-clock time for the training.
    pub time_budget: Option<Duration>,
    /// Steps other than the preset's; for tests and trials.
    pub steps: Option<usize>,
    /// Weights to start from; `None` to start from nothing.
    pub base_weights: Option<BaseWeights>,
    /// Where to compute; without gradients.
    pub device: Device,
}

impl TeachOptions {
    /// Model C with the default preset on the default device.
    pub fn new(seed: u64) -> Self {
        Self {
            kind: ModelKind::C,
            preset: Preset::default(),
            seed,
            time_budget: None,
            steps: None,
            base_weights: None,
            device: Device::flex(),
        }
    }

    /// The network that is taught; [`Self::base_weights`] must fit it.
    pub fn network(&self) -> RcnnConfig {
        self.preset.network(RcnnKind::Keypoint { num_keypoints: crate::NUM_KEYPOINTS })
    }

    /// The network as teaching starts.
    fn initial_network(&self) -> Result<GeneralizedRcnn> {
        let network = self.network().init(&self.device.clone().autodiff(), self.seed)?;
        match &self.base_weights {
            Some(base_weights) => base_weights.apply(network),
            None if self.preset.needs_base_weights() => {
                Err(GraspError::NeedsBaseWeights { preset: self.preset.name() })
            }
            None => Ok(network),
        }
    }
}

/// A model and the run that made it.
#[derive(Debug, Clone)]
pub struct Taught {
    /// The model, ready to detect.
    pub model: GraspModel,
    /// Losses and validations.
    pub history: History,
}

/// Where the agreement's threshold may lie. Held-back samples know fewer look-alikes than a factory, and harder light
/// than most: on pictures of the simulator without the part, the demonstration looked for in the whole of each, the
/// highest agreements were 0.52 and 0.51 (92 pictures, pendulum; levers made to resemble it), 0.42 (fuel line, 20) and
/// 0.34 (rod end, 30); with the part, 0.65 and more (pendulum, 40), and 0.56 and more but for two of 40 (fuel line) and
/// two of 50 (rod end).
const AGREEMENT_THRESHOLDS: (f64, f64) = (0.545, 0.6);
/// Least share of parts that a network must find to be kept.
const LEAST_HIT_RATE: f64 = 0.5;

/// Teaches a grasp model. `observe` hears of every step and validation and may end the teaching, which then keeps the
/// best network so far, if it is any good.
///
/// # Errors
/// No demonstration, one that lacks what the model needs, or a training that led to nothing usable.
pub fn teach(
    demonstrations: &[Demonstration],
    options: &TeachOptions,
    observe: &mut dyn FnMut(&Event) -> ControlFlow<()>,
) -> Result<Taught> {
    let start = Instant::now();
    if demonstrations.is_empty() {
        return Err(GraspError::NoDemonstration);
    }
    let taught = demonstrations.iter().map(TaughtDemonstration::new).collect::<Result<Vec<_>>>()?;
    let mut training = options.preset.training(options.seed);
    training.time_budget = options.time_budget;
    training.steps = options.steps.unwrap_or(training.steps);
    training.validation.first = training.validation.first.min(training.steps);

    let network = options.initial_network()?;
    let [width, height] = options.preset.sample_size();
    let at_input_size = AugmentationConfig::default().with_output_size(width, height);
    let frames = Augmenter::new(demonstrations, at_input_size.clone(), options.seed)?;
    let windows = Augmenter::new(demonstrations, at_input_size, options.seed)?
        .with_windows(network.config().input.size_divisibility as u32);
    // Held back at the photo's own size, so that verification is calibrated on what it will see.
    let held_back = Augmenter::new(demonstrations, AugmentationConfig::default(), options.seed)?;
    let held_back: Vec<Sample> = (0..training.validation.samples as u64).map(|i| held_back.held_out(i)).collect();

    let mut model = GraspModel {
        kind: options.kind,
        preset: options.preset.name().to_owned(),
        network: network.clone(),
        demonstrations: taught,
        calibrations: Calibrations { network: Calibration::NEUTRAL, agreement: Calibration::NEUTRAL },
        facts: TeachingFacts {
            seed: options.seed,
            samples: 0,
            steps: 0,
            seconds: 0.0,
            validation_hit_rate: 0.0,
            validation_error_px: f64::INFINITY,
            validation_error_degrees: f64::INFINITY,
            base_weights_sha256: options.base_weights.as_ref().map(|base_weights| base_weights.sha256.clone()),
        },
    };
    let examined = RefCell::new(&mut model);
    let trained = train(
        network,
        &training,
        SampleSource { frames: &|i| frames.sample(i), windows: &|i| windows.sample(i) },
        &mut |detector: &GeneralizedRcnn| {
            let mut model = examined.borrow_mut();
            model.network = detector.clone();
            model.examine(&held_back)
        },
        observe,
    )?;
    let best = trained.history.best.validation;
    if best.hit_rate() < LEAST_HIT_RATE {
        return Err(GraspError::NotLearnt {
            hits: best.hits,
            positives: best.positives,
            steps: trained.history.steps.len(),
        });
    }
    model.network = trained.detector;
    let (error_px, error_degrees) = model.calibrate(&held_back)?;
    model.facts = TeachingFacts {
        samples: trained.history.steps.iter().map(|step| step.samples).sum(),
        steps: trained.history.steps.len(),
        seconds: start.elapsed().as_secs_f64(),
        validation_hit_rate: best.hit_rate(),
        validation_error_px: error_px,
        validation_error_degrees: error_degrees,
        ..model.facts
    };
    Ok(Taught { model, history: trained.history })
}

impl GraspModel {
    /// What the network alone says of held-back samples.
    fn examine(&self, held_back: &[Sample]) -> std::result::Result<Vec<Outcome>, TrainingError> {
        held_back
            .iter()
            .map(|sample| {
                let detections = self.look(&sample.image).map_err(|error| match error {
                    GraspError::Detection(error) => TrainingError::Detection(error),
                    other => panic!("looking at a sample can only fail in the network: {other}"),
                })?;
                let best = reading::candidates(self.kind, &detections, &self.demonstrations).into_iter().next();
                Ok(match (best, sample.objects.first()) {
                    (Some(candidate), Some(object)) => {
                        let scale = object.image_from_demonstration.scale;
                        Outcome::found(&candidate.grasp, &truth(object), candidate.network_score, 1.0 / scale)
                    }
                    (None, Some(_)) => Outcome::Missed,
                    (candidate, None) => Outcome::Absent { score: candidate.map_or(0.0, |c| c.network_score) },
                })
            })
            .collect()
    }

    /// Sets both calibrations from held-back samples; returns the median errors after verification, in pixels of the
    /// demonstration and degrees.
    fn calibrate(&mut self, held_back: &[Sample]) -> Result<(f64, f64)> {
        let mut scores = Scores::default();
        let (mut errors_px, mut errors_degrees) = (Vec::new(), Vec::new());
        for sample in held_back {
            let detections = self.look(&sample.image)?;
            let field = GradientField::new(&sample.image);
            let mut network_best = [0.0f64; 2];
            let mut judge = |demonstration: &TaughtDemonstration, pose: &PlanarSimilarity, agreement: f64| {
                let right = sample.objects.first().is_some_and(|object| {
                    let scale = 1.0 / object.image_from_demonstration.scale;
                    let outcome = Outcome::found(&demonstration.grasp(pose), &truth(object), 1.0, scale);
                    if let (true, Outcome::Found { error_px, error_degrees, .. }) = (outcome.is_hit(), outcome) {
                        errors_px.push(error_px);
                        errors_degrees.push(error_degrees);
                    }
                    outcome.is_hit()
                });
                scores.agreement(right).push(agreement);
                right
            };
            for candidate in reading::candidates(self.kind, &detections, &self.demonstrations) {
                let demonstration = &self.demonstrations[candidate.demonstration_idx];
                let (pose, agreement) = verify(demonstration, &candidate, &sample.image, &field);
                let best = &mut network_best[usize::from(judge(demonstration, &pose, agreement))];
                *best = best.max(candidate.network_score);
            }
            for demonstration in &self.demonstrations {
                for found in demonstration.search(&sample.image, &field) {
                    judge(demonstration, &found.image_from_demonstration, found.agreement);
                }
            }
            if network_best[1] > 0.0 {
                scores.network(true).push(network_best[1]);
            }
            if sample.objects.is_empty() {
                scores.network(false).push(network_best[0]);
            }
        }
        self.calibrations = scores.calibrations();
        Ok((median(&mut errors_px).unwrap_or(f64::INFINITY), median(&mut errors_degrees).unwrap_or(f64::INFINITY)))
    }
}

/// Raw scores of right and wrong detections.
#[derive(Default)]
struct Scores {
    /// Of the network: wrong, right.
    network: [Vec<f64>; 2],
    /// Agreements: wrong, right.
    agreement: [Vec<f64>; 2],
}

impl Scores {
    fn network(&mut self, right: bool) -> &mut Vec<f64> {
        &mut self.network[usize::from(right)]
    }

    fn agreement(&mut self, right: bool) -> &mut Vec<f64> {
        &mut self.agreement[usize::from(right)]
    }

    fn calibrations(&self) -> Calibrations {
        /// Highest raw score of a wrong detection where the held-back samples gave none.
        const NO_WRONG: f64 = 0.1;
        let fit = |[wrong, right]: &[Vec<f64>; 2]| Calibration::fit(right, wrong, NO_WRONG);
        Calibrations {
            network: fit(&self.network).unwrap_or(Calibration::NEUTRAL),
            agreement: fit(&self.agreement).unwrap_or(Calibration::NEUTRAL).with_threshold_within(AGREEMENT_THRESHOLDS),
        }
    }
}

/// The true grasp of an object in a sample; its width plays no part.
fn truth(object: &sdg_demonstration::SampleObject) -> PlanarGrasp {
    let on_line: Vec<_> = object.keypoints.iter().map(|k| sdg_geometry::Keypoint::visible(k.point())).collect();
    PlanarGrasp::from_keypoints(&on_line, 0.0).unwrap_or_else(|| panic!("a grasp line has a length"))
}
