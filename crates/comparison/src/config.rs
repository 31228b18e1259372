//! The network's configuration, as plain data for model files.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// An invalid setting.
#[derive(Debug, Error)]
#[error("comparison network: {field} must be {expected}, found {found}")]
pub struct ComparisonError {
    field: &'static str,
    expected: &'static str,
    found: String,
}

/// The network. The first convolution of every stage halves the map.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ComparisonConfig {
    /// S: side of a view, in pixels.
    pub input_px: u32,
    /// Channels of each trunk stage. The trunk processes demonstration and picture separately, with the same weights.
    pub trunk_channels: Vec<usize>,
    /// Convolutions of each trunk stage, including the one that halves the map.
    pub trunk_convs: Vec<usize>,
    /// Maximum shift of the demonstration's map over the picture's, in cells along each axis.
    pub reach: usize,
    /// Channels of each stage that processes the differences.
    pub stage_channels: Vec<usize>,
    /// Convolutions of each stage in `stage_channels`, including the one that halves the map.
    pub stage_convs: Vec<usize>,
    /// Groups of the group norms; a divisor of every stage's channels.
    pub norm_groups: usize,
    /// Width of the hidden fully connected layer.
    pub hidden: usize,
}

impl ComparisonConfig {
    /// 64 × 64 pixels, 0.6 million parameters. The trunk equals the first stages of the orientation CNN of preset
    /// `edge`.
    pub fn edge() -> Self {
        Self {
            input_px: 64,
            trunk_channels: vec![24, 48],
            trunk_convs: vec![1, 2],
            reach: 2,
            stage_channels: vec![96, 128],
            stage_convs: vec![2, 2],
            norm_groups: 8,
            hidden: 48,
        }
    }

    /// The configuration for views of twice the resolution. Log-odds are learnt for one size; alignment works at any
    /// size.
    pub fn finer(&self) -> Self {
        Self { input_px: 2 * self.input_px, ..self.clone() }
    }

    /// Side of the trunk's map, in cells.
    pub fn trunk_map_px(&self) -> usize {
        self.input_px as usize >> self.trunk_channels.len()
    }

    /// Side of the last map, in cells.
    pub fn last_map_px(&self) -> usize {
        self.trunk_map_px() >> self.stage_channels.len()
    }

    /// Checks that the network can be built.
    pub(crate) fn check(&self) -> Result<(), ComparisonError> {
        let check = |holds: bool, field, expected, found: String| match holds {
            true => Ok(()),
            false => Err(ComparisonError { field, expected, found }),
        };
        let channels: Vec<usize> = self.trunk_channels.iter().chain(&self.stage_channels).copied().collect();
        for (field, stages) in [("trunk_channels", &self.trunk_channels), ("stage_channels", &self.stage_channels)] {
            check((1..=3).contains(&stages.len()), field, "1 to 3 stages", stages.len().to_string())?;
        }
        check(self.reach <= 4, "reach", "0 to 4 cells", self.reach.to_string())?;
        check(
            (16..=256).contains(&self.input_px) && self.input_px.is_multiple_of(1 << channels.len()),
            "input_px",
            "16 to 256, and halved by every stage without a remainder",
            self.input_px.to_string(),
        )?;
        let fits = |c: &usize| (1..=1024).contains(c) && c.is_multiple_of(self.norm_groups);
        check(
            self.norm_groups > 0 && channels.iter().all(fits),
            "norm_groups",
            "a divisor of every stage's channels, which are 1 to 1024",
            format!("{} for {channels:?}", self.norm_groups),
        )?;
        for (field, convs, stages) in [
            ("trunk_convs", &self.trunk_convs, &self.trunk_channels),
            ("stage_convs", &self.stage_convs, &self.stage_channels),
        ] {
            let fits = convs.len() == stages.len() && convs.iter().all(|count| (1..=8).contains(count));
            check(fits, field, "1 to 8 convolutions for each stage", format!("{convs:?}"))?;
        }
        check((1..=4096).contains(&self.hidden), "hidden", "1 to 4096", self.hidden.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_without_sense_are_named_and_the_preset_survives_serialisation() {
        let edge = ComparisonConfig::edge();
        let written = serde_json::to_string(&edge).unwrap();
        assert_eq!(serde_json::from_str::<ComparisonConfig>(&written).unwrap(), edge);
        assert_eq!(edge.last_map_px(), 4);
        let message = |change: fn(&mut ComparisonConfig)| {
            let mut config = ComparisonConfig::edge();
            change(&mut config);
            config.check().unwrap_err().to_string()
        };
        let odd = message(|c| c.input_px = 72);
        assert!(odd.contains("input_px must be 16 to 256") && odd.ends_with("found 72"), "{odd}");
        assert!(message(|c| c.norm_groups = 7).contains("norm_groups"));
        assert!(message(|c| c.norm_groups = 0).contains("norm_groups"));
        assert!(message(|c| c.stage_channels.clear()).contains("stage_channels must be 1 to 3 stages"));
        assert!(message(|c| c.stage_convs = vec![2, 0]).contains("stage_convs must be 1 to 8"));
        assert!(message(|c| c.hidden = 0).contains("hidden"));
    }
}
