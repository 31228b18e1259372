//! Convolution 3×3 of stride 1 with a quarter of the multiplications: Winograd's F(4×4, 3×3).
//!
//! An output *tile* of 4×4 pixels depends on 6×6 input pixels d. With the transforms B, G, A of [`transform`],
//!
//! `y = Aᵀ [(G g Gᵀ) ⊙ (Bᵀ d B)] A`
//!
//! so that for each of the 36 *frequencies* the sum over channels is a matrix product of all tiles with all filters.
//! With the output's gradient ȳ, the weight's gradient is the adjoint: `Gᵀ [Σ_tiles (Bᵀ d B) ⊙ (A ȳ Aᵀ)] G`.
//!
//! The points are 0, ±1/√2, ±√2, ∞: with these the rounding error is several times smaller than with 0, ±1, ±2, ∞.
//! Values that are not finite would spread over their tile, so that each result is checked; if one of its values is not
//! finite, it is computed again directly.
//!
//! Source: Lavin and Gray, Fast Algorithms for Convolutional Neural Networks (2015); the points after Barabasz et
//! al., Error Analysis and Improving the Accuracy of Winograd Convolution (2018).

use std::sync::atomic::{AtomicBool, Ordering};

use super::direct::Maps;
use super::panels::{Direction, Panels, gather};
use super::shape::ConvShape;
use crate::parallel::{Raw, SharedSlice, for_each_unit, for_each_unit_if};
use crate::product::{Epilogue, Operand, PANEL, PanelProduct, Prefetch, packed_len, panel_width};
use crate::scratch::Scratch;
use crate::simd::Isa;
use crate::simd::lanes::LANES;

mod filter_transform;
mod tiling;
pub(super) mod transform;
mod weight_gradient;

use tiling::{FREQUENCIES, Frequencies, Tiling};
pub(super) use weight_gradient::weight_gradient;

/// Tiles per unit of work: the transformed values of 48 tiles and 64 channels are 442 KB.
const UNIT_TILES: usize = 48;
/// Target number of units, so that no thread waits long for the last one. A single thread processes few tiles at
/// a time through all steps, so that they stay in its cache (a browser's 64→64 on 64×80: 5.2 ms with eight units,
/// 3.5 ms with one).
const MIN_UNITS: usize = if cfg!(all(feature = "parallel", not(target_arch = "wasm32"))) { 8 } else { 1 };

/// Whether a convolution is computed by this method.
///
/// Channels are processed sixteen at a time; on very small maps most of a tile would lie outside.
pub(crate) fn suits(shape: &ConvShape) -> bool {
    let [height, width] = shape.out_size;
    shape.kernel == [3, 3]
        && shape.params.stride == [1, 1]
        && shape.params.padding[0] <= 2
        && shape.params.padding[1] <= 2
        && shape.in_channels.is_multiple_of(LANES)
        && shape.out_channels.is_multiple_of(LANES)
        && height.min(width) >= 3
        && shape.in_size[0].min(shape.in_size[1]) >= 3
}

/// Transformed weights: panels for each frequency, `[36, ⌈columns/32⌉, channels, 32]`.
pub(super) fn pack(isa: Isa, weight: &[f32], shape: &ConvShape, direction: Direction) -> Scratch {
    let [columns, channels] = match direction {
        Direction::Forward => [shape.out_channels, shape.in_channels],
        Direction::Backward => [shape.in_channels, shape.out_channels],
    };
    let frequency_len = packed_len(columns, channels);
    let mut packed = Scratch::take(FREQUENCIES * frequency_len);
    let raw = SharedSlice::new(&mut packed).raw();
    for_each_unit(columns.div_ceil(PANEL), |panel| {
        let mut gathered = Scratch::take(channels * 9 * PANEL);
        gather(isa, weight, shape, direction, panel, &mut gathered);
        let width = panel_width(columns, panel);
        let flipped = direction == Direction::Backward;
        assert!(raw.len >= FREQUENCIES * frequency_len);
        // SAFETY: a unit writes its own panel of every frequency, inside `packed`.
        unsafe {
            let target = raw.at(panel * PANEL * channels);
            filter_transform::filter_transform(isa, &gathered, channels, width, flipped, target, frequency_len);
        }
    });
    packed
}

