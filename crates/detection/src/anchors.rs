//! The initial boxes of the region proposal network.
//!
//! Each level has one base anchor per aspect ratio, centred at the origin and repeated at every
//! cell. Order: level, row, column, aspect ratio; the RPN's outputs have the same layout.

use crate::boxes::Corners;
use crate::config::{AnchorConfig, AnchorRounding, AnchorStride};

/// Nominal strides of p2 to p6, pixels per cell.
pub const LEVEL_STRIDES: [usize; 5] = [4, 8, 16, 32, 64];

/// Size of one level's grid of cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GridSize {
    /// Rows.
    pub height: usize,
    /// Columns.
    pub width: usize,
}

/// Base anchors of side `size_px`: one for each aspect ratio (height over width), equal in area.
pub fn base_anchors(size_px: f64, config: &AnchorConfig) -> Vec<Corners> {
    config
        .aspect_ratios
        .iter()
        .map(|ratio| {
            let width = size_px / ratio.sqrt();
            let height = width * ratio;
            let corners = [-width / 2.0, -height / 2.0, width / 2.0, height / 2.0];
            match config.rounding {
                AnchorRounding::Exact => corners.map(|v| v as f32),
                AnchorRounding::Rounded => corners.map(|v| v.round_ties_even() as f32),
            }
        })
        .collect()
}

/// The anchors of each level, in pixels of the padded image.
///
/// `image_height` and `image_width` are those of the padded batch; only
/// [`AnchorStride::ImageOverGrid`] uses them.
pub fn grid_anchors(
    config: &AnchorConfig,
    grids: &[GridSize; 5],
    image_height: usize,
    image_width: usize,
) -> [Vec<Corners>; 5] {
    std::array::from_fn(|level| {
        let grid = grids[level];
        let base = base_anchors(config.sizes_px[level], config);
        let (stride_x, stride_y) = match config.stride {
            AnchorStride::Nominal => (LEVEL_STRIDES[level], LEVEL_STRIDES[level]),
            AnchorStride::ImageOverGrid => (image_width / grid.width, image_height / grid.height),
        };
        let mut anchors = Vec::with_capacity(grid.height * grid.width * base.len());
        for row in 0..grid.height {
            let y = ((row as f64 + config.offset) * stride_y as f64) as f32;
            for column in 0..grid.width {
                let x = ((column as f64 + config.offset) * stride_x as f64) as f32;
                anchors.extend(base.iter().map(|b| [b[0] + x, b[1] + y, b[2] + x, b[3] + y]));
            }
        }
        anchors
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(rounding: AnchorRounding, stride: AnchorStride) -> AnchorConfig {
        AnchorConfig {
            sizes_px: [32.0, 64.0, 128.0, 256.0, 512.0],
            aspect_ratios: vec![0.5, 1.0, 2.0],
            offset: 0.0,
            rounding,
            stride,
        }
    }

    #[test]
    fn base_anchors_of_side_32() {
        // Ratio 1/2: width 32·√2 = 45.2548, height 22.6274.
        let exact = base_anchors(32.0, &config(AnchorRounding::Exact, AnchorStride::Nominal));
        let expected = [
            [-22.627_417, -11.313_708, 22.627_417, 11.313_708],
            [-16.0, -16.0, 16.0, 16.0],
            [-11.313_708, -22.627_417, 11.313_708, 22.627_417],
        ];
        for (anchor, want) in exact.iter().zip(expected) {
            for (a, w) in anchor.iter().zip(want) {
                assert!((a - w).abs() < 1e-5, "{a} {w}");
            }
        }
        let rounded = base_anchors(32.0, &config(AnchorRounding::Rounded, AnchorStride::Nominal));
        assert_eq!(rounded[0], [-23.0, -11.0, 23.0, 11.0]);
    }

    #[test]
    fn anchors_run_along_rows_first() {
        let grids = [(2, 3), (1, 2), (1, 1), (1, 1), (1, 1)].map(|(height, width)| GridSize { height, width });
        let nominal = grid_anchors(&config(AnchorRounding::Rounded, AnchorStride::Nominal), &grids, 8, 12);
        assert_eq!(nominal[0].len(), 2 * 3 * 3);
        assert_eq!(nominal[0][1], [-16.0, -16.0, 16.0, 16.0]);
        assert_eq!(nominal[0][4], [-12.0, -16.0, 20.0, 16.0]);
        assert_eq!(nominal[0][10], [-16.0, -12.0, 16.0, 20.0]);
        // 13 pixels over 2 cells are 6 per cell; the nominal stride of p3 is 8.
        let over_grid = grid_anchors(&config(AnchorRounding::Rounded, AnchorStride::ImageOverGrid), &grids, 8, 13);
        assert_eq!(over_grid[1][4], [-26.0, -32.0, 38.0, 32.0]);
    }
}
