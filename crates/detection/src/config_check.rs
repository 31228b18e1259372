//! Checks whether a detector can be built from a configuration.

use crate::config::{NormKind, RcnnConfig, ResizeRule};
use crate::error::{DetectionError, Result};

fn check(holds: bool, field: &'static str, expected: &str, found: impl ToString) -> Result<()> {
    if holds {
        return Ok(());
    }
    Err(DetectionError::Config { field, expected: expected.to_owned(), found: found.to_string() })
}

impl RcnnConfig {
    /// Checks the ranges of values, and that values that depend on each other agree.
    ///
    /// # Errors
    /// [`DetectionError::Config`] names the first invalid field.
    pub fn validate(&self) -> Result<()> {
        let (w, h) = match self.input.resize {
            ResizeRule::ShortSide { short_px, max_long_px, .. } => (short_px, max_long_px),
            ResizeRule::FitWithin { width_px, height_px } => (width_px, height_px),
        };
        check(
            (1..=8192).contains(&w) && (1..=8192).contains(&h),
            "input.resize",
            "from 1 to 8192 px",
            format!("{w}, {h}"),
        )?;
        check(
            self.input.size_divisibility.is_multiple_of(32) && self.input.size_divisibility > 0,
            "input.size_divisibility",
            "a multiple of 32, so that the levels of the pyramid halve exactly",
            self.input.size_divisibility,
        )?;
        check(
            self.input.std.iter().all(|s| *s > 0.0 && s.is_finite()),
            "input.std",
            "positive",
            format!("{:?}", self.input.std),
        )?;
        for (field, norm, channels) in [
            ("backbone.norm", self.backbone.norm, self.backbone.stem_channels),
            ("backbone.norm", self.backbone.norm, self.backbone.res2_channels),
            ("fpn.norm", self.fpn.norm, self.fpn.channels),
        ] {
            if let NormKind::Group { num_groups } = norm {
                check(
                    num_groups > 0 && channels % num_groups == 0,
                    field,
                    "a number of groups that divides the channels",
                    format!("{num_groups} groups of {channels} channels"),
                )?;
            }
        }
        check(
            self.backbone.num_blocks.iter().all(|n| *n > 0),
            "backbone.num_blocks",
            "at least one block per stage",
            format!("{:?}", self.backbone.num_blocks),
        )?;
        check(
            !self.anchors.aspect_ratios.is_empty() && self.anchors.aspect_ratios.iter().all(|r| *r > 0.0),
            "anchors.aspect_ratios",
            "one or more positive numbers",
            format!("{:?}", self.anchors.aspect_ratios),
        )?;
        check(
            self.anchors.sizes_px.iter().all(|s| *s > 0.0 && s.is_finite()),
            "anchors.sizes_px",
            "positive",
            format!("{:?}", self.anchors.sizes_px),
        )?;
        for (field, matcher) in [("rpn.matcher", &self.rpn.matcher), ("roi_heads.matcher", &self.roi_heads.matcher)] {
            check(
                0.0 <= matcher.negative_below
                    && matcher.negative_below <= matcher.positive_from
                    && matcher.positive_from <= 1.0,
                field,
                "0 <= negative_below <= positive_from <= 1",
                format!("{} and {}", matcher.negative_below, matcher.positive_from),
            )?;
        }
        for (field, sampler) in [("rpn.sampler", &self.rpn.sampler), ("roi_heads.sampler", &self.roi_heads.sampler)] {
            check(
                sampler.batch_size_per_image > 0 && (0.0..=1.0).contains(&sampler.positive_fraction),
                field,
                "at least one sample, and a fraction from 0 to 1",
                format!("{}, {}", sampler.batch_size_per_image, sampler.positive_fraction),
            )?;
        }
        check(self.roi_heads.num_classes > 0, "roi_heads.num_classes", "at least 1", self.roi_heads.num_classes)?;
        if let Some(head) = &self.roi_heads.keypoint_head {
            check(head.num_keypoints > 0, "roi_heads.keypoint_head.num_keypoints", "at least 1", head.num_keypoints)?;
            check(
                !head.conv_channels.is_empty(),
                "roi_heads.keypoint_head.conv_channels",
                "one or more convolutions",
                "none",
            )?;
        }
        if let Some(head) = &self.roi_heads.mask_head {
            check(
                !head.conv_channels.is_empty() && head.conv_channels.iter().all(|channels| *channels > 0),
                "roi_heads.mask_head.conv_channels",
                "one or more convolutions with channels",
                format!("{:?}", head.conv_channels),
            )?;
            check(head.deconv_channels > 0, "roi_heads.mask_head.deconv_channels", "at least 1", head.deconv_channels)?;
            check(
                head.threshold > 0.0 && head.threshold < 1.0,
                "roi_heads.mask_head.threshold",
                "between 0 and 1",
                head.threshold,
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::presets::{RcnnKind, edge, edge_of, r50_detectron2, r50_torchvision};

    #[test]
    fn presets_pass_and_survive_serialisation() {
        let keypoint = RcnnKind::Keypoint { num_keypoints: 17 };
        let (faster, mask) = (RcnnKind::Faster { num_classes: 80 }, RcnnKind::Mask { num_classes: 2 });
        for config in [keypoint, faster, mask]
            .into_iter()
            .flat_map(|kind| [edge_of(kind), r50_detectron2(kind), r50_torchvision(kind)])
        {
            assert_eq!(config.validate(), Ok(()));
            let json = serde_json::to_string(&config).unwrap();
            assert_eq!(serde_json::from_str::<RcnnConfig>(&json).unwrap(), config);
        }
    }

    #[test]
    fn broken_values_are_named() {
        let field = |change: fn(&mut RcnnConfig)| {
            let mut config = edge(12);
            change(&mut config);
            match config.validate() {
                Err(DetectionError::Config { field, .. }) => field,
                other => panic!("expected a configuration error, found {other:?}"),
            }
        };
        assert_eq!(field(|c| c.input.size_divisibility = 16), "input.size_divisibility");
        assert_eq!(field(|c| c.backbone.norm = NormKind::Group { num_groups: 7 }), "backbone.norm");
        assert_eq!(field(|c| c.rpn.matcher.negative_below = 0.9), "rpn.matcher");
        assert_eq!(field(|c| c.input.std[1] = 0.0), "input.std");
        assert_eq!(field(|c| c.roi_heads.num_classes = 0), "roi_heads.num_classes");
    }
}
