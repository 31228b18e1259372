//! The weight's gradient in the frequency domain: sums over tiles instead of pixels, then back to 3×3.

use super::filter_transform::filter_transform_adjoint;
use super::tiling::{FREQUENCIES, Frequencies, Tiling};
use super::transform::{input_transform, output_transform_adjoint};
use crate::conv::direct::Maps;
use crate::conv::shape::ConvShape;
use crate::parallel::{Raw, SharedSlice, for_each_unit, for_each_unit_if};
use crate::product::{Epilogue, Operand, PANEL, PanelProduct, Prefetch};
use crate::scratch::Scratch;
use crate::simd::lanes::LANES;
use crate::simd::{Isa, transpose};

/// Maximum size of a gradient in the frequency domain for which every chunk of tiles has its own sums: somewhat
/// more than 36 · 64 · 64 floats.
const OWN_GRADIENT: usize = 160 << 10;
/// Maximum number of chunks of tiles, each summed separately.
const CHUNKS: usize = 8;
/// Number of tiles transformed before they are multiplied, if one thread computes a chunk.
const BLOCK_TILES: usize = 96;
/// Floats of the transformed values of a block, if all threads work on it together: 12 MB.
const BLOCK_FLOATS: usize = 3 << 20;

/// The gradient with respect to the weight, `[Co, Ci, 3, 3]`, from channels-last maps; `None` if a sum is not
/// finite.
pub(in crate::conv) fn weight_gradient(
    isa: Isa,
    x: Maps<'_>,
    output_grad: Maps<'_>,
    shape: &ConvShape,
) -> Option<Vec<f32>> {
    let tiling = Tiling::new(shape.num_images, shape.out_size);
    let sums = Sums { isa, x, output_grad, padding: shape.params.padding, tiling };
    let len = FREQUENCIES * sums.step();
    let num_tiles = tiling.len();
    let chunks = if len <= OWN_GRADIENT { CHUNKS.min(num_tiles.div_ceil(24)) } else { 1 };
    let mut partial = Scratch::take(chunks * len);
    let raw = SharedSlice::new(&mut partial).raw();
    if chunks > 1 {
        for_each_unit(chunks, |chunk| {
            let tiles = chunk * num_tiles / chunks..(chunk + 1) * num_tiles / chunks;
            // SAFETY: every chunk has its own sums.
            unsafe { sums.add(tiles, BLOCK_TILES, chunk * len, raw, false) };
        });
        let shared = SharedSlice::new(&mut partial);
        for_each_unit(FREQUENCIES, |frequency| {
            let start = frequency * sums.step();
            // SAFETY: every unit has its own frequency, of all chunks.
            let total = unsafe { shared.range(start, sums.step()) };
            for chunk in 1..chunks {
                // SAFETY: the unit's frequency of another chunk than `total`'s.
                let other = unsafe { shared.range(chunk * len + start, sums.step()) };
                for (total, other) in total.iter_mut().zip(other) {
                    *total += *other;
                }
            }
        });
    } else {
        let block = BLOCK_FLOATS / (FREQUENCIES * (x.channels + output_grad.channels));
        // SAFETY: nothing else accesses the sums.
        unsafe { sums.add(0..num_tiles, block.max(24), 0, raw, true) };
    }

    let (in_channels, out_channels) = (shape.in_channels, shape.out_channels);
    let run = in_channels * 9;
    let mut grad = vec![0.0; out_channels * run];
    let shared = SharedSlice::new(&mut grad);
    let total = &partial[..len];
    for_each_unit(out_channels / LANES, |unit| {
        let mut cells = Scratch::take(run * LANES);
        // SAFETY: the sums hold sixteen filters from here at every frequency and channel.
        unsafe {
            let source = total.as_ptr().add(unit * LANES);
            filter_transform_adjoint(isa, source, sums.step(), in_channels, out_channels, &mut cells);
        }
        // SAFETY: every unit has its own filters.
        let grad = unsafe { shared.range(unit * LANES * run, LANES * run) };
        transpose(isa, &cells, LANES, grad, run, run, LANES);
    });
    let watch: f32 = grad.iter().map(|value| value * 0.0).sum();
    (watch == 0.0).then_some(grad)
}

struct Sums<'a> {
    isa: Isa,
    x: Maps<'a>,
    output_grad: Maps<'a>,
    padding: [usize; 2],
    tiling: Tiling,
}

impl Sums<'_> {
    /// Step from one frequency's `[Ci, Co]` to the next.
    fn step(&self) -> usize {
        self.x.channels * self.output_grad.channels
    }

    /// Sums over `tiles`, a block at a time, into `[36, Ci, Co]` from `at` on.
    ///
    /// # Safety
    /// Nothing else accesses these sums.
    unsafe fn add(&self, tiles: std::ops::Range<usize>, block: usize, at: usize, sums: Raw, shared_out: bool) {
        let (rows, columns) = (self.x.channels, self.output_grad.channels);
        let most = block.min(tiles.len());
        let mut transformed_input = Frequencies::new(most, rows);
        let mut transformed_gradient = Frequencies::new(most, columns);
        // Number of groups into which the rows of a product are divided, so that large products are also distributed.
        let row_groups = if shared_out { (rows / 96).max(1) } else { 1 };
        let mut start = tiles.start;
        while start < tiles.end {
            let count = most.min(tiles.end - start);
            let part = if shared_out { count.div_ceil(CHUNKS) } else { count };
            let (input_step, gradient_step) = (transformed_input.step, transformed_gradient.step);
            let raw_input = SharedSlice::new(&mut transformed_input.values).raw();
            let raw_gradient = SharedSlice::new(&mut transformed_gradient.values).raw();
            for_each_unit_if(shared_out, count.div_ceil(part), |unit| {
                let range = unit * part..count.min((unit + 1) * part);
                let tiles = start + range.start..start + range.end;
                // SAFETY: a unit has its own tiles.
                unsafe {
                    let target = raw_input.at(range.start * rows);
                    input_transform(self.isa, self.x, self.padding, self.tiling, tiles.clone(), target, input_step);
                    let target = raw_gradient.at(range.start * columns);
                    output_transform_adjoint(self.isa, self.output_grad, self.tiling, tiles, target, gradient_step);
                }
            });
            for_each_unit_if(shared_out, FREQUENCIES * row_groups, |unit| {
                let (frequency, group) = (unit / row_groups, unit % row_groups);
                let group = group * rows / row_groups..(group + 1) * rows / row_groups;
                for first_column in (0..columns).step_by(PANEL) {
                    let product = PanelProduct {
                        rows: group.len(),
                        columns: PANEL.min(columns - first_column),
                        depth: [1, count],
                        left: Operand {
                            values: &transformed_input.values[frequency * input_step + group.start..],
                            step: 1,
                            inner: rows,
                            outer: 0,
                        },
                        right: Operand {
                            values: &transformed_gradient.values[frequency * gradient_step + first_column..],
                            step: 1,
                            inner: columns,
                            outer: 0,
                        },
                        at: at + frequency * self.step() + group.start * columns + first_column,
                        row_step: columns,
                        first_column: 0,
                        epilogue: Epilogue::default(),
                        accumulate: start > tiles.start,
                        prefetch: Prefetch::default(),
                    };
                    // SAFETY: a unit has its own frequency and rows.
                    unsafe { product.run(self.isa, sums) };
                }
            });
            start += count;
        }
    }
}
