//! Naming schemes: converts the names of other projects to this project's.
//!
//! Our names are Detectron2's, with two differences: the prefix `backbone.fpn.` of the pyramid's names, and
//! lists that count from 0 (`conv_fcn.0` for `conv_fcn1`).

use std::fmt;

use serde::Serialize;

/// The naming scheme of the tensors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Naming {
    /// This project: a file converted before.
    Ours,
    /// A Detectron2 detector.
    Detectron2,
    /// A Detectron2 backbone alone.
    Detectron2Backbone,
    /// A torchvision detector.
    Torchvision,
    /// A torchvision classifier; only its backbone is used.
    TorchvisionResnet,
    /// A Caffe2 classifier, such as the MSRA ResNet-50 that Detectron2 starts from.
    Caffe2Resnet,
}

/// The program whose weights a file contains. It determines the network's input image and the licence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Program {
    /// Detectron2, which also uses Caffe2's classifiers.
    Detectron2,
    /// torchvision.
    Torchvision,
}

/// The author in files of Detectron2's convert-torchvision-to-d2.py, which gives Detectron2's names to torchvision's
/// ResNets.
const TORCHVISION_AUTHOR: &str = "torchvision";

/// Prefixes that do not belong to a name: torch's parallel training adds `module.`, this project's grasp models
/// `network.`.
pub(crate) fn strip_wrapper(name: &str) -> &str {
    name.strip_prefix("module.").or_else(|| name.strip_prefix("network.")).unwrap_or(name)
}

/// The meaning of a name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Renamed {
    /// A parameter of this project's network.
    To(String),
    /// Known but not needed, such as an anchor or a counter.
    NotNeeded,
    /// No parameter of this project's network corresponds to it.
    Unknown,
}

impl fmt::Display for Naming {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Ours => "this project",
            Self::Detectron2 => "Detectron2",
            Self::Detectron2Backbone => "Detectron2 backbone",
            Self::Torchvision => "torchvision",
            Self::TorchvisionResnet => "torchvision ResNet",
            Self::Caffe2Resnet => "Caffe2 ResNet",
        })
    }
}

impl Naming {
    const ALL: [Self; 6] = [
        Self::Ours,
        Self::Detectron2,
        Self::Detectron2Backbone,
        Self::Torchvision,
        Self::TorchvisionResnet,
        Self::Caffe2Resnet,
    ];

    /// The scheme with this text, as displayed and as stored in a converted file.
    pub(crate) fn from_text(text: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|naming| naming.to_string() == text)
    }

    /// Recognises the scheme by typical names, which are checked in order.
    pub fn detect<'a>(names: impl Iterator<Item = &'a str> + Clone) -> Option<Self> {
        let any = |test: &dyn Fn(&str) -> bool| names.clone().any(test);
        if any(&|n| n.starts_with("backbone.fpn.fpn_")) {
            Some(Self::Ours)
        } else if any(&|n| n.starts_with("backbone.fpn_") || n.starts_with("proposal_generator.")) {
            Some(Self::Detectron2)
        } else if any(&|n| n.starts_with("backbone.body.") || n.starts_with("rpn.head.")) {
            Some(Self::Torchvision)
        } else if any(&|n| n.starts_with("backbone.bottom_up.stem.")) {
            Some(Self::Ours)
        } else if any(&|n| n == "stem.conv1.weight") {
            Some(Self::Detectron2Backbone)
        } else if any(&|n| n == "conv1.weight") && any(&|n| n.starts_with("layer1.")) {
            Some(Self::TorchvisionResnet)
        } else if any(&|n| n == "conv1_w") && any(&|n| n.starts_with("res2_0_")) {
            Some(Self::Caffe2Resnet)
        } else {
            None
        }
    }

    /// The program of the weights in a file by this author; `None` for this project's names.
    pub fn program(self, author: Option<&str>) -> Option<Program> {
        match self {
            Self::Detectron2Backbone if author == Some(TORCHVISION_AUTHOR) => Some(Program::Torchvision),
            Self::Detectron2 | Self::Detectron2Backbone | Self::Caffe2Resnet => Some(Program::Detectron2),
            Self::Torchvision | Self::TorchvisionResnet => Some(Program::Torchvision),
            Self::Ours => None,
        }
    }

    /// Whether the file contains a backbone and no detector.
    pub fn is_backbone_alone(self) -> bool {
        matches!(self, Self::Detectron2Backbone | Self::TorchvisionResnet | Self::Caffe2Resnet)
    }

    /// Whether class 0 is the background, as in torchvision, and its box deltas are in the file.
    pub fn background_is_first(self) -> bool {
        self == Self::Torchvision
    }

    /// Our name for a parameter of this scheme, if we have it.
    pub fn our_name(self, name: &str) -> Option<String> {
        match self.rename(strip_wrapper(name)) {
            Renamed::To(ours) => Some(ours),
            Renamed::NotNeeded | Renamed::Unknown => None,
        }
    }

    /// Converts a name of this scheme to ours.
    pub(crate) fn rename(self, name: &str) -> Renamed {
        if name.ends_with(".num_batches_tracked") {
            return Renamed::NotNeeded;
        }
        let ours = match self {
            Self::Ours => Some(name.to_owned()),
            Self::Detectron2 => return detectron2(name),
            Self::Detectron2Backbone => resnet_part(name).then(|| format!("backbone.bottom_up.{name}")),
            Self::Torchvision => torchvision(name),
            Self::TorchvisionResnet => torchvision_resnet(name),
            Self::Caffe2Resnet => return caffe2_resnet(name),
        };
        ours.map_or(Renamed::Unknown, Renamed::To)
    }
}

