//! The detector of a checkpoint: given by a preset, a configuration file, or the checkpoint's names.
//!
//! A configuration file is either an [`RcnnConfig`] as JSON, or the short form that is stored beside reference outputs:
//! the kind, widths, sizes and thresholds that differ from the preset.

use std::path::Path;

use anyhow::{Context, Result, bail};
use sdg_detection::RcnnConfig;
use sdg_detection::config::{BackgroundClass, BlockKind, BoxDeltas, NormKind, RoiHeadsConfig};
use sdg_detection::presets::{self, RcnnKind};
use sdg_weights_conversion::architecture::{Backbone, Background, Block, Heads, KeypointHead, MaskHead, Norm};
use sdg_weights_conversion::{Architecture, Checkpoint, Naming, Program, SecondStage, naming_of, source_of};

use crate::error::ConfigError;

/// Maximum size of a configuration file.
const MAX_CONFIG_BYTES: u64 = 1 << 20;
/// The presets that checkpoints are imported into.
const PRESETS: [&str; 2] = ["r50-detectron2", "r50-torchvision"];

/// Reads a configuration file of either form.
///
/// # Errors
/// The file cannot be read, has neither form, or contradicts itself.
pub fn read_config(path: &Path) -> Result<RcnnConfig> {
    let named = || path.display().to_string();
    let bytes = sdg_files::read(path, MAX_CONFIG_BYTES)?;
    let text = std::str::from_utf8(&bytes).with_context(named)?;
    RcnnConfig::from_json(text).with_context(named)
}

/// The preset of this name, with the checkpoint's number of classes and keypoints.
///
/// # Errors
/// The name is unknown, or the checkpoint has no class scores or has a head that the preset cannot have.
pub fn preset(name: &str, checkpoint: &Checkpoint) -> Result<RcnnConfig> {
    let naming = naming_of(checkpoint)?;
    let SecondStage { num_classes, num_keypoints, has_masks } = SecondStage::of(checkpoint, naming)?;
    let kind = match (num_keypoints, has_masks) {
        (None, false) => RcnnKind::Faster { num_classes },
        (Some(num_keypoints), false) if num_classes == 1 => RcnnKind::Keypoint { num_keypoints },
        (None, true) => RcnnKind::Mask { num_classes },
        (Some(_), false) => bail!("expected keypoints of one class, found {num_classes} classes"),
        (Some(_), true) => return Err(ConfigError::BothHeads.into()),
    };
    Ok(preset_of_kind(name, kind)?)
}

/// The kind of second stage that a configuration describes.
pub fn kind_of(config: &RcnnConfig) -> RcnnKind {
    let RoiHeadsConfig { num_classes, ref keypoint_head, ref mask_head, .. } = config.roi_heads;
    match (keypoint_head, mask_head) {
        (Some(head), _) => RcnnKind::Keypoint { num_keypoints: head.num_keypoints },
        (None, Some(_)) => RcnnKind::Mask { num_classes },
        (None, None) => RcnnKind::Faster { num_classes },
    }
}

/// The preset of this name with a second stage of this kind.
///
/// # Errors
/// An unknown name.
pub fn preset_of_kind(name: &str, kind: RcnnKind) -> Result<RcnnConfig, ConfigError> {
    match name {
        "r50-detectron2" => Ok(presets::r50_detectron2(kind)),
        "r50-torchvision" => Ok(presets::r50_torchvision(kind)),
        other => Err(ConfigError::UnknownPreset { found: other.to_owned(), expected: PRESETS.join(", ") }),
    }
}

/// The preset whose numerics are those of a checkpoint's program. `None` for a file with this project's names that does
/// not say where its weights come from: the names are the same for every preset.
pub fn preset_for(checkpoint: &Checkpoint, naming: Naming) -> Option<&'static str> {
    let (naming, author) = source_of(checkpoint, naming);
    naming.program(author).map(|program| match program {
        Program::Detectron2 => "r50-detectron2",
        Program::Torchvision => "r50-torchvision",
    })
}

/// Names and shapes of a detector's parameters, as determined by the configuration.
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
            mask: heads.mask_head.as_ref().map(|head| MaskHead {
                conv_channels: head.conv_channels.clone(),
                deconv_channels: head.deconv_channels,
                num_masks: match heads.box_head.background {
                    BackgroundClass::First => heads.num_classes + 1,
                    BackgroundClass::Last => heads.num_classes,
                },
            }),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_grasp::Device;
    use sdg_layers::state_dict;

    /// The list is made without building the network; this test compares it with a built network.
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
        let mut mask = presets::r50_detectron2(RcnnKind::Mask { num_classes: 3 });
        mask.backbone = narrow.backbone.clone();
        mask.fpn.channels = 8;
        mask.roi_heads.box_head.fc_channels = 16;
        if let Some(head) = &mut mask.roi_heads.mask_head {
            (head.conv_channels, head.deconv_channels) = (vec![8, 4], 6);
        }
        let mut mask_first = mask.clone();
        mask_first.roi_heads.box_head.background = BackgroundClass::First;
        let mut first = narrow.clone();
        first.roi_heads.box_head.background = BackgroundClass::First;
        let mut agnostic = narrow.clone();
        agnostic.roi_heads.box_head.box_deltas = BoxDeltas::ClassAgnostic;
        agnostic.fpn.norm = NormKind::Group { num_groups: 4 };
        for config in [presets::edge(12), narrow, first, agnostic, mask, mask_first] {
            let built = state_dict::export(&config.init(&Device::flex(), 1).unwrap());
            let shapes = built.into_iter().map(|(name, weight)| (name, weight.shape)).collect();
            assert_eq!(architecture_of(&config).parameters(), shapes);
        }
    }
}
