//! Pooling of boxes into squares of features.

use serde::{Deserialize, Serialize};

/// Positions of ROIAlign's samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum RoiAlignment {
    /// Shifted by half a cell, which is correct for pixel centres at (0.5, 0.5): Detectron2's `aligned`.
    HalfPixel,
    /// Not shifted: torchvision's detectors.
    Legacy,
}

/// Number of samples that a bin of ROIAlign averages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum SamplingRatio {
    /// `ceil(roi size / output size)` along each axis.
    Adaptive,
    /// A fixed number along each axis.
    Fixed(usize),
}

/// Position of the small number that prevents `log2` from rounding down on exact powers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum LevelEpsilon {
    /// `floor(canonical_level + log2(s / canonical_size + eps))`: Detectron2, 1e-8.
    InsideLog(f64),
    /// `floor(canonical_level + log2(s / canonical_size) + eps)`: torchvision, 1e-6.
    OutsideLog(f64),
}

/// Pools boxes of any size from p2 to p5 into squares.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RoiPoolerConfig {
    /// Side of the pooled square.
    pub output_size: usize,
    /// Alignment of the samples.
    pub alignment: RoiAlignment,
    /// Number of samples.
    pub sampling_ratio: SamplingRatio,
    /// Side of the boxes that are pooled from `canonical_level`, in pixels.
    pub canonical_size_px: f64,
    /// Pyramid level for boxes of `canonical_size_px`.
    pub canonical_level: usize,
    /// Small number that protects against rounding.
    pub level_epsilon: LevelEpsilon,
}