/// Convolves `source` and writes all of `output`, `[N, H, W, M]`; returns false if a sum is not finite.
///
/// # Safety
/// Nothing else accesses `output`.
pub(super) unsafe fn run(
    isa: Isa,
    source: Maps<'_>,
    padding: [usize; 2],
    out_size: [usize; 2],
    filters: &Panels,
    epilogue: Epilogue<'_>,
    output: Raw,
) -> bool {
    let tiling = Tiling::new(source.num_images, out_size);
    let num_tiles = tiling.len();
    let finite = AtomicBool::new(true);
    let conv = Winograd { isa, source, padding, out_size, filters, epilogue, output, tiling, finite: &finite };
    // If there are many tiles, each unit computes all steps for some of them. Few tiles are processed together, and
    // each step is distributed.
    let units = num_tiles.div_ceil(UNIT_TILES);
    if units >= MIN_UNITS {
        let per_unit = num_tiles.div_ceil(units);
        for_each_unit(num_tiles.div_ceil(per_unit), |unit| {
            // SAFETY: a unit has its own tiles.
            unsafe { conv.tiles(unit * per_unit, per_unit.min(num_tiles - unit * per_unit), false) };
        });
    } else {
        // SAFETY: this single call writes all tiles of the output.
        unsafe { conv.tiles(0, num_tiles, true) };
    }
    finite.load(Ordering::Relaxed)
}

struct Winograd<'a> {
    isa: Isa,
    source: Maps<'a>,
    padding: [usize; 2],
    out_size: [usize; 2],
    filters: &'a Panels,
    epilogue: Epilogue<'a>,
    output: Raw,
    tiling: Tiling,
    finite: &'a AtomicBool,
}

impl Winograd<'_> {
    /// Processes `count` tiles, beginning with `first`, through all steps.
    ///
    /// # Safety
    /// Nothing else accesses these tiles of the output.
    unsafe fn tiles(&self, first: usize, count: usize, shared_out: bool) {
        let (channels, columns) = (self.source.channels, self.filters.columns);
        let mut transformed_input = Frequencies::new(count, channels);
        let mut products = Frequencies::new(count, columns);
        let (input_step, products_step) = (transformed_input.step, products.step);
        // Number of tiles that are transformed together.
        let part = if shared_out { count.div_ceil(MIN_UNITS) } else { count };
        let parts = count.div_ceil(part);

        let raw = SharedSlice::new(&mut transformed_input.values).raw();
        for_each_unit_if(shared_out, parts, |unit| {
            let range = unit * part..count.min((unit + 1) * part);
            // SAFETY: a unit has its own tiles.
            unsafe {
                let target = raw.at(range.start * channels);
                let tiles = first + range.start..first + range.end;
                transform::input_transform(self.isa, self.source, self.padding, self.tiling, tiles, target, input_step);
            }
        });

        let raw = SharedSlice::new(&mut products.values).raw();
        let panels = columns.div_ceil(PANEL);
        for_each_unit_if(shared_out, FREQUENCIES, |frequency| {
            for panel in 0..panels {
                let (right, width) = self.filters.panel(frequency, panel);
                let first_column = panel * PANEL;
                let (next_panel, next_input) = if panel + 1 < panels {
                    (self.filters.panel(frequency, panel + 1).0, &[][..])
                } else if frequency + 1 < FREQUENCIES {
                    let next = &transformed_input.values[(frequency + 1) * input_step..][..count * channels];
                    (self.filters.panel(frequency + 1, 0).0, next)
                } else {
                    (&[][..], &[][..])
                };
                let product = PanelProduct {
                    rows: count,
                    columns: PANEL.min(columns - first_column),
                    depth: [1, channels],
                    left: Operand {
                        values: &transformed_input.values[frequency * input_step..],
                        step: channels,
                        inner: 1,
                        outer: 0,
                    },
                    right: Operand { values: right, step: 1, inner: width, outer: 0 },
                    at: frequency * products_step + first_column,
                    row_step: columns,
                    first_column,
                    epilogue: Epilogue::default(),
                    accumulate: false,
                    prefetch: Prefetch { runs: [next_panel, next_input] },
                };
                // SAFETY: a unit has its own frequency.
                unsafe { product.run(self.isa, raw) };
            }
        });

        for_each_unit_if(shared_out, parts, |unit| {
            let range = unit * part..count.min((unit + 1) * part);
            let tiles = first + range.start..first + range.end;
            let values = &products.values[range.start * columns..];
            let place = transform::OutputPlace {
                tiling: self.tiling,
                size: self.out_size,
                channels: columns,
                epilogue: self.epilogue,
                output: self.output,
            };
            let mut finite = true;
            // SAFETY: a unit has its own tiles of the output.
            unsafe { transform::output_transform(self.isa, values, products_step, &place, tiles, &mut finite) };
            if !finite {
                self.finite.store(false, Ordering::Relaxed);
            }
        });
    }
}
