//! What a checkpoint tells of its network: number of classes, keypoints, masks; depth of a backbone.

use crate::architecture::Backbone;
use crate::checkpoint::Checkpoint;
use crate::conversion::our_name;
use crate::error::{Result, WeightsError};
use crate::naming::Naming;

/// The second stage that a detector's checkpoint was made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SecondStage {
    /// Object classes, without background.
    pub num_classes: usize,
    /// Keypoints of an object, where there is a keypoint head.
    pub num_keypoints: Option<usize>,
    /// Whether there is a mask head.
    pub has_masks: bool,
}

impl SecondStage {
    /// Reads the numbers off the shapes of the last layers.
    ///
    /// # Errors
    /// A checkpoint without class scores.
    pub fn of(checkpoint: &Checkpoint, naming: Naming) -> Result<Self> {
        let size = |wanted: &str, axis: usize| {
            let found = checkpoint.tensors.iter().find(|(name, _)| our_name(naming, name).as_deref() == Some(wanted));
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
    /// The ResNet whose blocks a checkpoint holds.
    ///
    /// # Errors
    /// Blocks of no ResNet-18, -34 or -50.
    pub fn of(checkpoint: &Checkpoint, naming: Naming) -> Result<Self> {
        let names: Vec<String> = checkpoint.tensors.keys().filter_map(|name| our_name(naming, name)).collect();
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
