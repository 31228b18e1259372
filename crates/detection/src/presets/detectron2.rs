//! Detectron2's R50-FPN.

use super::{ROI_WEIGHTS, RcnnKind, UNIT_WEIGHTS};
use crate::config::*;

/// Detectron2's R50-FPN with its numerics, for imported weights.
///
/// # Source
/// `COCO-Detection/faster_rcnn_R_50_FPN_3x`, `COCO-Keypoints/keypoint_rcnn_R_50_FPN_3x` and
/// `COCO-InstanceSegmentation/mask_rcnn_R_50_FPN_3x`.
pub fn r50_detectron2(kind: RcnnKind) -> RcnnConfig {
    let pooler = |output_size| RoiPoolerConfig {
        output_size,
        alignment: RoiAlignment::HalfPixel,
        sampling_ratio: SamplingRatio::Adaptive,
        canonical_size_px: 224.0,
        canonical_level: 4,
        level_epsilon: LevelEpsilon::InsideLog(1e-8),
    };
    let is_keypoint = matches!(kind, RcnnKind::Keypoint { .. });
    RcnnConfig {
        input: ImageTransformConfig {
            resize: ResizeRule::ShortSide { short_px: 800, max_long_px: 1333, rounding: SizeRounding::Nearest },
            filter: ResizeFilter::AntialiasedBytes,
            channel_order: ChannelOrder::Bgr,
            pixel_range: PixelRange::Byte,
            mean: [103.530, 116.280, 123.675],
            std: [1.0, 1.0, 1.0],
            size_divisibility: 32,
        },
        backbone: ResNetConfig {
            stem_channels: 64,
            res2_channels: 256,
            num_blocks: [3, 4, 6, 3],
            block: BlockKind::Bottleneck { inner_channels: 64, stride_in: StrideIn::Conv1x1 },
            norm: NormKind::FrozenBatch { eps: 1e-5 },
            freeze: Freeze::ThroughRes2,
        },
        fpn: FpnConfig { channels: 256, norm: NormKind::Identity },
        anchors: AnchorConfig {
            sizes_px: [32.0, 64.0, 128.0, 256.0, 512.0],
            aspect_ratios: vec![0.5, 1.0, 2.0],
            offset: 0.0,
            rounding: AnchorRounding::Exact,
            stride: AnchorStride::Nominal,
        },
        rpn: RpnConfig {
            matcher: MatcherConfig { negative_below: 0.3, positive_from: 0.7, low_quality: LowQualityMatches::Allowed },
            sampler: SamplerConfig { batch_size_per_image: 256, positive_fraction: 0.5 },
            box_coder: UNIT_WEIGHTS,
            pre_nms_top_n: PerMode { train: 2000, test: 1000 },
            post_nms_top_n: PerMode { train: if is_keypoint { 1500 } else { 1000 }, test: 1000 },
            nms_threshold: 0.7,
            min_box_size_px: 0.0,
            regression_loss: RegressionLoss::L1,
            normaliser: RpnNormaliser::NominalSamples,
        },
        roi_heads: RoiHeadsConfig {
            num_classes: kind.num_classes(),
            matcher: MatcherConfig {
                negative_below: 0.5,
                positive_from: 0.5,
                low_quality: LowQualityMatches::Forbidden,
            },
            sampler: SamplerConfig { batch_size_per_image: 512, positive_fraction: 0.25 },
            hard_negative_share: 0.0,
            box_head: BoxHeadConfig {
                pooler: pooler(7),
                fc_channels: 1024,
                background: BackgroundClass::Last,
                box_deltas: BoxDeltas::ClassSpecific,
                box_coder: ROI_WEIGHTS,
                regression_loss: if is_keypoint { RegressionLoss::SmoothL1 { beta: 0.5 } } else { RegressionLoss::L1 },
                score_threshold: 0.05,
                nms_threshold: 0.5,
                detections_per_image: 100,
                min_box_size_px: 0.0,
            },
            keypoint_head: match kind {
                RcnnKind::Keypoint { num_keypoints } => Some(KeypointHeadConfig {
                    pooler: pooler(14),
                    conv_channels: vec![512; 8],
                    num_keypoints,
                    max_train_rois_per_image: None,
                    loss_weight: 1.0,
                    readout: KeypointReadout::BicubicArgmax,
                    score: KeypointScore::NormalisedPeak,
                }),
                _ => None,
            },
            mask_head: match kind {
                RcnnKind::Mask { .. } => Some(MaskHeadConfig {
                    pooler: pooler(14),
                    conv_channels: vec![256; 4],
                    deconv_channels: 256,
                    max_train_rois_per_image: None,
                    loss_weight: 1.0,
                    balance: MaskBalance::Cells,
                    targets: MaskTargets::Rasterized,
                    pasting: MaskPasting::PixelCenters,
                    threshold: 0.5,
                }),
                _ => None,
            },
        },
    }
}