/// Whether a name of Detectron2's ResNet belongs to the stages that a detector has.
fn resnet_part(name: &str) -> bool {
    ["stem.", "res2.", "res3.", "res4.", "res5."].iter().any(|part| name.starts_with(part))
}

/// A number up to the next dot, and the text after the dot.
fn number_and_rest(text: &str) -> Option<(usize, &str)> {
    let (number, rest) = text.split_once('.')?;
    // At most three digits, which suffice for any network and cannot overflow.
    let valid = number.len() <= 3 && number.bytes().all(|byte| byte.is_ascii_digit());
    Some((number.parse().ok().filter(|_| valid)?, rest))
}

/// A list that counts from 1 in its names (`conv_fcn1.`) becomes one that counts from 0 (`conv_fcn.0.`).
fn from_zero(name: &str, prefix: &str) -> Option<String> {
    let (number, rest) = number_and_rest(name.strip_prefix(prefix)?)?;
    Some(format!("{prefix}.{}.{rest}", number.checked_sub(1)?))
}

fn detectron2(name: &str) -> Renamed {
    let not_needed = ["proposal_generator.anchor_generator.", "anchor_generator.", "pixel_mean", "pixel_std"];
    if not_needed.iter().any(|prefix| name.starts_with(prefix)) {
        return Renamed::NotNeeded;
    }
    if let Some(pyramid) = name.strip_prefix("backbone.fpn_") {
        return Renamed::To(format!("backbone.fpn.fpn_{pyramid}"));
    }
    for prefix in ["roi_heads.keypoint_head.conv_fcn", "roi_heads.mask_head.mask_fcn"] {
        if let Some(ours) = from_zero(name, prefix) {
            return Renamed::To(ours);
        }
    }
    let known = ["backbone.bottom_up.", "proposal_generator.rpn_head.", "roi_heads."];
    match known.iter().any(|prefix| name.starts_with(prefix)) {
        true => Renamed::To(name.to_owned()),
        false => Renamed::Unknown,
    }
}

fn torchvision(name: &str) -> Option<String> {
    if let Some(body) = name.strip_prefix("backbone.body.") {
        return torchvision_resnet(body);
    }
    if let Some(pyramid) = name.strip_prefix("backbone.fpn.") {
        let (kind, rest) = pyramid.split_once('.')?;
        let kind = match kind {
            "inner_blocks" => "fpn_lateral",
            "layer_blocks" => "fpn_output",
            _ => return None,
        };
        let (level, rest) = number_and_rest(rest)?;
        return Some(format!("backbone.fpn.{kind}{}.{}", level + 2, conv_or_norm(rest)));
    }
    if let Some(head) = name.strip_prefix("rpn.head.") {
        let (layer, rest) = head.split_once('.')?;
        let (layer, rest) = match layer {
            "conv" => ("conv", rest.strip_prefix("0.0.").unwrap_or(rest)),
            "cls_logits" => ("objectness_logits", rest),
            "bbox_pred" => ("anchor_deltas", rest),
            _ => return None,
        };
        return Some(format!("proposal_generator.rpn_head.{layer}.{rest}"));
    }
    let head = name.strip_prefix("roi_heads.")?;
    let renamed = [
        ("box_head.fc6.", "box_head.fc1."),
        ("box_head.fc7.", "box_head.fc2."),
        ("box_predictor.", "box_predictor."),
        ("keypoint_predictor.kps_score_lowres.", "keypoint_head.score_lowres."),
        ("mask_predictor.conv5_mask.", "mask_head.deconv."),
        ("mask_predictor.mask_fcn_logits.", "mask_head.predictor."),
    ];
    for (theirs, ours) in renamed {
        if let Some(rest) = head.strip_prefix(theirs) {
            return Some(format!("roi_heads.{ours}{rest}"));
        }
    }
    if let Some(ours) = from_zero(head, "mask_head.mask_fcn") {
        return Some(format!("roi_heads.{ours}"));
    }
    if let Some((layer, rest)) = head.strip_prefix("mask_head.").and_then(number_and_rest) {
        return Some(format!("roi_heads.mask_head.mask_fcn.{layer}.{}", rest.strip_prefix("0.")?));
    }
    // Every second module of the sequence is a ReLU.
    let (module, rest) = number_and_rest(head.strip_prefix("keypoint_head.")?)?;
    module.is_multiple_of(2).then(|| format!("roi_heads.keypoint_head.conv_fcn.{}.{rest}", module / 2))
}

