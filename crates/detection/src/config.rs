//! The configuration of a detector, with the settings in which R-CNN implementations differ.
//!
//! Each enum names a choice that a bare bool or number would hide; the two values of most choices are Detectron2's and
//! torchvision's. A configuration is plain data that can be serialised, so a model file can contain the configuration
//! of its training.

mod mask_head;
mod roi_pooler;

use serde::{Deserialize, Serialize};

pub use mask_head::{MaskBalance, MaskHeadConfig, MaskPasting, MaskTargets};
pub use roi_pooler::{LevelEpsilon, RoiAlignment, RoiPoolerConfig, SamplingRatio};
pub use sdg_layers::NormKind;

/// The whole detector.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RcnnConfig {
    /// Conversion of the given image to the network's input.
    pub input: ImageTransformConfig,
    /// The residual network, which is the bottom-up path of the feature pyramid.
    pub backbone: ResNetConfig,
    /// The feature pyramid.
    pub fpn: FpnConfig,
    /// The anchors of the region proposal network.
    pub anchors: AnchorConfig,
    /// The region proposal network.
    pub rpn: RpnConfig,
    /// The second stage.
    pub roi_heads: RoiHeadsConfig,
}

/// Order of the channels in the network's input tensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum ChannelOrder {
    /// Red first: torchvision.
    Rgb,
    /// Blue first: Detectron2.
    Bgr,
}

/// Range of a channel before the mean is subtracted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum PixelRange {
    /// 0 to 255: Detectron2.
    Byte,
    /// 0 to 1: torchvision.
    Unit,
}

/// How an image is resampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum ResizeFilter {
    /// A triangle filter that widens when shrinking, rounded to bytes after each pass: Pillow's `BILINEAR`, which
    /// Detectron2 uses.
    AntialiasedBytes,
    /// Two by two neighbours at any scale, not rounded: `torch.nn.functional.interpolate`, which torchvision uses.
    Bilinear,
}

/// The size to which an image is resized, aspect ratio kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum ResizeRule {
    /// Short side to `short_px` unless the long side would exceed `max_long_px`.
    ShortSide {
        /// Short side after resizing, in pixels.
        short_px: u32,
        /// Maximum long side, in pixels.
        max_long_px: u32,
        /// Rounding of the exact size to whole pixels.
        rounding: SizeRounding,
    },
    /// The largest size within `width_px` by `height_px`, rounded to the nearest pixel.
    FitWithin {
        /// Maximum width, in pixels.
        width_px: u32,
        /// Maximum height, in pixels.
        height_px: u32,
    },
}

/// Rounding of an exact size to whole pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum SizeRounding {
    /// `int(x + 0.5)`: Detectron2.
    Nearest,
    /// `floor(x)`: torchvision.
    Floor,
}

/// Resizing, channel order, normalisation and padding of images.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ImageTransformConfig {
    /// Size of the resized image.
    pub resize: ResizeRule,
    /// Filter of the resampling.
    pub filter: ResizeFilter,
    /// Channel order of the input tensor.
    pub channel_order: ChannelOrder,
    /// Range before normalisation.
    pub pixel_range: PixelRange,
    /// Subtracted from each channel, in `channel_order` and `pixel_range`.
    pub mean: [f32; 3],
    /// Divides each channel, in `channel_order` and `pixel_range`.
    pub std: [f32; 3],
    /// Width and height are padded with zeros (after normalisation) to multiples of this number.
    pub size_divisibility: usize,
}

/// Kind of residual block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum BlockKind {
    /// Two 3×3 convolutions: ResNet-18, -34.
    Basic,
    /// 1×1, 3×3, 1×1: ResNet-50 and deeper.
    Bottleneck {
        /// Channels of the inner convolutions in res2; doubled in each later stage.
        inner_channels: usize,
        /// The convolution with the stride.
        stride_in: StrideIn,
    },
}

/// The convolution of a bottleneck that carries the stride.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum StrideIn {
    /// The first, 1×1: Detectron2 (and the original MSRA models).
    Conv1x1,
    /// The second, 3×3: torchvision.
    Conv3x3,
}

