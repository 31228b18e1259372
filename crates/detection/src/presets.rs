//! Ready configurations.

use crate::config::*;

const UNIT_WEIGHTS: BoxCoderConfig = BoxCoderConfig { weights: [1.0, 1.0, 1.0, 1.0] };
const ROI_WEIGHTS: BoxCoderConfig = BoxCoderConfig { weights: [10.0, 10.0, 5.0, 5.0] };

/// The default: a small detector for two CPU cores, trained from nothing in a few minutes.
///
/// Half-width ResNet-18 with group norm, a pyramid of 64 channels, 256-wide box head and four
/// 128-wide keypoint convolutions, at 320×240 px: 4.4 million parameters. Anchors and pooling
/// levels are laid out for parts of 20 to 250 px. Few proposals and ROIs are kept, because one
/// image shows at most a handful of parts.
pub fn edge(num_keypoints: usize) -> RcnnConfig {
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
            mean: [0.485, 0.456, 0.406],
            std: [0.229, 0.224, 0.225],
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
            num_classes: 1,
            matcher: MatcherConfig {
                negative_below: 0.5,
                positive_from: 0.5,
                low_quality: LowQualityMatches::Forbidden,
            },
            sampler: SamplerConfig { batch_size_per_image: 64, positive_fraction: 0.25 },
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
            keypoint_head: Some(KeypointHeadConfig {
                pooler: pooler(14),
                conv_channels: vec![128; 4],
                num_keypoints,
                max_train_rois_per_image: Some(6),
                loss_weight: 1.0,
                readout: KeypointReadout::LocalMean { radius: 3 },
                score: KeypointScore::NormalisedPeak,
            }),
        },
    }
}

/// The second stage of an [`r50_detectron2`] detector.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RcnnKind {
    /// Boxes and classes.
    Faster {
        /// Object classes, without background.
        num_classes: usize,
    },
    /// Boxes and keypoints of one class.
    Keypoint {
        /// Keypoints of an object.
        num_keypoints: usize,
    },
}

/// Detectron2's R50-FPN with its numerics, for imported weights.
///
/// # Source
/// `COCO-Detection/faster_rcnn_R_50_FPN_3x` and `COCO-Keypoints/keypoint_rcnn_R_50_FPN_3x`.
pub fn r50_detectron2(kind: RcnnKind) -> RcnnConfig {
    let pooler = |output_size| RoiPoolerConfig {
        output_size,
        alignment: RoiAlignment::HalfPixel,
        sampling_ratio: SamplingRatio::Adaptive,
        canonical_size_px: 224.0,
        canonical_level: 4,
        level_epsilon: LevelEpsilon::InsideLog(1e-8),
    };
    let (num_classes, post_nms_train, box_loss, keypoint_head) = match kind {
        RcnnKind::Faster { num_classes } => (num_classes, 1000, RegressionLoss::L1, None),
        RcnnKind::Keypoint { num_keypoints } => (
            1,
            1500,
            RegressionLoss::SmoothL1 { beta: 0.5 },
            Some(KeypointHeadConfig {
                pooler: pooler(14),
                conv_channels: vec![512; 8],
                num_keypoints,
                max_train_rois_per_image: None,
                loss_weight: 1.0,
                readout: KeypointReadout::BicubicArgmax,
                score: KeypointScore::NormalisedPeak,
            }),
        ),
    };
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
            post_nms_top_n: PerMode { train: post_nms_train, test: 1000 },
            nms_threshold: 0.7,
            min_box_size_px: 0.0,
            regression_loss: RegressionLoss::L1,
            normaliser: RpnNormaliser::NominalSamples,
        },
        roi_heads: RoiHeadsConfig {
            num_classes,
            matcher: MatcherConfig {
                negative_below: 0.5,
                positive_from: 0.5,
                low_quality: LowQualityMatches::Forbidden,
            },
            sampler: SamplerConfig { batch_size_per_image: 512, positive_fraction: 0.25 },
            box_head: BoxHeadConfig {
                pooler: pooler(7),
                fc_channels: 1024,
                background: BackgroundClass::Last,
                box_deltas: BoxDeltas::ClassSpecific,
                box_coder: ROI_WEIGHTS,
                regression_loss: box_loss,
                score_threshold: 0.05,
                nms_threshold: 0.5,
                detections_per_image: 100,
                min_box_size_px: 0.0,
            },
            keypoint_head,
        },
    }
}
