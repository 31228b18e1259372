//! The shape of the orientation CNN and the conversion of its output to an angle, as plain data that a model file can
//! contain.

use serde::{Deserialize, Serialize};

use crate::angle_classes::AngleClasses;
use crate::error::{Result, check_setting};

/// The network, and the conversion of its output to an angle.
///
/// ```text
/// [N, 3, S, S] ─ stage: conv k×k / 2, conv 3×3 … ─ stage ─ … ─ flat ─ hidden ─ [N, K] logits
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OrientationConfig {
    /// S: side of the crop, in pixels.
    pub input_px: u32,
    /// K angle classes, and the part's symmetry.
    pub classes: AngleClasses,
    /// Side of the first convolution's kernel, odd.
    pub stem_kernel: usize,
    /// Channels of each stage; every stage halves the map.
    pub stage_channels: Vec<usize>,
    /// Number of convolutions of each stage, including the one that halves the map; one number per stage.
    pub stage_convs: Vec<usize>,
    /// Groups of the group norms; divides every stage's channels.
    pub norm_groups: usize,
    /// Width of the hidden fully connected layer.
    pub hidden: usize,
    /// How the angle is read from the logits.
    pub readout: Readout,
}

/// How the angle is read from the logits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Readout {
    /// Classes on either side of the peak that enter the circular mean; 0 for only the peak's class, as in the paper.
    pub window_classes: usize,
    /// Whether the crop is evaluated at rotations of 0°, 90°, 180° and 270° and the four results are rotated back and
    /// combined, for four times the work.
    pub quarter_turns: bool,
}

impl OrientationConfig {
    /// The default, made for two cores: 64 × 64 pixels, 0.9 million parameters.
    pub fn edge() -> Self {
        Self {
            input_px: 64,
            classes: AngleClasses { num_classes: 360, symmetry: 1 },
            stem_kernel: 5,
            stage_channels: vec![24, 48, 96, 128],
            stage_convs: vec![1, 2, 2, 2],
            norm_groups: 8,
            hidden: 192,
            readout: Readout { window_classes: 16, quarter_turns: true },
        }
    }

    /// The paper's configuration: 224 × 224 × 3 pixels in, 360 classes out, at most 8 MB in half precision (3.3
    /// million parameters); the class with the highest score is the angle.
    ///
    /// # Source
    /// Paper, sections IV-A and V. The paper does not describe the layers between input and output; they are our
    /// choice.
    pub fn paper() -> Self {
        Self {
            input_px: 224,
            classes: AngleClasses { num_classes: 360, symmetry: 1 },
            stem_kernel: 5,
            stage_channels: vec![16, 32, 64, 128, 192],
            stage_convs: vec![1, 2, 2, 2, 2],
            norm_groups: 8,
            hidden: 256,
            readout: Readout { window_classes: 0, quarter_turns: false },
        }
    }

    /// The configuration for a part that looks the same after a rotation by 360° / `symmetry`.
    pub fn with_symmetry(mut self, symmetry: usize) -> Self {
        self.classes.symmetry = symmetry;
        self
    }

    /// Side of the last stage's map.
    pub fn last_map_px(&self) -> usize {
        self.input_px as usize >> self.stage_channels.len()
    }

    /// Checks that the network can be built and its output converted.
    ///
    /// # Errors
    /// [`OrientationError::Config`](crate::OrientationError::Config) names the first invalid setting.
    pub fn validate(&self) -> Result<()> {
        let num_stages = self.stage_channels.len();
        check_setting((1..=6).contains(&num_stages), "stage_channels", "1 to 6 stages", num_stages)?;
        let halvings = 1u32 << num_stages;
        check_setting(
            self.input_px.is_multiple_of(halvings) && (16..=1024).contains(&self.input_px),
            "input_px",
            &format!("16 to 1024 and a multiple of {halvings}, so that every stage halves exactly"),
            self.input_px,
        )?;
        check_setting(
            self.stage_convs.len() == num_stages && self.stage_convs.iter().all(|count| (1..=8).contains(count)),
            "stage_convs",
            &format!("1 to 8 convolutions for each of {num_stages} stages"),
            format!("{:?}", self.stage_convs),
        )?;
        check_setting(
            self.stem_kernel % 2 == 1 && self.stem_kernel <= 11,
            "stem_kernel",
            "odd, 1 to 11",
            self.stem_kernel,
        )?;
        let channels = &self.stage_channels;
        check_setting(
            self.norm_groups > 0
                && channels.iter().all(|c| (1..=1024).contains(c) && c.is_multiple_of(self.norm_groups)),
            "norm_groups",
            &format!("a number that divides the stages' channels {channels:?}, which are 1 to 1024"),
            self.norm_groups,
        )?;
        check_setting((1..=8192).contains(&self.hidden), "hidden", "1 to 8192", self.hidden)?;
        let AngleClasses { num_classes, symmetry } = self.classes;
        check_setting((4..=3600).contains(&num_classes), "classes.num_classes", "4 to 3600", num_classes)?;
        check_setting((1..=72).contains(&symmetry), "classes.symmetry", "1 to 72 equal turns", symmetry)?;
        check_setting(
            !self.readout.quarter_turns || num_classes.is_multiple_of(4),
            "classes.num_classes",
            "a multiple of four, for a reading in quarter turns",
            num_classes,
        )?;
        check_setting(
            self.readout.window_classes < num_classes / 4,
            "readout.window_classes",
            &format!("below a quarter of {num_classes} classes"),
            self.readout.window_classes,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_usable_and_survive_serialisation() {
        for config in
            [OrientationConfig::edge(), OrientationConfig::paper(), OrientationConfig::edge().with_symmetry(6)]
        {
            config.validate().unwrap();
            let written = serde_json::to_string(&config).unwrap();
            assert_eq!(serde_json::from_str::<OrientationConfig>(&written).unwrap(), config);
        }
        assert_eq!(OrientationConfig::edge().last_map_px(), 4);
        assert_eq!(OrientationConfig::paper().last_map_px(), 7);
    }

    #[test]
    fn settings_without_sense_are_named() {
        let message = |change: fn(&mut OrientationConfig)| {
            let mut config = OrientationConfig::edge();
            change(&mut config);
            config.validate().unwrap_err().to_string()
        };
        let odd = message(|c| c.input_px = 70);
        assert!(odd.contains("input_px must be 16 to 1024 and a multiple of 16") && odd.ends_with("found 70"), "{odd}");
        assert!(message(|c| c.norm_groups = 7).contains("norm_groups"));
        assert!(message(|c| c.stage_convs = vec![1]).contains("stage_convs"));
        assert!(message(|c| c.classes.symmetry = 0).contains("1 to 72 equal turns, found 0"));
        assert!(message(|c| c.classes.num_classes = 90 + 1).contains("multiple of four"));
        assert!(message(|c| c.readout.window_classes = 90).contains("below a quarter of 360"));
    }
}
