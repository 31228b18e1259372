//! Reads a detector's configuration from JSON, complete or as differences from a preset.

use serde::Deserialize;
use serde::de::IgnoredAny;

use crate::config::{BlockKind, RcnnConfig, ResizeRule};
use crate::error::{DetectionError, Result};
use crate::presets::{RcnnKind, r50_detectron2, r50_torchvision};

/// Differences from a preset, with the keys of `config.json` in the reference outputs.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct PresetChanges {
    /// `faster`, `keypoint` or `mask`.
    kind: String,
    /// `detectron2` (the default) or `torchvision`.
    numerics: Option<String>,
    classes: Option<usize>,
    keypoints: Option<usize>,
    /// Short side of the network's input, in pixels.
    min_size_test: Option<u32>,
    /// Maximum long side, in pixels.
    max_size_test: Option<u32>,
    /// Per level, in training and in inference.
    pre_nms_topk: Option<usize>,
    post_nms_topk_test: Option<usize>,
    post_nms_topk_train: Option<usize>,
    detections_per_image: Option<usize>,
    score_thresh_test: Option<f64>,
    stem_out_channels: Option<usize>,
    res2_out_channels: Option<usize>,
    /// Channels of the inner convolutions of res2.
    width_per_group: Option<usize>,
    num_blocks: Option<[usize; 4]>,
    fpn_channels: Option<usize>,
    box_head_fc: Option<usize>,
    keypoint_convs: Option<usize>,
    mask_convs: Option<usize>,
    /// This field and the next two describe the reference and are not used.
    #[serde(rename = "width")]
    _width: Option<IgnoredAny>,
    #[serde(rename = "seed")]
    _seed: Option<IgnoredAny>,
    #[serde(rename = "losses")]
    _losses: Option<IgnoredAny>,
}

impl RcnnConfig {
    /// Reads a configuration: either every value, as this type serialises, or an object with `kind` (`faster`,
    /// `keypoint`, `mask`), `numerics` (`detectron2`, `torchvision`) and the differences from [`r50_detectron2`]
    /// or [`r50_torchvision`] of that kind, such as `fpn_channels`.
    ///
    /// # Errors
    /// [`DetectionError::ConfigFile`] gives the position of unreadable text; [`DetectionError::Config`] gives
    /// the value that is out of range.
    pub fn from_json(text: &str) -> Result<Self> {
        let failed = |error: serde_json::Error| DetectionError::ConfigFile { reason: error.to_string() };
        let value: serde_json::Value = serde_json::from_str(text).map_err(failed)?;
        // Parsed from the text a second time, because only then errors contain line and column.
        let config = if value.get("kind").is_some() {
            serde_json::from_str::<PresetChanges>(text).map_err(failed)?.applied()?
        } else {
            serde_json::from_str(text).map_err(failed)?
        };
        config.validate()?;
        Ok(config)
    }
}

fn set<T: Copy>(place: &mut T, value: Option<T>) {
    if let Some(value) = value {
        *place = value;
    }
}

impl PresetChanges {
    fn applied(&self) -> Result<RcnnConfig> {
        let num_classes = self.classes.unwrap_or(80);
        let kind = match self.kind.as_str() {
            "faster" => RcnnKind::Faster { num_classes },
            "keypoint" => RcnnKind::Keypoint { num_keypoints: self.keypoints.unwrap_or(17) },
            "mask" => RcnnKind::Mask { num_classes },
            found => {
                return Err(DetectionError::Config {
                    field: "kind",
                    expected: "faster, keypoint or mask".to_owned(),
                    found: found.to_owned(),
                });
            }
        };
        let mut config = match self.numerics.as_deref() {
            None | Some("detectron2") => r50_detectron2(kind),
            Some("torchvision") => r50_torchvision(kind),
            Some(found) => {
                return Err(DetectionError::Config {
                    field: "numerics",
                    expected: "detectron2 or torchvision".to_owned(),
                    found: found.to_owned(),
                });
            }
        };
        if let ResizeRule::ShortSide { short_px, max_long_px, .. } = &mut config.input.resize {
            set(short_px, self.min_size_test);
            set(max_long_px, self.max_size_test);
        }
        set(&mut config.backbone.stem_channels, self.stem_out_channels);
        set(&mut config.backbone.res2_channels, self.res2_out_channels);
        set(&mut config.backbone.num_blocks, self.num_blocks);
        if let BlockKind::Bottleneck { inner_channels, .. } = &mut config.backbone.block {
            set(inner_channels, self.width_per_group);
        }
        set(&mut config.fpn.channels, self.fpn_channels);
        set(&mut config.rpn.pre_nms_top_n.train, self.pre_nms_topk);
        set(&mut config.rpn.pre_nms_top_n.test, self.pre_nms_topk);
        set(&mut config.rpn.post_nms_top_n.train, self.post_nms_topk_train);
        set(&mut config.rpn.post_nms_top_n.test, self.post_nms_topk_test);
        let heads = &mut config.roi_heads;
        set(&mut heads.num_classes, self.classes);
        set(&mut heads.box_head.fc_channels, self.box_head_fc);
        set(&mut heads.box_head.score_threshold, self.score_thresh_test);
        set(&mut heads.box_head.detections_per_image, self.detections_per_image);
        if let (Some(head), Some(channels)) = (&mut heads.keypoint_head, self.keypoint_convs) {
            head.conv_channels.fill(channels);
        }
        if let (Some(head), Some(channels)) = (&mut heads.mask_head, self.mask_convs) {
            head.conv_channels.fill(channels);
            head.deconv_channels = channels;
        }
        Ok(config)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::presets::edge;

    #[test]
    fn a_whole_configuration_reads_back() {
        let text = serde_json::to_string(&edge(12)).unwrap();
        assert_eq!(RcnnConfig::from_json(&text).unwrap(), edge(12));
    }

    #[test]
    fn changes_apply_to_the_preset_of_their_kind() {
        let config = RcnnConfig::from_json(r#"{"kind": "mask", "classes": 2, "mask_convs": 32}"#).unwrap();
        let head = config.roi_heads.mask_head.as_ref().unwrap();
        assert_eq!((config.roi_heads.num_classes, head.deconv_channels), (2, 32));
        assert_eq!(head.conv_channels, [32; 4]);
        assert_eq!(config.fpn, r50_detectron2(RcnnKind::Mask { num_classes: 2 }).fpn);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let error = |text: &str| RcnnConfig::from_json(text).unwrap_err().to_string();
        assert!(error("{").contains("line 1 column 1"), "{}", error("{"));
        let misspelt = error(r#"{"kind": "mask", "fpn_chanels": 3}"#);
        assert!(misspelt.contains("fpn_chanels") && misspelt.contains("fpn_channels"), "{misspelt}");
        let kind = error(r#"{"kind": "masks"}"#);
        assert!(kind.contains("faster, keypoint or mask") && kind.contains("masks"), "{kind}");
        assert!(error(r#"{"kind": "mask", "numerics": "mmdet"}"#).contains("detectron2 or torchvision"));
        assert!(error("{}").contains("missing field `input`"), "{}", error("{}"));
        assert!(error(r#"{"kind": "mask", "classes": 0}"#).contains("roi_heads.num_classes"));
    }
}
