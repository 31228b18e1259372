//! Properties of a network from the names and shapes in a checkpoint: number of classes, keypoints, masks; depth of a
//! backbone.

use crate::architecture::Backbone;
use crate::checkpoint::Checkpoint;
use crate::error::{Result, WeightsError};
use crate::naming::Naming;

/// The second stage of a detector's checkpoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SecondStage {
    /// Object classes, without background.
    pub num_classes: usize,
    /// Keypoints per object, if there is a keypoint head.
    pub num_keypoints: Option<usize>,
    /// Whether there is a mask head.
    pub has_masks: bool,
}

impl SecondStage {
    /// Reads the numbers from the shapes of the last layers.
    ///
    /// # Errors
    /// A checkpoint without class scores.
    pub fn of(checkpoint: &Checkpoint, naming: Naming) -> Result<Self> {
        let size = |wanted: &str, axis: usize| {
            let found = checkpoint.tensors.iter().find(|(name, _)| naming.our_name(name).as_deref() == Some(wanted));
            found.and_then(|(_, tensor)| tensor.shape().get(axis).copied())
        };
        let scores = size("roi_heads.box_predictor.cls_score.bias", 0);
        let Some(num_classes) = scores.and_then(|scores| scores.checked_sub(1)).filter(|classes| *classes > 0) else {
            return Err(WeightsError::Architecture {
                part: "class scores",
                expected: "at least one class and the background".to_owned(),
                found: scores.map_or("none".to_owned(), |scores| format!("{scores} outputs")),
            });
        };
        Ok(Self {
            num_classes,
            num_keypoints: size("roi_heads.keypoint_head.score_lowres.bias", 0),
            has_masks: size("roi_heads.mask_head.predictor.bias", 0).is_some(),
        })
    }
}

impl Backbone {
    /// The ResNet whose blocks a checkpoint contains.
    ///
    /// # Errors
    /// Blocks of no ResNet-18, -34 or -50.
    pub fn of(checkpoint: &Checkpoint, naming: Naming) -> Result<Self> {
        let names: Vec<String> = checkpoint.tensors.keys().filter_map(|name| naming.our_name(name)).collect();
        let has = |name: String| names.contains(&format!("backbone.bottom_up.{name}.weight"));
        let num_blocks =
            [2, 3, 4, 5].map(|stage| (0..100).take_while(|i| has(format!("res{stage}.{i}.conv1"))).count());
        match (num_blocks, has("res2.0.conv3".to_owned())) {
            ([2, 2, 2, 2], false) => Self::resnet(18),
            ([3, 4, 6, 3], false) => Self::resnet(34),
            ([3, 4, 6, 3], true) => Self::resnet(50),
            (found, bottleneck) => Err(WeightsError::Architecture {
                part: "backbone",
                expected: "the blocks of ResNet-18, -34 or -50".to_owned(),
                found: format!("{found:?} {} blocks", if bottleneck { "bottleneck" } else { "basic" }),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::architecture::{Architecture, Background, Heads, KeypointHead, MaskHead, Norm};
    use crate::checkpoint::FileFormat;
    use crate::conversion::{Conversion, naming_of};
    use crate::element::ElementType;
    use crate::source::Span;
    use crate::tensor::{Encoding, Payload, StoredTensor};

    /// Checkpoints with the names and shapes of torchvision's own models, without values.
    fn torchvision_models() -> BTreeMap<String, Checkpoint> {
        let names: BTreeMap<String, BTreeMap<String, Vec<usize>>> =
            serde_json::from_str(include_str!("../tests/fixtures/torchvision_names.json")).unwrap();
        let tensor = |shape: Vec<usize>| {
            let span = Span { offset: 0, len: 4 * shape.iter().product::<usize>() as u64 };
            let payload = Payload { span, encoding: Encoding::Raw };
            StoredTensor::dense("t", shape, false, ElementType::F32, payload).unwrap()
        };
        let checkpoint = |names: BTreeMap<String, Vec<usize>>| Checkpoint {
            format: FileFormat::TorchZip,
            author: None,
            metadata: BTreeMap::new(),
            tensors: names.into_iter().map(|(name, shape)| (name, tensor(shape))).collect(),
            not_tensors: Vec::new(),
        };
        names.into_iter().map(|(kind, names)| (kind, checkpoint(names))).collect()
    }

    #[test]
    fn torchvision_s_detectors_fill_ours_to_the_last_name() {
        let models = torchvision_models();
        for (kind, num_classes, num_keypoints, num_masks) in [
            ("fasterrcnn_resnet50_fpn", 90, None, None),
            ("keypointrcnn_resnet50_fpn", 1, Some(17), None),
            ("maskrcnn_resnet50_fpn", 90, None, Some(91)),
        ] {
            let checkpoint = &models[kind];
            let naming = naming_of(checkpoint).unwrap();
            assert_eq!(naming, Naming::Torchvision);
            let found = SecondStage::of(checkpoint, naming).unwrap();
            assert_eq!(found, SecondStage { num_classes, num_keypoints, has_masks: num_masks.is_some() });
            let heads = Heads {
                fpn_channels: 256,
                fpn_norm: Norm::None,
                num_anchors: 3,
                box_pooled_size: 7,
                fc_channels: 1024,
                num_classes,
                background: Background::First,
                class_specific_boxes: true,
                keypoint: num_keypoints.map(|k| KeypointHead { conv_channels: vec![512; 8], num_keypoints: k }),
                mask: num_masks.map(|num_masks| MaskHead {
                    conv_channels: vec![256; 4],
                    deconv_channels: 256,
                    num_masks,
                }),
            };
            let target = Architecture { backbone: Backbone::of(checkpoint, naming).unwrap(), heads: Some(heads) };
            let conversion = Conversion::plan(checkpoint, &target, &[]).unwrap();
            conversion.complete().unwrap();
            assert_eq!(conversion.report().applied.len(), target.parameters().len());
            assert_eq!(conversion.report().unused, [""; 0], "{kind}");
        }
    }

    #[test]
    fn torchvision_s_classifiers_fill_a_backbone() {
        let models = torchvision_models();
        for (kind, depth) in [("resnet18", 18), ("resnet34", 34), ("resnet50", 50)] {
            let checkpoint = &models[kind];
            let naming = naming_of(checkpoint).unwrap();
            let backbone = Backbone::of(checkpoint, naming).unwrap();
            assert_eq!(backbone, Backbone::resnet(depth).unwrap());
            let conversion = Conversion::plan(checkpoint, &Architecture { backbone, heads: None }, &[]).unwrap();
            conversion.complete().unwrap();
            assert_eq!(conversion.report().unused, ["fc.bias", "fc.weight"]);
        }
    }
}
