//! Checks whether a detector can be built from a configuration, and without too much memory, because a configuration
//! may come from an untrusted file.

use crate::config::{NormKind, RcnnConfig, ResizeRule, RoiPoolerConfig, SamplingRatio};
use crate::error::{DetectionError, Result};

/// Maximum number of values in one layer's output for one image, eighteen times that of R-50 on the largest image (1333 ×
/// 1333 pixels); in single precision, two gigabytes.
const MAX_OUTPUT_VALUES: f64 = (1 << 29) as f64;
/// Maximum side of the resized image, in pixels; Detectron2 and torchvision use at most 1333.
const MAX_SIDE_PX: u32 = 4096;
/// Maximum number of blocks in a stage; ResNet-152 has 36.
const MAX_BLOCKS: usize = 64;
/// Maximum length of a list in the configuration, such as the convolutions of a head.
const MAX_LIST: usize = 32;
/// Maximum side of pooled squares, in cells; Detectron2 and torchvision use at most 14.
const MAX_POOLED: usize = 64;
/// Maximum number of anchors of a level that go through the NMS of a detection; its time grows with the square of their
/// number. Detectron2 and torchvision use at most 6000.
const MAX_PRE_NMS: usize = 10_000;

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
            (1..=MAX_SIDE_PX).contains(&w) && (1..=MAX_SIDE_PX).contains(&h),
            "input.resize",
            &format!("from 1 to {MAX_SIDE_PX} px"),
            format!("{w}, {h}"),
        )?;
        check(
            self.input.size_divisibility.is_multiple_of(32) && (32..=1024).contains(&self.input.size_divisibility),
            "input.size_divisibility",
            "a multiple of 32 up to 1024, so that the levels of the pyramid halve exactly",
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
            self.backbone.num_blocks.iter().all(|n| (1..=MAX_BLOCKS).contains(n)),
            "backbone.num_blocks",
            &format!("1 to {MAX_BLOCKS} blocks per stage"),
            format!("{:?}", self.backbone.num_blocks),
        )?;
        check(
            (1..=MAX_LIST).contains(&self.anchors.aspect_ratios.len())
                && self.anchors.aspect_ratios.iter().all(|r| *r > 0.0),
            "anchors.aspect_ratios",
            &format!("1 to {MAX_LIST} positive numbers"),
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
        let pre_nms = self.rpn.pre_nms_top_n.test;
        check(
            pre_nms <= MAX_PRE_NMS,
            "rpn.pre_nms_top_n.test",
            &format!("at most {MAX_PRE_NMS} anchors per level"),
            pre_nms,
        )?;
        check(self.roi_heads.num_classes > 0, "roi_heads.num_classes", "at least 1", self.roi_heads.num_classes)?;
        if let Some(head) = &self.roi_heads.keypoint_head {
            check(head.num_keypoints > 0, "roi_heads.keypoint_head.num_keypoints", "at least 1", head.num_keypoints)?;
            check(
                (1..=MAX_LIST).contains(&head.conv_channels.len()),
                "roi_heads.keypoint_head.conv_channels",
                &format!("1 to {MAX_LIST} convolutions"),
                head.conv_channels.len(),
            )?;
        }
        if let Some(head) = &self.roi_heads.mask_head {
            check(
                (1..=MAX_LIST).contains(&head.conv_channels.len())
                    && head.conv_channels.iter().all(|channels| *channels > 0),
                "roi_heads.mask_head.conv_channels",
                &format!("1 to {MAX_LIST} convolutions with channels"),
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
        self.check_outputs([w, h])
    }

    /// Checks the size of the layers' outputs for one image of at most `[w, h]` pixels.
    fn check_outputs(&self, [w, h]: [u32; 2]) -> Result<()> {
        let heads = &self.roi_heads;
        let keypoint_pooler = heads.keypoint_head.as_ref().map(|head| ("roi_heads.keypoint_head.pooler", &head.pooler));
        let mask_pooler = heads.mask_head.as_ref().map(|head| ("roi_heads.mask_head.pooler", &head.pooler));
        let poolers = [Some(("roi_heads.box_head.pooler", &heads.box_head.pooler)), keypoint_pooler, mask_pooler];
        for (field, pooler) in poolers.into_iter().flatten() {
            let samples = if let SamplingRatio::Fixed(samples) = pooler.sampling_ratio { samples } else { 1 };
            check(
                (1..=MAX_POOLED).contains(&pooler.output_size) && (1..=MAX_POOLED).contains(&samples),
                field,
                &format!("squares of 1 to {MAX_POOLED} cells, with as many samples"),
                format!("{} and {samples}", pooler.output_size),
            )?;
        }
        let square = |pooler: &RoiPoolerConfig| (pooler.output_size as f64).powi(2);
        let widest = |channels: &[usize]| channels.iter().copied().max().unwrap_or(0).max(self.fpn.channels) as f64;
        let detections = heads.box_head.detections_per_image as f64;
        let pixels = f64::from(w) * f64::from(h);
        let of_box_head = heads.box_head.fc_channels.max(heads.num_classes.saturating_mul(4)) as f64;
        let mut outputs = vec![
            ("backbone.stem_channels", pixels / 4.0 * self.backbone.stem_channels as f64),
            ("backbone.res2_channels", pixels / 16.0 * self.backbone.res2_channels as f64),
            ("fpn.channels", pixels / 16.0 * self.fpn.channels as f64),
            (
                "roi_heads.box_head",
                self.rpn.post_nms_top_n.test as f64
                    * (square(&heads.box_head.pooler) * self.fpn.channels as f64).max(of_box_head),
            ),
        ];
        // Heads double the side of the pooled square; keypoints' maps are then doubled again.
        if let Some(head) = &heads.keypoint_head {
            let convs = widest(&head.conv_channels) * square(&head.pooler);
            let maps = head.num_keypoints as f64 * (head.heatmap_size() as f64).powi(2);
            outputs.push(("roi_heads.keypoint_head", detections * convs.max(maps)));
        }
        if let Some(head) = &heads.mask_head {
            let convs = widest(&head.conv_channels) * square(&head.pooler);
            let maps = head.deconv_channels.max(heads.num_classes) as f64 * 4.0 * square(&head.pooler);
            outputs.push(("roi_heads.mask_head", detections * convs.max(maps)));
        }
        outputs.into_iter().try_for_each(|(field, count)| {
            check(count <= MAX_OUTPUT_VALUES, field, &format!("at most {MAX_OUTPUT_VALUES} values per image"), count)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::KeypointHeadConfig;
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
        // Sizes that would take gigabytes, or very long.
        fn keypoint_head(c: &mut RcnnConfig) -> &mut KeypointHeadConfig {
            c.roi_heads.keypoint_head.as_mut().unwrap()
        }
        assert_eq!(field(|c| c.input.size_divisibility = 1 << 40), "input.size_divisibility");
        assert_eq!(field(|c| c.input.resize = ResizeRule::FitWithin { width_px: 8192, height_px: 64 }), "input.resize");
        assert_eq!(field(|c| c.backbone.num_blocks[2] = 1 << 40), "backbone.num_blocks");
        assert_eq!(field(|c| c.backbone.stem_channels = 1 << 20), "backbone.stem_channels");
        assert_eq!(field(|c| c.backbone.res2_channels = 1 << 20), "backbone.res2_channels");
        assert_eq!(field(|c| c.fpn.channels = 1 << 20), "fpn.channels");
        assert_eq!(field(|c| c.anchors.aspect_ratios = vec![1.0; 33]), "anchors.aspect_ratios");
        assert_eq!(field(|c| c.roi_heads.box_head.pooler.output_size = 65), "roi_heads.box_head.pooler");
        assert_eq!(field(|c| c.rpn.pre_nms_top_n.test = 10_001), "rpn.pre_nms_top_n.test");
        assert_eq!(field(|c| c.rpn.post_nms_top_n.test = usize::MAX), "roi_heads.box_head");
        assert_eq!(field(|c| c.roi_heads.box_head.fc_channels = usize::MAX), "roi_heads.box_head");
        assert_eq!(field(|c| c.roi_heads.box_head.detections_per_image = usize::MAX), "roi_heads.keypoint_head");
        assert_eq!(
            field(|c| keypoint_head(c).pooler.sampling_ratio = SamplingRatio::Fixed(1000)),
            "roi_heads.keypoint_head.pooler"
        );
        assert_eq!(field(|c| keypoint_head(c).conv_channels = vec![8; 33]), "roi_heads.keypoint_head.conv_channels");
        assert_eq!(field(|c| keypoint_head(c).num_keypoints = usize::MAX), "roi_heads.keypoint_head");
        let long_mask_head = field(|c| {
            *c = edge_of(RcnnKind::Mask { num_classes: 1 });
            c.roi_heads.mask_head.as_mut().unwrap().conv_channels = vec![8; 33];
        });
        assert_eq!(long_mask_head, "roi_heads.mask_head.conv_channels");
    }
}
