//! The network to fill: its parameters and their shapes.
//!
//! Plain numbers, so that names and shapes are known without building the network (and without burn). Crate `inputs`
//! converts a detector's configuration to an [`Architecture`]; a test there compares the parameters with those of a
//! built detector.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::error::{Result, WeightsError};

/// Norm after a convolution, with the parameters that it has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Norm {
    /// None: the convolution has a bias.
    None,
    /// Weight and bias.
    Affine,
    /// Weight, bias, stored mean and variance.
    Stored,
}

/// Kind of residual block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Block {
    /// Two 3×3 convolutions.
    Basic,
    /// 1×1, 3×3 and 1×1 convolution.
    Bottleneck {
        /// Channels of the inner convolutions in res2; doubled in each later stage.
        inner_channels: usize,
    },
}

/// Position of the background among the classes, and the classes that have box deltas.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Background {
    /// Class 0, with its own unused box deltas and mask: torchvision.
    First,
    /// Class K, without box deltas: Detectron2.
    Last,
}

/// The residual network.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Backbone {
    /// Channels after the 7×7 stem.
    pub stem_channels: usize,
    /// Output channels of res2; doubled in each later stage.
    pub res2_channels: usize,
    /// Blocks in res2, res3, res4, res5.
    pub num_blocks: [usize; 4],
    /// Kind of block.
    pub block: Block,
    /// Norm after every convolution.
    pub norm: Norm,
}

/// The keypoint head.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct KeypointHead {
    /// Channels of each 3×3 convolution.
    pub conv_channels: Vec<usize>,
    /// Keypoints per object.
    pub num_keypoints: usize,
}

/// The mask head.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct MaskHead {
    /// Channels of each 3×3 convolution.
    pub conv_channels: Vec<usize>,
    /// Channels of the transposed convolution.
    pub deconv_channels: usize,
    /// Masks per box: one for each class (and the background, if it comes first).
    pub num_masks: usize,
}

/// The parts of a detector besides its backbone.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Heads {
    /// Channels of the pyramid.
    pub fpn_channels: usize,
    /// Norm of the pyramid's convolutions.
    pub fpn_norm: Norm,
    /// Anchors per position.
    pub num_anchors: usize,
    /// Side of the box head's pooled square.
    pub box_pooled_size: usize,
    /// Width of the two fully connected layers.
    pub fc_channels: usize,
    /// Object classes, without background.
    pub num_classes: usize,
    /// Position of the background class.
    pub background: Background,
    /// Whether each class has its own box deltas.
    pub class_specific_boxes: bool,
    /// The keypoint head, if there is one.
    pub keypoint: Option<KeypointHead>,
    /// The mask head, if there is one.
    pub mask: Option<MaskHead>,
}

/// A detector, or only a backbone.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Architecture {
    /// The residual network.
    pub backbone: Backbone,
    /// The rest of a detector.
    pub heads: Option<Heads>,
}

/// Shapes of parameters by name.
pub type Parameters = BTreeMap<String, Vec<usize>>;

impl Background {
    fn num_delta_columns(self, num_classes: usize) -> usize {
        num_classes + usize::from(self == Self::First)
    }
}

impl Backbone {
    /// ResNet-18, -34 or -50 with stored norms, as ImageNet classifiers have them.
    ///
    /// # Errors
    /// Another depth.
    pub fn resnet(depth: usize) -> Result<Self> {
        let (num_blocks, block, res2_channels) = match depth {
            18 => ([2, 2, 2, 2], Block::Basic, 64),
            34 => ([3, 4, 6, 3], Block::Basic, 64),
            50 => ([3, 4, 6, 3], Block::Bottleneck { inner_channels: 64 }, 256),
            other => {
                let (part, expected) = ("backbone", "a ResNet of depth 18, 34 or 50".to_owned());
                return Err(WeightsError::Architecture { part, expected, found: other.to_string() });
            }
        };
        Ok(Self { stem_channels: 64, res2_channels, num_blocks, block, norm: Norm::Stored })
    }

    fn list(&self, parameters: &mut Parameters) {
        let mut conv = |name: String, out_channels, in_channels, kernel| {
            list_conv(
                parameters,
                &format!("backbone.bottom_up.{name}"),
                [out_channels, in_channels, kernel],
                self.norm,
            );
        };
        conv("stem.conv1".to_owned(), self.stem_channels, 3, 7);
        let mut in_channels = self.stem_channels;
        for (stage, &num_blocks) in self.num_blocks.iter().enumerate() {
            let out_channels = self.res2_channels << stage;
            for block in 0..num_blocks {
                let name = format!("res{}.{block}", stage + 2);
                match self.block {
                    Block::Basic => {
                        conv(format!("{name}.conv1"), out_channels, in_channels, 3);
                        conv(format!("{name}.conv2"), out_channels, out_channels, 3);
                    }
                    Block::Bottleneck { inner_channels } => {
                        let inner = inner_channels << stage;
                        conv(format!("{name}.conv1"), inner, in_channels, 1);
                        conv(format!("{name}.conv2"), inner, inner, 3);
                        conv(format!("{name}.conv3"), out_channels, inner, 1);
                    }
                }
                // Every stage but res2 halves the resolution in its first block.
                if in_channels != out_channels || (stage > 0 && block == 0) {
                    conv(format!("{name}.shortcut"), out_channels, in_channels, 1);
                }
                in_channels = out_channels;
            }
        }
    }
}