/// The part of the detector that is never trained.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Freeze {
    /// Everything is trained.
    Nothing,
    /// The stem is frozen.
    Stem,
    /// The stem and res2 are frozen: Detectron2's `FREEZE_AT` 2.
    ThroughRes2,
    /// The stem, res2 and res3 are frozen.
    ThroughRes3,
    /// The residual network, the pyramid and the region proposal network are frozen; only the second stage is trained.
    FirstStage,
}

/// A residual network with four stages, res2 to res5, at strides 4, 8, 16, 32.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ResNetConfig {
    /// Channels after the 7×7 stem.
    pub stem_channels: usize,
    /// Output channels of res2; doubled in each later stage.
    pub res2_channels: usize,
    /// Blocks in res2, res3, res4, res5.
    pub num_blocks: [usize; 4],
    /// Kind of block, and the position of a bottleneck's stride.
    pub block: BlockKind,
    /// Norm after every convolution.
    pub norm: NormKind,
    /// Layers that keep their initial or loaded values.
    pub freeze: Freeze,
}

impl ResNetConfig {
    /// Channels of res2, res3, res4, res5.
    pub fn stage_channels(&self) -> [usize; 4] {
        [1, 2, 4, 8].map(|factor| self.res2_channels * factor)
    }
}

/// A feature pyramid p2 to p5, and p6 by subsampling p5.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FpnConfig {
    /// Channels of every level.
    pub channels: usize,
    /// Norm after the lateral and output convolutions.
    pub norm: NormKind,
}

/// Rounding of the base anchors' corners.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum AnchorRounding {
    /// As computed: Detectron2.
    Exact,
    /// Rounded to whole pixels, half to even: torchvision.
    Rounded,
}

/// Distance between neighbouring anchors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum AnchorStride {
    /// The level's nominal stride, 4 to 64: Detectron2.
    Nominal,
    /// Padded image size divided by grid size, rounded down: torchvision.
    ImageOverGrid,
}

/// Anchors on p2 to p6.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AnchorConfig {
    /// Side of the square anchor on p2 to p6, in pixels of the resized image.
    pub sizes_px: [f64; 5],
    /// Aspect ratios, height over width.
    pub aspect_ratios: Vec<f64>,
    /// Centre of the first anchor, in strides. Detectron2 and torchvision: 0.
    pub offset: f64,
    /// Rounding of the base anchors.
    pub rounding: AnchorRounding,
    /// Distance between neighbouring anchors.
    pub stride: AnchorStride,
}

/// Settings of the box coder.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BoxCoderConfig {
    /// Factors on dx, dy, dw, dh.
    pub weights: [f64; 4],
}

/// Loss of a difference of box deltas.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum RegressionLoss {
    /// `|d|`.
    L1,
    /// `d² / (2 beta)` below `beta`, `|d| - beta/2` above.
    SmoothL1 {
        /// Difference at which the parabola becomes a line.
        beta: f64,
    },
}

/// The divisor of the region proposal network's losses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum RpnNormaliser {
    /// Nominal samples per image times images: Detectron2.
    NominalSamples,
    /// Number of sampled anchors: torchvision.
    DrawnSamples,
}

/// Thresholds by which a matcher classifies boxes as positive, negative, or ignored.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MatcherConfig {
    /// IoU below which a box is negative.
    pub negative_below: f64,
    /// Minimum IoU of a positive box; between the two thresholds a box is ignored.
    pub positive_from: f64,
    /// Whether an object without a positive box is matched with its best boxes anyway.
    pub low_quality: LowQualityMatches,
}

/// Whether an object without a positive box is matched with its best boxes anyway.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum LowQualityMatches {
    /// The best boxes become positive: the region proposal network.
    Allowed,
    /// The best boxes stay unmatched: the ROI heads.
    Forbidden,
}

/// Number of boxes per image in a loss.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SamplerConfig {
    /// Boxes per image.
    pub batch_size_per_image: usize,
    /// Maximum fraction of positive boxes.
    pub positive_fraction: f64,
}

/// A number with different values for training and inference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct PerMode {
    /// Value in training.
    pub train: usize,
    /// Value in inference.
    pub test: usize,
}

