//! Pools boxes into crops of one size, each from the pyramid level that matches the box's
//! size.

use burn::tensor::{Tensor, TensorData};
use sdg_kernels::{RoiAlignParams, permute_maps, roi_align};

use crate::anchors::LEVEL_STRIDES;
use crate::boxes::{Corners, area};
use crate::config::{LevelEpsilon, RoiAlignment, RoiPoolerConfig, SamplingRatio};

/// Pyramid levels from which boxes are pooled: p2 to p5.
const POOLED_LEVELS: std::ops::RangeInclusive<usize> = 2..=5;

/// A box and its image in the batch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roi {
    /// Index of the image in the batch.
    pub image_idx: usize,
    /// The box, in pixels of the resized image.
    pub corners: Corners,
}

/// The level, 2 to 5, from which a box is pooled.
pub fn assign_level(corners: &Corners, config: &RoiPoolerConfig) -> usize {
    let size = area(corners).sqrt();
    let canonical = config.canonical_size_px as f32;
    let log = match config.level_epsilon {
        LevelEpsilon::InsideLog(eps) => (size / canonical + eps as f32).log2(),
        LevelEpsilon::OutsideLog(eps) => (size / canonical).log2() + eps as f32,
    };
    // A box without area has a log of -inf or about -27, and gets the finest level.
    let level = (config.canonical_level as f32 + log).floor() as i64;
    level.clamp(*POOLED_LEVELS.start() as i64, *POOLED_LEVELS.end() as i64) as usize
}

/// Pools every ROI into a square, in the order given.
///
/// # Shapes
/// - `features`: p2 to p6 (p6 is not used), `[N, C, H_l, W_l]`
/// - output: `[R, C, S, S]`, R > 0
pub fn pool(features: &[Tensor<4>; 5], rois: &[Roi], config: &RoiPoolerConfig) -> Tensor<4> {
    assert!(!rois.is_empty(), "expected at least one ROI");
    let device = features[0].device();
    let mut of_level: [Vec<usize>; 4] = Default::default();
    for (idx, roi) in rois.iter().enumerate() {
        of_level[assign_level(&roi.corners, config) - POOLED_LEVELS.start()].push(idx);
    }
    let mut pooled = Vec::new();
    let mut order = Vec::with_capacity(rois.len());
    for (level, idxs) in of_level.iter().enumerate().filter(|(_, idxs)| !idxs.is_empty()) {
        let rows: Vec<f32> = idxs
            .iter()
            .flat_map(|idx| {
                let [x1, y1, x2, y2] = rois[*idx].corners;
                [rois[*idx].image_idx as f32, x1, y1, x2, y2]
            })
            .collect();
        let rows = Tensor::<2>::from_data(TensorData::new(rows, [idxs.len(), 5]), &device);
        let params = RoiAlignParams {
            output_size: [config.output_size; 2],
            spatial_scale: 1.0 / LEVEL_STRIDES[level] as f32,
            sampling_ratio: match config.sampling_ratio {
                SamplingRatio::Adaptive => sdg_kernels::SamplingRatio::Adaptive,
                SamplingRatio::Fixed(count) => sdg_kernels::SamplingRatio::Fixed(count),
            },
            alignment: match config.alignment {
                RoiAlignment::HalfPixel => sdg_kernels::RoiAlignment::HalfPixel,
                RoiAlignment::Legacy => sdg_kernels::RoiAlignment::Legacy,
            },
        };
        pooled.push(roi_align(features[level].clone(), rows, params));
        order.extend_from_slice(idxs);
    }
    if pooled.len() == 1 {
        return pooled.remove(0);
    }
    // `order[row]` is the ROI in a row of the concatenation; the inverse restores the order.
    let mut row_of_roi = vec![0; rois.len()];
    for (row, roi) in order.iter().enumerate() {
        row_of_roi[*roi] = row;
    }
    // Channels last, the order of the crops in memory, so that whole crops are copied.
    let pooled = pooled.into_iter().map(|crops| crops.permute([0, 2, 3, 1])).collect();
    permute_maps(Tensor::cat(pooled, 0), &row_of_roi).permute([0, 3, 1, 2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::presets::{RcnnKind, r50_detectron2};
    use burn::tensor::Device;

    fn detectron2() -> RoiPoolerConfig {
        r50_detectron2(RcnnKind::Faster { num_classes: 1 }).roi_heads.box_head.pooler
    }

    fn square(side: f32) -> Corners {
        [0.0, 0.0, side, side]
    }

    #[test]
    fn levels_by_hand() {
        let config = detectron2();
        for (side, level) in [(10.0, 2), (111.0, 2), (112.0, 3), (223.0, 3), (224.0, 4), (448.0, 5), (5000.0, 5)] {
            assert_eq!(assign_level(&square(side), &config), level, "side {side}");
        }
        assert_eq!(assign_level(&square(0.0), &config), 2);
        let torchvision = RoiPoolerConfig { level_epsilon: LevelEpsilon::OutsideLog(1e-6), ..config };
        assert_eq!(assign_level(&square(0.0), &torchvision), 2);
        assert_eq!(assign_level(&square(448.0), &torchvision), 5);
    }

    #[test]
    fn crops_keep_the_order_of_the_rois() {
        let device = Device::flex();
        // Level l of image n is constant 10·n + l, so that a crop shows its source.
        let features: [Tensor<4>; 5] = std::array::from_fn(|level| {
            let side = 256 >> level;
            let images =
                (0..2).map(|n| Tensor::full([1, 1, side, side], (10 * n + level + 2) as f32, &device)).collect();
            Tensor::cat(images, 0)
        });
        let rois = [(0, 300.0), (1, 50.0), (1, 600.0), (0, 130.0), (0, 20.0)]
            .map(|(image_idx, side)| Roi { image_idx, corners: square(side) });
        let config = detectron2();
        let crops = pool(&features, &rois, &config);
        assert_eq!(crops.dims(), [5, 1, 7, 7]);
        let values = crops.into_data().try_to_vec_as::<f32>().unwrap();
        let centers: Vec<f32> = values.chunks_exact(49).map(|crop| crop[24].round()).collect();
        assert_eq!(centers, [4.0, 12.0, 15.0, 3.0, 2.0]);
    }
}
