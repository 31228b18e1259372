//! Which detector a checkpoint is for: a preset, a configuration file, or what its names say.
//!
//! A configuration file is either an [`RcnnConfig`] as JSON, or the short form that stands beside reference outputs:
//! kind, widths, sizes and thresholds that differ from the preset.

use std::path::Path;

use anyhow::{Context, Result, bail};
use sdg_detection::RcnnConfig;
use sdg_detection::config::{BackgroundClass, BlockKind, BoxDeltas, NormKind, ResizeRule};
use sdg_detection::presets::{self, RcnnKind};
use sdg_weights_conversion::architecture::{Backbone, Background, Block, Heads, KeypointHead, Norm};
use sdg_weights_conversion::{Architecture, Checkpoint, Naming, SecondStage, naming_of};
use serde::Deserialize;

use crate::exit::Usage;
use crate::files;

/// More than any configuration takes.
const MOST_CONFIG_BYTES: u64 = 1 << 20;
/// The presets that checkpoints are imported into.
const PRESETS: [&str; 1] = ["r50-detectron2"];

/// The short form: what differs from `r50-detectron2`.
#[derive(Debug, Deserialize)]
struct ShortConfig {
    kind: String,
    classes: usize,
    keypoints: usize,
    min_size_test: u32,
    max_size_test: u32,
    pre_nms_topk: usize,
    post_nms_topk_test: usize,
    post_nms_topk_train: usize,
    detections_per_image: usize,
    score_thresh_test: f64,
    stem_out_channels: usize,
    res2_out_channels: usize,
    width_per_group: usize,
    fpn_channels: usize,
    box_head_fc: usize,
    keypoint_convs: usize,
}

/// Reads a configuration file of either form.
///
/// # Errors
/// A file that cannot be read, is no JSON of either form, or contradicts itself.
pub fn read_config(path: &Path) -> Result<RcnnConfig> {
    let bytes = files::read(path, MOST_CONFIG_BYTES)?;
    let named = || path.display().to_string();
    let value: serde_json::Value = serde_json::from_slice(&bytes).with_context(named)?;
    let config = if value.get("kind").is_some() {
        ShortConfig::deserialize(value).map_err(anyhow::Error::from).and_then(|short| short.expand())
    } else {
        RcnnConfig::deserialize(value).map_err(Into::into)
    };
    let config = config.with_context(named)?;
    config.validate().with_context(named)?;
    Ok(config)
}

impl ShortConfig {
    fn expand(&self) -> Result<RcnnConfig> {
        let kind = match self.kind.as_str() {
            "faster" => RcnnKind::Faster { num_classes: self.classes },
            "keypoint" => RcnnKind::Keypoint { num_keypoints: self.keypoints },
            other => bail!("kind: expected faster or keypoint, found \"{other}\""),
        };
        let mut config = presets::r50_detectron2(kind);
        if let ResizeRule::ShortSide { short_px, max_long_px, .. } = &mut config.input.resize {
            (*short_px, *max_long_px) = (self.min_size_test, self.max_size_test);
        }
        config.backbone.stem_channels = self.stem_out_channels;
        config.backbone.res2_channels = self.res2_out_channels;
        if let BlockKind::Bottleneck { inner_channels, .. } = &mut config.backbone.block {
            *inner_channels = self.width_per_group;
        }
        config.fpn.channels = self.fpn_channels;
        let (pre, post) = (&mut config.rpn.pre_nms_top_n, &mut config.rpn.post_nms_top_n);
        (pre.train, pre.test) = (self.pre_nms_topk, self.pre_nms_topk);
        (post.train, post.test) = (self.post_nms_topk_train, self.post_nms_topk_test);
        let heads = &mut config.roi_heads;
        heads.num_classes = self.classes;
        heads.box_head.fc_channels = self.box_head_fc;
        heads.box_head.score_threshold = self.score_thresh_test;
        heads.box_head.detections_per_image = self.detections_per_image;
        if let Some(head) = &mut heads.keypoint_head {
            head.conv_channels.fill(self.keypoint_convs);
        }
        Ok(config)
    }
}

