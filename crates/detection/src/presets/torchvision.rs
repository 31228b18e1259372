//! torchvision's R50-FPN.

use super::r50_detectron2;
use super::{IMAGENET_MEAN, IMAGENET_STD, RcnnKind};
use crate::config::*;

/// torchvision's R50-FPN with its numerics, for imported weights.
///
/// The layers are those of [`r50_detectron2`]; this file contains the differences. The frozen norms add nothing
/// to the variance, as in torchvision with its COCO weights.
///
/// # Source
/// `torchvision.models.detection`: `fasterrcnn_resnet50_fpn`, `maskrcnn_resnet50_fpn`, `keypointrcnn_resnet50_fpn`.
pub fn r50_torchvision(kind: RcnnKind) -> RcnnConfig {
    let pooler = |output_size| RoiPoolerConfig {
        output_size,
        alignment: RoiAlignment::Legacy,
        sampling_ratio: SamplingRatio::Fixed(2),
        canonical_size_px: 224.0,
        canonical_level: 4,
        level_epsilon: LevelEpsilon::OutsideLog(1e-6),
    };
    let smooth_l1 = RegressionLoss::SmoothL1 { beta: 1.0 / 9.0 };
    let base = r50_detectron2(kind);
    RcnnConfig {
        input: ImageTransformConfig {
            resize: ResizeRule::ShortSide { short_px: 800, max_long_px: 1333, rounding: SizeRounding::Floor },
            filter: ResizeFilter::Bilinear,
            channel_order: ChannelOrder::Rgb,
            pixel_range: PixelRange::Unit,
            mean: IMAGENET_MEAN,
            std: IMAGENET_STD,
            size_divisibility: 32,
        },
        backbone: ResNetConfig {
            block: BlockKind::Bottleneck { inner_channels: 64, stride_in: StrideIn::Conv3x3 },
            norm: NormKind::FrozenBatch { eps: 0.0 },
            ..base.backbone
        },
        fpn: base.fpn,
        anchors: AnchorConfig {
            rounding: AnchorRounding::Rounded,
            stride: AnchorStride::ImageOverGrid,
            ..base.anchors
        },
        rpn: RpnConfig {
            post_nms_top_n: PerMode { train: 2000, test: 1000 },
            min_box_size_px: 1e-3,
            regression_loss: smooth_l1,
            normaliser: RpnNormaliser::DrawnSamples,
            ..base.rpn
        },
        roi_heads: RoiHeadsConfig {
            box_head: BoxHeadConfig {
                pooler: pooler(7),
                background: BackgroundClass::First,
                regression_loss: smooth_l1,
                min_box_size_px: 1e-2,
                ..base.roi_heads.box_head
            },
            keypoint_head: base.roi_heads.keypoint_head.map(|head| KeypointHeadConfig {
                pooler: pooler(14),
                score: KeypointScore::Logit,
                ..head
            }),
            mask_head: base.roi_heads.mask_head.map(|head| MaskHeadConfig {
                pooler: pooler(14),
                targets: MaskTargets::Pooled,
                pasting: MaskPasting::WholePixels,
                ..head
            }),
            ..base.roi_heads
        },
    }
}