/// Newer torchvision wraps a convolution and its norm: `0.weight` is the convolution's, `1.weight` the norm's.
fn conv_or_norm(rest: &str) -> String {
    match (rest.strip_prefix("0."), rest.strip_prefix("1.")) {
        (Some(conv), _) => conv.to_owned(),
        (None, Some(norm)) => format!("norm.{norm}"),
        _ => rest.to_owned(),
    }
}

fn torchvision_resnet(name: &str) -> Option<String> {
    if let Some(rest) = name.strip_prefix("conv1.") {
        return Some(format!("backbone.bottom_up.stem.conv1.{rest}"));
    }
    if let Some(rest) = name.strip_prefix("bn1.") {
        return Some(format!("backbone.bottom_up.stem.conv1.norm.{rest}"));
    }
    let (layer, rest) = number_and_rest(name.strip_prefix("layer")?)?;
    let (block, rest) = number_and_rest(rest)?;
    if !(1..=4).contains(&layer) {
        return None;
    }
    let inner = if let Some(rest) = rest.strip_prefix("downsample.") {
        format!("shortcut.{}", conv_or_norm(rest))
    } else if let Some((number, rest)) = rest.strip_prefix("bn").and_then(number_and_rest) {
        format!("conv{number}.norm.{rest}")
    } else {
        let (number, rest) = number_and_rest(rest.strip_prefix("conv")?)?;
        format!("conv{number}.{rest}")
    };
    Some(format!("backbone.bottom_up.res{}.{block}.{inner}", layer + 1))
}

/// Caffe2 writes `res2_0_branch2a_w` and `res2_0_branch2a_bn_s`. A norm has scale (`s`) and shift (`b`), and possibly a
/// running mean (`rm`) and variance (`riv`).
fn caffe2_resnet(name: &str) -> Renamed {
    if name.ends_with("_momentum") || matches!(name, "fc1000_w" | "fc1000_b" | "pred_w" | "pred_b") {
        return Renamed::NotNeeded;
    }
    caffe2_parameter(name).map_or(Renamed::Unknown, Renamed::To)
}