/// The region proposal network.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RpnConfig {
    /// Thresholds for matching anchors to objects.
    pub matcher: MatcherConfig,
    /// Number of anchors in the loss.
    pub sampler: SamplerConfig,
    /// Weights of the deltas from anchors to boxes.
    pub box_coder: BoxCoderConfig,
    /// Best anchors kept on each level before NMS.
    pub pre_nms_top_n: PerMode,
    /// Proposals kept per image.
    pub post_nms_top_n: PerMode,
    /// IoU above which the lower-scoring of two proposals of a level is dropped.
    pub nms_threshold: f64,
    /// Proposals with a side of at most this many pixels are dropped.
    pub min_box_size_px: f64,
    /// Loss on deltas.
    pub regression_loss: RegressionLoss,
    /// Divisor of both losses.
    pub normaliser: RpnNormaliser,
}

/// Position of the background among the class scores.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum BackgroundClass {
    /// Class 0: torchvision, which also has (unused) box deltas for it.
    First,
    /// Class K: Detectron2.
    Last,
}

/// Whether each class has its own box deltas.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum BoxDeltas {
    /// 4·K (background last) or 4·(K+1) (background first) outputs.
    ClassSpecific,
    /// 4 outputs, shared by all classes.
    ClassAgnostic,
}

/// The second stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RoiHeadsConfig {
    /// Object classes, without background.
    pub num_classes: usize,
    /// Thresholds for matching proposals to objects.
    pub matcher: MatcherConfig,
    /// Number of proposals in the loss.
    pub sampler: SamplerConfig,
    /// Fraction of the sampled negatives that are the proposals with the highest objectness; the others are sampled at
    /// random. At 0, as in Detectron2 and torchvision, all are sampled at random, and most are on the bare table.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub hard_negative_share: f64,
    /// Settings of the head that computes classes and refined boxes of the proposals.
    pub box_head: BoxHeadConfig,
    /// The keypoint head, if the detector has one.
    pub keypoint_head: Option<KeypointHeadConfig>,
    /// The mask head, if the detector has one.
    pub mask_head: Option<MaskHeadConfig>,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// Two fully connected layers, class scores and box deltas.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BoxHeadConfig {
    /// How features are pooled for an ROI.
    pub pooler: RoiPoolerConfig,
    /// Width of the two fully connected layers.
    pub fc_channels: usize,
    /// Position of the background class.
    pub background: BackgroundClass,
    /// Whether each class has its own deltas.
    pub box_deltas: BoxDeltas,
    /// Weights of the deltas from proposals to boxes.
    pub box_coder: BoxCoderConfig,
    /// Loss on deltas.
    pub regression_loss: RegressionLoss,
    /// The score of a detection is above this.
    pub score_threshold: f64,
    /// IoU above which the lower-scoring of two detections of a class is dropped.
    pub nms_threshold: f64,
    /// Detections kept per image.
    pub detections_per_image: usize,
    /// Detections with a side of at most this many pixels of the resized image are dropped.
    pub min_box_size_px: f64,
}

/// Method of computing a keypoint from its heatmap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum KeypointReadout {
    /// The map is resized to the box's size, rounded up, by a bicubic filter, and the centre of the highest pixel is
    /// the keypoint: Detectron2 and torchvision.
    BicubicArgmax,
    /// The mean position, weighted by the map's softmax, in a square of side `2 radius + 1` cells around its highest
    /// cell: finer than a cell, and cheaper.
    LocalMean {
        /// Number of cells on each side of the highest cell.
        radius: usize,
    },
}

/// The score of a keypoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum KeypointScore {
    /// Height of the peak of the map normalised to sum 1: Detectron2.
    NormalisedPeak,
    /// The raw logit of the peak: torchvision.
    Logit,
}

/// Convolutions, a transposed convolution to K maps, and bilinear doubling.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KeypointHeadConfig {
    /// Pooling.
    pub pooler: RoiPoolerConfig,
    /// Channels of each 3×3 convolution.
    pub conv_channels: Vec<usize>,
    /// Keypoints per object.
    pub num_keypoints: usize,
    /// Maximum number of positive proposals per image that go through the head in training.
    pub max_train_rois_per_image: Option<usize>,
    /// Factor on the keypoint loss.
    pub loss_weight: f64,
    /// Method of computing a keypoint from its heatmap.
    pub readout: KeypointReadout,
    /// The score of a keypoint.
    pub score: KeypointScore,
}

impl KeypointHeadConfig {
    /// Side of the heatmaps: the pooled side times four (transposed convolution, bilinear).
    pub fn heatmap_size(&self) -> usize {
        self.pooler.output_size * 4
    }
}
