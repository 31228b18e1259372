//! A convolution's weights, packed for the method of computation.

use std::sync::Arc;

use super::panels::{Direction, Panels, gather};
use super::shape::{ConvShape, phases};
use super::winograd;
use crate::parallel::{SharedSlice, for_each_unit};
use crate::product::{PANEL, packed_len, panel_width};
use crate::scratch::Scratch;
use crate::simd::Isa;

/// Packed weights of one convolution.
#[derive(Clone)]
pub(crate) enum Filters {
    /// A product for each phase of the stride (one in the forward direction).
    Direct(Vec<Panels>),
    /// A product for each of the 36 frequencies.
    Winograd(Panels),
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
