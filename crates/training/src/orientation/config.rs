//! The settings of a run.

use std::time::Duration;

use sdg_demonstration::{AugmentationConfig, AugmentationStyle, SceneStyle};
use sdg_orientation::{Labels, OrientationError, check_setting};

use super::jitter::BoxJitter;
use crate::schedule::OneCycle;

/// How the orientation CNN is trained.
#[derive(Debug, Clone, PartialEq)]
pub struct OrientationTraining {
    /// Optimiser steps, unless the time budget ends the run earlier.
    pub steps: usize,
    /// Crops per step.
    pub batch_size: usize,
    /// Learning rate over the run.
    pub schedule: OneCycle,
    /// AdamW's decoupled weight decay.
    pub weight_decay: f64,
    /// Maximum norm of each parameter's gradient; larger gradients are scaled down.
    pub max_gradient_norm: f32,
    /// The network's target for an angle.
    pub labels: Labels,
    /// The source of crops.
    pub crops: CropStyle,
    /// Number of held-out crops of a validation.
    pub validation_crops: usize,
    /// Wall-clock time for the whole run; see [`crate::TrainingConfig::time_budget`].
    pub time_budget: Option<Duration>,
    /// Seed of the crops and their order.
    pub seed: u64,
}

/// The source of crops.
#[derive(Debug, Clone, PartialEq)]
pub struct CropStyle {
    /// The scenes. Every scene must contain the part.
    pub augmentation: AugmentationConfig,
    /// Number of crops of each scene; divides the batch size.
    pub crops_per_scene: usize,
    /// Whether windows are rotated at random. This needs an outline; without one, windows are not rotated.
    pub turned: bool,
    /// The errors of boxes.
    pub jitter: BoxJitter,
    /// Number of scenes before they repeat; `None` for unlimited new ones.
    pub distinct_scenes: Option<u64>,
}

impl OrientationTraining {
    /// The default for the `edge` network on two cores.
    pub fn edge(seed: u64) -> Self {
        let scenes = SceneStyle { positive_share: 1.0, ..SceneStyle::default() };
        let style = AugmentationStyle::Scenes(scenes);
        Self {
            steps: 240,
            batch_size: 32,
            schedule: OneCycle { peak: 2e-3, warm_up: 0.2 },
            weight_decay: 1e-4,
            max_gradient_norm: 10.0,
            labels: Labels::VonMises { sigma_classes: 4.0 },
            crops: CropStyle {
                augmentation: AugmentationConfig { output_size: Some([320, 240]), style },
                crops_per_scene: 4,
                turned: true,
                jitter: BoxJitter { position: 0.06, size: 0.12 },
                distinct_scenes: None,
            },
            validation_crops: 96,
            time_budget: None,
            seed,
        }
    }

    /// The paper's settings: 5000 crops, batch 32, 15 epochs, categorical cross-entropy on whole degrees.
    ///
    /// # Source
    /// Paper, section IV-A and Table II. It does not give the optimiser and the learning rate; they are our choice.
    pub fn paper(seed: u64) -> Self {
        const CROPS: usize = 5000;
        const EPOCHS: usize = 15;
        const BATCH_SIZE: usize = 32;
        Self {
            steps: EPOCHS * CROPS.div_ceil(BATCH_SIZE),
            batch_size: BATCH_SIZE,
            schedule: OneCycle { peak: 1e-3, warm_up: 0.1 },
            weight_decay: 0.0,
            labels: Labels::Hard,
            crops: CropStyle {
                augmentation: AugmentationConfig::paper(),
                crops_per_scene: 1,
                turned: false,
                jitter: BoxJitter::NONE,
                distinct_scenes: Some(CROPS as u64),
            },
            ..Self::edge(seed)
        }
    }

    /// Rejects invalid settings.
    pub(super) fn validate(&self) -> Result<(), OrientationError> {
        check_setting(self.steps > 0, "steps", "at least 1", self.steps)?;
        check_setting(
            self.crops.crops_per_scene > 0 && self.batch_size.is_multiple_of(self.crops.crops_per_scene),
            "crops_per_scene",
            &format!("a divisor of the batch size {}", self.batch_size),
            self.crops.crops_per_scene,
        )?;
        check_setting(self.batch_size > 0, "batch_size", "at least 1", self.batch_size)?;
        check_setting(self.validation_crops > 0, "validation_crops", "at least 1", self.validation_crops)?;
        check_setting(self.crops.distinct_scenes != Some(0), "distinct_scenes", "at least 1", 0)?;
        let OneCycle { peak, warm_up } = self.schedule;
        check_setting(peak > 0.0 && peak.is_finite(), "learning rate", "a positive number", peak)?;
        check_setting(warm_up > 0.0 && warm_up < 1.0, "warm-up", "a share between 0 and 1", warm_up)?;
        if let Labels::VonMises { sigma_classes } = self.labels {
            let usable = (0.5..=90.0).contains(&sigma_classes);
            check_setting(usable, "sigma_classes", "0.5 to 90 classes", sigma_classes)?;
        }
        if let AugmentationStyle::Scenes(scenes) = &self.crops.augmentation.style {
            let share = scenes.positive_share;
            check_setting(share == 1.0, "positive_share", "1, since every crop needs the part", share)?;
        }
        self.crops.jitter.validate()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_can_be_run_and_others_are_refused() {
        assert!(OrientationTraining::edge(1).validate().is_ok());
        let paper = OrientationTraining::paper(1);
        assert!(paper.validate().is_ok());
        assert_eq!(paper.steps, 15 * 157);

        let message = |change: fn(&mut OrientationTraining)| {
            let mut config = OrientationTraining::edge(1);
            change(&mut config);
            config.validate().unwrap_err().to_string()
        };
        assert!(message(|c| c.steps = 0).contains("steps must be at least 1, found 0"));
        assert!(message(|c| c.crops.crops_per_scene = 5).contains("a divisor of the batch size 32, found 5"));
        assert!(message(|c| c.labels = Labels::VonMises { sigma_classes: f64::NAN }).contains("sigma_classes"));
        assert!(message(|c| c.crops.augmentation = AugmentationConfig::default()).contains("positive_share must be 1"));
        assert!(message(|c| c.crops.jitter.size = 3.0).contains("jitter.size"));
    }
}