/// `[out, in, kernel]` of a convolution, and its norm or bias.
fn list_conv(parameters: &mut Parameters, name: &str, [out, input, kernel]: [usize; 3], norm: Norm) {
    parameters.insert(format!("{name}.weight"), vec![out, input, kernel, kernel]);
    let behind: &[&str] = match norm {
        Norm::None => &["bias"],
        Norm::Affine => &["norm.weight", "norm.bias"],
        Norm::Stored => &["norm.weight", "norm.bias", "norm.running_mean", "norm.running_var"],
    };
    for parameter in behind {
        parameters.insert(format!("{name}.{parameter}"), vec![out]);
    }
}

impl Heads {
    fn list(&self, stage_channels: [usize; 4], parameters: &mut Parameters) {
        let channels = self.fpn_channels;
        for (level, stage) in (2..).zip(stage_channels) {
            let lateral = format!("backbone.fpn.fpn_lateral{level}");
            list_conv(parameters, &lateral, [channels, stage, 1], self.fpn_norm);
            list_conv(parameters, &format!("backbone.fpn.fpn_output{level}"), [channels, channels, 3], self.fpn_norm);
        }
        let rpn = "proposal_generator.rpn_head";
        list_conv(parameters, &format!("{rpn}.conv"), [channels, channels, 3], Norm::None);
        list_conv(parameters, &format!("{rpn}.objectness_logits"), [self.num_anchors, channels, 1], Norm::None);
        list_conv(parameters, &format!("{rpn}.anchor_deltas"), [4 * self.num_anchors, channels, 1], Norm::None);

        let mut linear = |name: &str, outputs: usize, inputs: usize| {
            parameters.insert(format!("roi_heads.{name}.weight"), vec![outputs, inputs]);
            parameters.insert(format!("roi_heads.{name}.bias"), vec![outputs]);
        };
        let columns = match self.class_specific_boxes {
            true => self.background.num_delta_columns(self.num_classes),
            false => 1,
        };
        linear("box_head.fc1", self.fc_channels, channels * self.box_pooled_size * self.box_pooled_size);
        linear("box_head.fc2", self.fc_channels, self.fc_channels);
        linear("box_predictor.cls_score", self.num_classes + 1, self.fc_channels);
        linear("box_predictor.bbox_pred", 4 * columns, self.fc_channels);

        if let Some(head) = &self.keypoint {
            let last = list_convs(parameters, "roi_heads.keypoint_head.conv_fcn", channels, &head.conv_channels);
            list_transposed(parameters, "roi_heads.keypoint_head.score_lowres", [last, head.num_keypoints, 4]);
        }
        if let Some(head) = &self.mask {
            let last = list_convs(parameters, "roi_heads.mask_head.mask_fcn", channels, &head.conv_channels);
            list_transposed(parameters, "roi_heads.mask_head.deconv", [last, head.deconv_channels, 2]);
            let predictor = [head.num_masks, head.deconv_channels, 1];
            list_conv(parameters, "roi_heads.mask_head.predictor", predictor, Norm::None);
        }
    }
}

/// A sequence of 3×3 convolutions; returns the channels of the last one.
fn list_convs(parameters: &mut Parameters, name: &str, mut channels: usize, conv_channels: &[usize]) -> usize {
    for (i, &out_channels) in conv_channels.iter().enumerate() {
        list_conv(parameters, &format!("{name}.{i}"), [out_channels, channels, 3], Norm::None);
        channels = out_channels;
    }
    channels
}

/// `[in, out, kernel]` of a transposed convolution.
fn list_transposed(parameters: &mut Parameters, name: &str, [input, out, kernel]: [usize; 3]) {
    parameters.insert(format!("{name}.weight"), vec![input, out, kernel, kernel]);
    parameters.insert(format!("{name}.bias"), vec![out]);
}

impl Architecture {
    /// All parameters.
    pub fn parameters(&self) -> Parameters {
        let mut parameters = Parameters::new();
        self.backbone.list(&mut parameters);
        if let Some(heads) = &self.heads {
            let stage_channels = [1, 2, 4, 8].map(|factor| self.backbone.res2_channels * factor);
            heads.list(stage_channels, &mut parameters);
        }
        parameters
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resnet_50_has_the_parameters_that_everybody_counts() {
        let backbone = Backbone::resnet(50).unwrap();
        let parameters = Architecture { backbone, heads: None }.parameters();
        let count = |test: &dyn Fn(&str) -> bool| -> usize {
            parameters.iter().filter(|(name, _)| test(name)).map(|(_, shape)| shape.iter().product::<usize>()).sum()
        };
        // 25 557 032 minus the classifier's 2 049 000.
        assert_eq!(count(&|name| !name.contains("running_")), 23_508_032);
        assert_eq!(parameters["backbone.bottom_up.res3.0.shortcut.weight"], [512, 256, 1, 1]);
        assert!(!parameters.contains_key("backbone.bottom_up.res3.1.shortcut.weight"));
    }

    #[test]
    fn resnet_18_and_34_too() {
        for (depth, classifier) in [(18, 11_689_512), (34, 21_797_672)] {
            let parameters = Architecture { backbone: Backbone::resnet(depth).unwrap(), heads: None }.parameters();
            let learnt = parameters.iter().filter(|(name, _)| !name.contains("running_"));
            let count: usize = learnt.map(|(_, shape)| shape.iter().product::<usize>()).sum();
            assert_eq!(count + 513_000, classifier);
        }
        assert!(Backbone::resnet(77).is_err());
    }
}
