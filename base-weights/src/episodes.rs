//! Episodes: part after part is taught for a few steps, and the weights move towards what came of it.
//!
//! ```text
//! weights ─ a part's photo ─ the very steps of teaching (windows of composed samples, then rendered frames) ─ taught
//!    └────────────────── + step_size · (taught - weights) ←──────────────────────────────────────────────────────┘
//! ```
//!
//! # Source
//! Nichol, Achiam and Schulman, On First-Order Meta-Learning Algorithms (2018): Reptile with one task a step.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, bail};
use burn::tensor::Device;
use sdg_demonstration::{AugmentationConfig, Augmenter, Demonstration, Sample, SampleObject};
use sdg_detection::config::RcnnConfig;
use sdg_detection::state_dict::{self, StateDict};
use sdg_geometry::{Keypoint, RotationalSymmetry, Visibility};
use sdg_grasp::{BaseWeightsFile, NUM_KEYPOINTS};
use sdg_part_generator::{Instance, Part, PhotoConfig, SceneConfig, Scenes, demonstration};
use sdg_training::{AdamWState, OneCycle, SampleSource, TrainingConfig, ValidationConfig, WindowPhase, train};
use serde::{Deserialize, Serialize};

use crate::checkpoint::Checkpoint;
use crate::network::pretrain_config;
use crate::pictures::FIRST_PART_SEED;

/// What decides a run of episodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EpisodeSettings {
    /// Decides parts, pictures and every random choice.
    pub seed: u64,
    /// Episodes of the whole run.
    pub episodes: usize,
    /// Steps of teaching in an episode.
    pub steps: usize,
    /// Share of the way to the taught weights that the first episode moves; the last moves none, in a straight line.
    pub step_size: f64,
    /// Other parts that lie about.
    pub num_other_parts: usize,
    /// SHA-256 of the base weights that the run started from; `None` where it started from nothing.
    pub start_sha256: Option<String>,
}

impl EpisodeSettings {
    /// Episodes as long as the shortest teaching.
    pub fn new(seed: u64, episodes: usize) -> Self {
        Self { seed, episodes, steps: 15, step_size: 0.5, num_other_parts: 48, start_sha256: None }
    }

    fn training(&self, seed: u64) -> TrainingConfig {
        TrainingConfig {
            steps: self.steps,
            windows: Some(WindowPhase { share: 0.6, batch_size: 12 }),
            schedule: OneCycle { peak: 1e-3, warm_up: 0.2 },
            // Nobody asks how good an episode's network is.
            validation: ValidationConfig { every: self.steps + 1, first: self.steps + 1, samples: 1 },
            early_stop: None,
            ..TrainingConfig::edge(seed)
        }
    }
}

/// A run of episodes and where it is.
#[derive(Debug, Clone)]
pub struct Episodes {
    settings: EpisodeSettings,
    config: RcnnConfig,
    device: Device,
    others: Vec<Demonstration>,
    weights: StateDict,
    episode: usize,
}

impl Episodes {
    /// Starts from base weights, or goes on from the weights after so many episodes. Parameters that the weights draw anew
    /// are drawn once and learnt from then on.
    ///
    /// # Errors
    /// Weights of another network.
    pub fn start(settings: EpisodeSettings, weights: &StateDict, episode: usize, device: &Device) -> Result<Self> {
        let config = pretrain_config();
        let (network, report) = state_dict::import(config.init(device, settings.seed)?, weights);
        if !report.mismatched.is_empty() || !report.unused.is_empty() {
            bail!("expected weights of preset edge, found {:?} and {:?}", report.mismatched, report.unused);
        }
        let photo = PhotoConfig { fill: [0.4, 0.6], ..PhotoConfig::default() };
        let first = FIRST_PART_SEED.wrapping_mul(2).wrapping_add(settings.seed.wrapping_mul(1_000_000));
        let others = (0..settings.num_other_parts as u64)
            .map(|i| demonstration(&Part::generate(first.wrapping_add(900_000 + i)), &photo, 0))
            .collect();
        Ok(Self { config, device: device.clone(), others, weights: state_dict::export(&network), episode, settings })
    }

    /// Episodes done.
    pub fn episode(&self) -> usize {
        self.episode
    }

    /// Whether all episodes are done.
    pub fn is_over(&self) -> bool {
        self.episode >= self.settings.episodes
    }

