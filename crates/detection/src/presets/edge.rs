//! The detector for two cores.

use super::{IMAGENET_MEAN, IMAGENET_STD, ROI_WEIGHTS, RcnnKind, UNIT_WEIGHTS};
use crate::config::*;

/// The default with keypoints: [`edge_of`] for a keypoint detector.
pub fn edge(num_keypoints: usize) -> RcnnConfig {
    edge_of(RcnnKind::Keypoint { num_keypoints })
}

/// The default: a small detector for two CPU cores, trained from random values in a few minutes.
///
/// Half-width ResNet-18 with group norm, a pyramid of 64 channels, 256-wide box head and four 128-wide keypoint or
/// 64-wide mask convolutions, at 320×240 px: 4.4 million parameters with keypoints. Anchors and pooling levels are
/// chosen for parts of 20 to 250 px. Few proposals and ROIs are kept, because one image shows at most a handful of
/// parts.
pub fn edge_of(kind: RcnnKind) -> RcnnConfig {
    let pooler = |output_size| RoiPoolerConfig {
        output_size,
        alignment: RoiAlignment::HalfPixel,
        sampling_ratio: SamplingRatio::Fixed(2),
        canonical_size_px: 112.0,
        canonical_level: 4,
        level_epsilon: LevelEpsilon::InsideLog(1e-8),
    };
    RcnnConfig {
        input: ImageTransformConfig {
            resize: ResizeRule::FitWithin { width_px: 320, height_px: 240 },
            filter: ResizeFilter::AntialiasedBytes,
            channel_order: ChannelOrder::Rgb,
            pixel_range: PixelRange::Unit,
            mean: IMAGENET_MEAN,
            std: IMAGENET_STD,
            size_divisibility: 32,
        },
        backbone: ResNetConfig {
            stem_channels: 32,
            res2_channels: 32,
            num_blocks: [2, 2, 2, 2],
            block: BlockKind::Basic,
            norm: NormKind::Group { num_groups: 8 },
            freeze: Freeze::Nothing,
        },
        fpn: FpnConfig { channels: 64, norm: NormKind::Identity },
        anchors: AnchorConfig {
            sizes_px: [24.0, 40.0, 70.0, 120.0, 200.0],
            aspect_ratios: vec![0.5, 1.0, 2.0],
            offset: 0.0,
            rounding: AnchorRounding::Exact,
            stride: AnchorStride::Nominal,
        },
        rpn: RpnConfig {
            matcher: MatcherConfig { negative_below: 0.3, positive_from: 0.7, low_quality: LowQualityMatches::Allowed },
            sampler: SamplerConfig { batch_size_per_image: 128, positive_fraction: 0.5 },
            box_coder: UNIT_WEIGHTS,
            pre_nms_top_n: PerMode { train: 200, test: 100 },
            post_nms_top_n: PerMode { train: 100, test: 30 },
            nms_threshold: 0.7,
            min_box_size_px: 0.0,
            regression_loss: RegressionLoss::SmoothL1 { beta: 1.0 / 9.0 },
            normaliser: RpnNormaliser::DrawnSamples,
        },
        roi_heads: RoiHeadsConfig {
            num_classes: kind.num_classes(),
            matcher: MatcherConfig {
                negative_below: 0.5,
                positive_from: 0.5,
                low_quality: LowQualityMatches::Forbidden,
            },
            sampler: SamplerConfig { batch_size_per_image: 32, positive_fraction: 0.25 },
            hard_negative_share: 0.0,
            box_head: BoxHeadConfig {
                pooler: pooler(7),
                fc_channels: 256,
                background: BackgroundClass::Last,
                box_deltas: BoxDeltas::ClassSpecific,
                box_coder: ROI_WEIGHTS,
                regression_loss: RegressionLoss::SmoothL1 { beta: 1.0 / 9.0 },
                score_threshold: 0.05,
                nms_threshold: 0.5,
                detections_per_image: 5,
                min_box_size_px: 0.0,
            },
            keypoint_head: match kind {
                RcnnKind::Keypoint { num_keypoints } => Some(KeypointHeadConfig {
                    pooler: pooler(14),
                    conv_channels: vec![128; 4],
                    num_keypoints,
                    max_train_rois_per_image: Some(2),
                    loss_weight: 1.0,
                    readout: KeypointReadout::LocalMean { radius: 3 },
                    score: KeypointScore::NormalisedPeak,
                }),
                _ => None,
            },
            mask_head: match kind {
                RcnnKind::Mask { .. } => Some(MaskHeadConfig {
                    pooler: pooler(14),
                    conv_channels: vec![64; 4],
                    deconv_channels: 64,
                    max_train_rois_per_image: Some(8),
                    loss_weight: 1.0,
                    balance: MaskBalance::ThinParts,
                    targets: MaskTargets::Rasterized,
                    pasting: MaskPasting::PixelCenters,
                    threshold: 0.5,
                }),
                _ => None,
            },
        },
    }
}