fn caffe2_parameter(name: &str) -> Option<String> {
    let suffixes = [
        ("_bn_s", "norm.weight"),
        ("_bn_b", "norm.bias"),
        ("_bn_rm", "norm.running_mean"),
        ("_bn_riv", "norm.running_var"),
        ("_w", "weight"),
    ];
    let (layer, parameter) =
        suffixes.iter().find_map(|(theirs, ours)| name.strip_suffix(theirs).map(|layer| (layer, ours)))?;
    if matches!(layer, "conv1" | "res_conv1") {
        return Some(format!("backbone.bottom_up.stem.conv1.{parameter}"));
    }
    let mut parts = layer.strip_prefix("res")?.split('_');
    let (stage, block, branch) = (parts.next()?, parts.next()?, parts.next()?);
    let is_small = |text: &str| text.len() <= 3 && text.bytes().all(|byte| byte.is_ascii_digit());
    if !matches!(stage, "2" | "3" | "4" | "5") || !is_small(block) || parts.next().is_some() {
        return None;
    }
    let layer = match branch {
        "branch1" => "shortcut",
        "branch2a" => "conv1",
        "branch2b" => "conv2",
        "branch2c" => "conv3",
        _ => return None,
    };
    Some(format!("backbone.bottom_up.res{stage}.{block}.{layer}.{parameter}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn to(naming: Naming, name: &str) -> String {
        match naming.rename(name) {
            Renamed::To(ours) => ours,
            other => format!("{other:?}"),
        }
    }

    #[test]
    fn detectron2_s_names() {
        for (theirs, ours) in [
            ("backbone.fpn_lateral3.weight", "backbone.fpn.fpn_lateral3.weight"),
            ("backbone.bottom_up.res4.1.conv2.norm.bias", "backbone.bottom_up.res4.1.conv2.norm.bias"),
            ("roi_heads.keypoint_head.conv_fcn8.bias", "roi_heads.keypoint_head.conv_fcn.7.bias"),
            ("roi_heads.mask_head.mask_fcn1.weight", "roi_heads.mask_head.mask_fcn.0.weight"),
            ("roi_heads.mask_head.deconv.bias", "roi_heads.mask_head.deconv.bias"),
            ("proposal_generator.anchor_generator.cell_anchors.0", "NotNeeded"),
            ("optimizer.state", "Unknown"),
        ] {
            assert_eq!(to(Naming::Detectron2, theirs), ours);
        }
    }

    #[test]
    fn torchvision_s_names_old_and_new() {
        for (theirs, ours) in [
            ("backbone.body.conv1.weight", "backbone.bottom_up.stem.conv1.weight"),
            ("backbone.body.bn1.running_var", "backbone.bottom_up.stem.conv1.norm.running_var"),
            ("backbone.body.layer1.2.conv3.weight", "backbone.bottom_up.res2.2.conv3.weight"),
            ("backbone.body.layer4.0.bn2.bias", "backbone.bottom_up.res5.0.conv2.norm.bias"),
            ("backbone.body.layer2.0.downsample.0.weight", "backbone.bottom_up.res3.0.shortcut.weight"),
            ("backbone.body.layer2.0.downsample.1.bias", "backbone.bottom_up.res3.0.shortcut.norm.bias"),
            ("backbone.body.layer1.0.bn1.num_batches_tracked", "NotNeeded"),
            ("backbone.fpn.inner_blocks.0.weight", "backbone.fpn.fpn_lateral2.weight"),
            ("backbone.fpn.layer_blocks.3.0.bias", "backbone.fpn.fpn_output5.bias"),
            ("rpn.head.conv.weight", "proposal_generator.rpn_head.conv.weight"),
            ("rpn.head.conv.0.0.bias", "proposal_generator.rpn_head.conv.bias"),
            ("rpn.head.cls_logits.bias", "proposal_generator.rpn_head.objectness_logits.bias"),
            ("rpn.head.bbox_pred.weight", "proposal_generator.rpn_head.anchor_deltas.weight"),
            ("roi_heads.box_head.fc7.bias", "roi_heads.box_head.fc2.bias"),
            ("roi_heads.keypoint_head.14.weight", "roi_heads.keypoint_head.conv_fcn.7.weight"),
            ("roi_heads.keypoint_head.3.weight", "Unknown"),
            ("roi_heads.keypoint_predictor.kps_score_lowres.bias", "roi_heads.keypoint_head.score_lowres.bias"),
            ("roi_heads.mask_head.mask_fcn4.bias", "roi_heads.mask_head.mask_fcn.3.bias"),
            ("roi_heads.mask_head.3.0.bias", "roi_heads.mask_head.mask_fcn.3.bias"),
            ("roi_heads.mask_predictor.conv5_mask.weight", "roi_heads.mask_head.deconv.weight"),
            ("roi_heads.mask_predictor.mask_fcn_logits.bias", "roi_heads.mask_head.predictor.bias"),
            ("backbone.body.layer5.0.conv1.weight", "Unknown"),
        ] {
            assert_eq!(to(Naming::Torchvision, theirs), ours, "{theirs}");
        }
    }

    #[test]
    fn caffe2_s_names() {
        for (theirs, ours) in [
            ("conv1_w", "backbone.bottom_up.stem.conv1.weight"),
            ("res_conv1_bn_s", "backbone.bottom_up.stem.conv1.norm.weight"),
            ("res2_0_branch1_bn_b", "backbone.bottom_up.res2.0.shortcut.norm.bias"),
            ("res5_2_branch2c_w", "backbone.bottom_up.res5.2.conv3.weight"),
            ("res4_5_branch2a_bn_s", "backbone.bottom_up.res4.5.conv1.norm.weight"),
            ("fc1000_w", "NotNeeded"),
            ("conv1_w_momentum", "NotNeeded"),
            ("res6_0_branch1_w", "Unknown"),
        ] {
            assert_eq!(to(Naming::Caffe2Resnet, theirs), ours, "{theirs}");
        }
    }

    #[test]
    fn schemes_are_told_apart() {
        let detect = |names: &[&'static str]| Naming::detect(names.iter().copied());
        assert_eq!(
            detect(&["backbone.bottom_up.stem.conv1.weight", "backbone.fpn_lateral2.bias"]),
            Some(Naming::Detectron2)
        );
        assert_eq!(detect(&["backbone.bottom_up.stem.conv1.weight"]), Some(Naming::Ours));
        assert_eq!(detect(&["rpn.head.conv.bias"]), Some(Naming::Torchvision));
        assert_eq!(detect(&["conv1.weight", "layer1.0.bn1.weight"]), Some(Naming::TorchvisionResnet));
        assert_eq!(detect(&["conv1_w", "res2_0_branch1_w"]), Some(Naming::Caffe2Resnet));
        assert_eq!(detect(&["stem.conv1.weight"]), Some(Naming::Detectron2Backbone));
        assert_eq!(detect(&["encoder.weight"]), None);
    }
}
