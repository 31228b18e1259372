//! Weights in the order in which the matrix products read them.
//!
//! A product's columns are output channels going forwards, input channels going back; its depth is the other
//! channels times the kernel's cells. Columns are packed in panels of 32.

use std::sync::Arc;

use super::kernel::{ConvShape, phases};
use super::winograd;
use crate::parallel::{SharedSlice, for_each_unit};
use crate::product::{PANEL, packed_len, panel_width};
use crate::scratch::Scratch;
use crate::simd::{Isa, transpose};

/// Which way a convolution runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Direction {
    /// From input to output.
    Forward,
    /// From the output's gradient to the input's; a transposed convolution.
    Backward,
}

impl Direction {
    /// Columns and depth channels of the product.
    fn channels(self, shape: &ConvShape) -> [usize; 2] {
        match self {
            Self::Forward => [shape.out_channels, shape.in_channels],
            Self::Backward => [shape.in_channels, shape.out_channels],
        }
    }
}

/// Packed weights of one convolution.
#[derive(Clone)]
pub(crate) enum Filters {
    /// A product for each phase of the stride (forwards there is one).
    Direct(Vec<Panels>),
    /// A product for each of the 36 frequencies.
    Winograd(Panels),
}

/// Panels of packed weights, `[⌈columns/32⌉, depth, 32]`, once or 36 times.
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

impl Filters {
    /// Packs the weight `[Co, Ci, Kh, Kw]`.
    pub(crate) fn new(isa: Isa, weight: &[f32], shape: &ConvShape, direction: Direction, winograd: bool) -> Self {
        let [columns, channels] = direction.channels(shape);
        if winograd {
            let values = winograd::pack(isa, weight, shape, direction);
            return Self::Winograd(Panels { values: Arc::new(values), columns, depth: channels });
        }
        let kernel_width = shape.kernel[1];
        let cells_of_products: Vec<Vec<usize>> = match direction {
            Direction::Forward => vec![(0..shape.kernel[0] * kernel_width).collect()],
            Direction::Backward => phases(shape)
                .iter()
                .map(|phase| {
                    let rows = phase.cells_y.iter();
                    rows.flat_map(|y| phase.cells_x.iter().map(move |x| y * kernel_width + x)).collect()
                })
                .collect(),
        };
        let mut products: Vec<Scratch> =
            cells_of_products.iter().map(|cells| Scratch::take(packed_len(columns, channels * cells.len()))).collect();
        let num_cells = shape.kernel[0] * kernel_width;
        {
            let targets: Vec<SharedSlice<'_>> = products.iter_mut().map(|product| SharedSlice::new(product)).collect();
            for_each_unit(columns.div_ceil(PANEL), |panel| {
                let mut gathered = Scratch::take(channels * num_cells * PANEL);
                gather(isa, weight, shape, direction, panel, &mut gathered);
                let width = panel_width(columns, panel);
                for (target, cells) in targets.iter().zip(&cells_of_products) {
                    let depth = channels * cells.len();
                    // SAFETY: every unit has its own panel.
                    let target = unsafe { target.range(panel * PANEL * depth, width * depth) };
                    for (slot, cell) in cells.iter().enumerate() {
                        for channel in 0..channels {
                            let row = &gathered[(channel * num_cells + cell) * PANEL..][..width];
                            target[(slot * channels + channel) * width..][..width].copy_from_slice(row);
                        }
                    }
                }
            });
        }
        let panels = products.into_iter().zip(&cells_of_products).map(|(values, cells)| Panels {
            values: Arc::new(values),
            columns,
            depth: channels * cells.len(),
        });
        Self::Direct(panels.collect())
    }
}

/// One panel's weights as `[channel, cell, 32]`, zeros where the columns end.
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