/// The detector of that name, with the checkpoint's number of classes and keypoints.
///
/// # Errors
/// An unknown name; a checkpoint without class scores, or with a head that the preset cannot have.
pub fn preset(name: &str, checkpoint: &Checkpoint) -> Result<RcnnConfig> {
    let naming = naming_of(checkpoint)?;
    let SecondStage { num_classes, num_keypoints, has_masks } = SecondStage::of(checkpoint, naming)?;
    let kind = match (num_keypoints, has_masks) {
        (None, false) => RcnnKind::Faster { num_classes },
        (Some(num_keypoints), false) if num_classes == 1 => RcnnKind::Keypoint { num_keypoints },
        (Some(_), false) => bail!("expected keypoints of one class, found {num_classes} classes"),
        (_, true) => bail!("expected a detector of boxes or keypoints, found a mask head"),
    };
    match name {
        "r50-detectron2" => Ok(presets::r50_detectron2(kind)),
        other => {
            Err(Usage(format!("--preset: expected a preset out of {}, found \"{other}\"", PRESETS.join(", "))).into())
        }
    }
}

/// The preset whose numerics a checkpoint was made for.
///
/// # Errors
/// Names of nobody who has a preset here.
pub fn preset_for(naming: Naming) -> Result<&'static str> {
    match naming {
        Naming::Detectron2 | Naming::Detectron2Backbone | Naming::Caffe2Resnet => Ok("r50-detectron2"),
        Naming::Torchvision | Naming::TorchvisionResnet => Ok("r50-torchvision"),
        Naming::Ours => Err(Usage("expected --preset or --config for a file with this project's names".into()).into()),
    }
}

/// Names and shapes of a detector's parameters, as far as the configuration decides them.
pub fn architecture_of(config: &RcnnConfig) -> Architecture {
    let norm = |kind| match kind {
        NormKind::Identity => Norm::None,
        NormKind::Group { .. } => Norm::Affine,
        NormKind::FrozenBatch { .. } => Norm::Stored,
    };
    let (backbone, heads) = (&config.backbone, &config.roi_heads);
    let block = match backbone.block {
        BlockKind::Basic => Block::Basic,
        BlockKind::Bottleneck { inner_channels, .. } => Block::Bottleneck { inner_channels },
    };
    Architecture {
        backbone: Backbone {
            stem_channels: backbone.stem_channels,
            res2_channels: backbone.res2_channels,
            num_blocks: backbone.num_blocks,
            block,
            norm: norm(backbone.norm),
        },
        heads: Some(Heads {
            fpn_channels: config.fpn.channels,
            fpn_norm: norm(config.fpn.norm),
            num_anchors: config.anchors.aspect_ratios.len(),
            box_pooled_size: heads.box_head.pooler.output_size,
            fc_channels: heads.box_head.fc_channels,
            num_classes: heads.num_classes,
            background: match heads.box_head.background {
                BackgroundClass::First => Background::First,
                BackgroundClass::Last => Background::Last,
            },
            class_specific_boxes: heads.box_head.box_deltas == BoxDeltas::ClassSpecific,
            keypoint: heads.keypoint_head.as_ref().map(|head| KeypointHead {
                conv_channels: head.conv_channels.clone(),
                num_keypoints: head.num_keypoints,
            }),
            mask: None,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_detection::state_dict;
    use sdg_grasp::Device;

    /// Names and shapes are listed without building the network; a built one says whether the list is right.
    #[test]
    fn the_listed_parameters_are_those_of_a_built_detector() {
        let mut narrow = presets::r50_detectron2(RcnnKind::Faster { num_classes: 3 });
        narrow.backbone.stem_channels = 8;
        narrow.backbone.res2_channels = 16;
        narrow.backbone.block = match narrow.backbone.block {
            BlockKind::Bottleneck { stride_in, .. } => BlockKind::Bottleneck { inner_channels: 4, stride_in },
            BlockKind::Basic => BlockKind::Basic,
        };
        narrow.fpn.channels = 8;
        narrow.roi_heads.box_head.fc_channels = 16;
        let mut first = narrow.clone();
        first.roi_heads.box_head.background = BackgroundClass::First;
        let mut agnostic = narrow.clone();
        agnostic.roi_heads.box_head.box_deltas = BoxDeltas::ClassAgnostic;
        agnostic.fpn.norm = NormKind::Group { num_groups: 4 };
        for config in [presets::edge(12), narrow, first, agnostic] {
            let built = state_dict::export(&config.init(&Device::flex(), 1).unwrap());
            let shapes = built.into_iter().map(|(name, weight)| (name, weight.shape)).collect();
            assert_eq!(architecture_of(&config).parameters(), shapes);
        }
    }
}
