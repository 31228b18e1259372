//! Weights in the order in which the matrix products read them.
//!
//! A product's columns are output channels in the forward direction, input channels backwards; its depth is
//! the other channels times the kernel's cells. Columns are packed in panels of 32.

use std::sync::Arc;

use super::shape::ConvShape;
use crate::product::{PANEL, packed_len, panel_width};
use crate::scratch::Scratch;
use crate::simd::{Isa, transpose};

/// The direction of a convolution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Direction {
    /// From input to output.
    Forward,
    /// From the output's gradient to the input's; a transposed convolution.
    Backward,
}

impl Direction {
    /// Columns and depth channels of the product.
    pub(super) fn channels(self, shape: &ConvShape) -> [usize; 2] {
        match self {
            Self::Forward => [shape.out_channels, shape.in_channels],
            Self::Backward => [shape.in_channels, shape.out_channels],
        }
    }
}

/// Panels of packed weights, `[⌈columns/32⌉, depth, 32]`, where the last panel may be 16 wide; for Winograd's method
/// one such array per frequency.
#[derive(Clone)]
pub(crate) struct Panels {
    pub(crate) values: Arc<Scratch>,
    pub(crate) columns: usize,
    pub(crate) depth: usize,
}

impl Panels {
    /// The panel, and the step from one row of it to the next.
    pub(crate) fn panel(&self, frequency: usize, panel: usize) -> (&[f32], usize) {
        let width = panel_width(self.columns, panel);
        let start = frequency * packed_len(self.columns, self.depth) + panel * PANEL * self.depth;
        (&self.values[start..start + width * self.depth], width)
    }
}

/// One panel's weights as `[channel, cell, 32]`, with zeros after the last column.
pub(super) fn gather(
    isa: Isa,
    weight: &[f32],
    shape: &ConvShape,
    direction: Direction,
    panel: usize,
    gathered: &mut [f32],
) {
    let num_cells = shape.kernel[0] * shape.kernel[1];
    let [columns, channels] = direction.channels(shape);
    let first = panel * PANEL;
    let count = PANEL.min(columns - first);
    if count < PANEL {
        gathered.fill(0.0);
    }
    match direction {
        Direction::Forward => {
            let run = channels * num_cells;
            transpose(isa, &weight[first * run..], run, gathered, PANEL, count, run);
        }
        Direction::Backward => {
            for (channel, gathered) in gathered.chunks_exact_mut(num_cells * PANEL).take(channels).enumerate() {
                let source = &weight[(channel * columns + first) * num_cells..];
                transpose(isa, source, num_cells, gathered, PANEL, count, num_cells);
            }
        }
    }
}