    /// Teaches the next part and moves towards what came of it; gives the loss of the last step.
    ///
    /// # Errors
    /// A part that cannot be taught.
    pub fn advance(&mut self) -> Result<f64> {
        let seed = self.settings.seed.wrapping_mul(1_000_003).wrapping_add(self.episode as u64);
        let task = Task::draw(&self.settings, seed, &self.others)?;
        let network = self.config.init(&self.device.clone().autodiff(), seed)?;
        let (network, _) = state_dict::import(network, &self.weights);
        let trained = train(
            network,
            &self.settings.training(seed),
            SampleSource { frames: &|i| task.frame(i), windows: &|i| task.windows().sample(i) },
            &mut |_| Ok(Vec::new()),
            &mut |_| std::ops::ControlFlow::Continue(()),
        )?;
        let left = 1.0 - self.episode as f64 / self.settings.episodes as f64;
        let step_size = (self.settings.step_size * left) as f32;
        let taught = state_dict::export(&trained.detector);
        for (name, tensor) in &mut self.weights {
            let taught = taught.get(name).with_context(|| format!("expected {name} in the taught network"))?;
            tensor
                .values
                .iter_mut()
                .zip(&taught.values)
                .for_each(|(value, taught)| *value += step_size * (taught - *value));
        }
        self.episode += 1;
        trained.history.steps.last().map(|step| step.losses.total()).context("an episode has steps")
    }

    /// What a later run goes on from.
    pub fn checkpoint(&self) -> Checkpoint<EpisodeSettings> {
        Checkpoint {
            settings: self.settings.clone(),
            step: self.episode,
            parameters: self.weights.clone(),
            optimizer: AdamWState::default(),
        }
    }

    /// What teaching starts from: everything, since the last layers were learnt as a start, too.
    pub fn export(&self, commit: &str) -> BaseWeightsFile {
        let EpisodeSettings { seed, steps, .. } = self.settings;
        let origin = BTreeMap::from([
            ("commit".to_owned(), commit.to_owned()),
            ("seed".to_owned(), seed.to_string()),
            ("episodes".to_owned(), self.episode.to_string()),
            ("steps".to_owned(), (self.episode * steps).to_string()),
            ("parts".to_owned(), self.episode.to_string()),
            ("licence".to_owned(), "MIT OR Apache-2.0".to_owned()),
        ]);
        BaseWeightsFile {
            preset: "edge".into(),
            reinitialized: BTreeSet::new(),
            parameters: self.weights.clone(),
            origin,
        }
    }
}

/// A part to teach: composed samples of its photo, and rendered scenes, which composed ones stand for later.
struct Task {
    augmenter: Augmenter,
    scenes: Scenes,
}

impl Task {
    /// Draws a part without a symmetry, whose turn can always be told.
    fn draw(settings: &EpisodeSettings, seed: u64, others: &[Demonstration]) -> Result<Self> {
        let first = FIRST_PART_SEED.wrapping_mul(3).wrapping_add(seed.wrapping_mul(64));
        let part = (0..64)
            .map(|i| Part::generate(first.wrapping_add(i)))
            .find(|part| part.symmetry() == RotationalSymmetry::None)
            .context("expected a part without symmetry among 64, found none")?;
        let config = SceneConfig {
            photo: PhotoConfig { fill: [0.13, 0.45], ..PhotoConfig::default() },
            instances: [1, 2],
            others: [1, 5],
            look_alike_share: 0.3,
            num_other_parts: 4,
            distance: [0.85, 1.18],
            tilt_rad: [0.0, 0.2],
            cover_probability: 0.1,
            min_inside_share: 0.8,
            ..SceneConfig::default()
        };
        let scenes = Scenes::new(std::slice::from_ref(&part), config, seed)?;
        let photo = scenes.photo(0).demonstration.clone();
        let samples = AugmentationConfig::default().with_output_size(320, 240);
        // A dozen other parts at a time: each has to be prepared.
        let start = (seed as usize * 12) % others.len().max(1);
        let about: Vec<Demonstration> = others.iter().cycle().skip(start).take(others.len().min(12)).cloned().collect();
        let augmenter = Augmenter::new(&[photo], samples, settings.seed ^ seed)?.with_other_parts(&about)?;
        Ok(Self { augmenter, scenes })
    }

    fn windows(&self) -> sdg_demonstration::Windows<'_> {
        self.augmenter.windows(32)
    }

    /// Every second frame is rendered.
    fn frame(&self, index: u64) -> Sample {
        if index.is_multiple_of(2) {
            return self.augmenter.sample(index);
        }
        let sample = self.scenes.sample(index);
        let (width, height) = (f64::from(sample.image.width()), f64::from(sample.image.height()));
        let objects = sample.instances.iter().filter_map(|instance| object(instance, [width, height])).collect();
        Sample { image: sample.image, objects }
    }
}

/// The truth about an instance as composed samples have it; none for what is hardly visible.
fn object(instance: &Instance, [width, height]: [f64; 2]) -> Option<SampleObject> {
    let bbox = instance.bbox.clip(width, height);
    if instance.visible_share < 0.3 || bbox.width() < 4.0 || bbox.height() < 4.0 {
        return None;
    }
    let keypoint = |keypoint: Keypoint| match bbox.contains(&keypoint.point()) {
        true => keypoint,
        false => Keypoint { visibility: Visibility::Unlabelled, ..keypoint },
    };
    Some(SampleObject {
        keypoints: instance.grasp.keypoints(NUM_KEYPOINTS).into_iter().map(keypoint).collect(),
        outline: instance.outline(),
        image_from_demonstration: instance.image_from_demonstration,
        demonstration_idx: 0,
        bbox,
    })
}
