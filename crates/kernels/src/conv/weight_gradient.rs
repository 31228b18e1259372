//! The gradient of a convolution with respect to its weight.
//!
//! `grad[m, ky, kx, c] = Σ_p output_grad[p, m] · x[position(p)·stride + (ky, kx) − padding, c]`
//!
//! Maps are channels last, so the values that a kernel row ky needs at a position are one run of Kw·C floats, and the
//! next position's run starts stride·C later. The product has output channels as rows, (kx, c) as columns, and
//! positions as depth. It reads everything in place, except an x with padding, or with Kw·C not a multiple of sixteen,
//! which is first copied with zeros around it.
//!
//! Sums over positions are divided into chunks by the shapes alone, computed separately and added in order.

use super::direct::{Maps, copy_row};
use super::shape::ConvShape;
use crate::parallel::{SharedSlice, for_each_unit};
use crate::product::{Epilogue, Operand, PANEL, PanelProduct, Prefetch};
use crate::scratch::Scratch;
use crate::simd::lanes::LANES;
use crate::simd::{Isa, transpose};

/// Approximate number of positions summed at a time, so that they are read repeatedly from a near cache.
const BLOCK_POSITIONS: usize = 256;
/// Minimum number of positions of a chunk.
const CHUNK_POSITIONS: usize = 2048;
/// Target number of units, so that no thread waits long for the last.
const MIN_UNITS: usize = 8;
/// Rows that a product processes at a time.
const TILE_ROWS: usize = 12;

/// The gradient with respect to the weight, `[Co, Ci, Kh, Kw]`.
pub(crate) fn weight_gradient(isa: Isa, x: Maps<'_>, output_grad: Maps<'_>, shape: &ConvShape) -> Vec<f32> {
    if super::winograd::suits(shape)
        && let Some(grad) = super::winograd::weight_gradient(isa, x, output_grad, shape)
    {
        return grad;
    }
    direct_weight_gradient(isa, x, output_grad, shape)
}

/// The weight's gradient by plain sums over positions.
pub(super) fn direct_weight_gradient(isa: Isa, x: Maps<'_>, output_grad: Maps<'_>, shape: &ConvShape) -> Vec<f32> {
    let padded = PaddedInput::new(x, shape);
    let [out_height, out_width] = shape.out_size;
    let [kernel_height, kernel_width] = shape.kernel;
    let (in_channels, out_channels) = (shape.in_channels, shape.out_channels);
    let positions = shape.num_images * out_height * out_width;

    // Blocks of whole output rows of one image, as equal as possible.
    let blocks_per_image = (out_height * out_width).div_ceil(BLOCK_POSITIONS).min(out_height);
    let block_rows = out_height.div_ceil(blocks_per_image);
    let blocks_per_image = out_height.div_ceil(block_rows);
    let num_blocks = shape.num_images * blocks_per_image;
    let num_chunks = (positions / CHUNK_POSITIONS).clamp(1, MIN_UNITS).min(num_blocks);

    let tiles = out_channels.div_ceil(TILE_ROWS);
    let groups = MIN_UNITS.div_ceil(num_chunks).min(tiles);
    let group_rows = tiles.div_ceil(groups) * TILE_ROWS;
    let groups = out_channels.div_ceil(group_rows);
    let run = kernel_width * in_channels;
    let per_filter = kernel_height * run;
    let len = out_channels * per_filter;

    // [chunk, Co, Kh, Kw·Ci]
    let mut partial = Scratch::take(num_chunks * len);
    let raw = SharedSlice::new(&mut partial).raw();
    for_each_unit(num_chunks * groups, |unit| {
        let (chunk, group) = (unit / groups, unit % groups);
        let filters = group * group_rows..out_channels.min((group + 1) * group_rows);
        let first_block = chunk * num_blocks / num_chunks;
        let end_block = (chunk + 1) * num_blocks / num_chunks;
        for block in first_block..end_block {
            let (image, y) = (block / blocks_per_image, block % blocks_per_image * block_rows);
            let rows = block_rows.min(out_height - y);
            let position = (image * out_height + y) * out_width;
            let left = Operand {
                values: &output_grad.values[position * out_channels + filters.start..],
                step: 1,
                inner: out_channels,
                outer: out_width * out_channels,
            };
            for kernel_y in 0..kernel_height {
                for first_column in (0..run).step_by(PANEL) {
                    let product = PanelProduct {
                        rows: filters.len(),
                        columns: PANEL.min(run - first_column),
                        depth: [rows, out_width],
                        left,
                        right: padded.rows(image, y, kernel_y, first_column),
                        at: chunk * len + filters.start * per_filter + kernel_y * run + first_column,
                        row_step: per_filter,
                        first_column: 0,
                        epilogue: Epilogue::default(),
                        accumulate: block > first_block,
                        prefetch: Prefetch::default(),
                    };
                    // SAFETY: every unit has its own chunk and filters.
                    unsafe { product.run(isa, raw) };
                }
            }
        }
    });

    let mut grad = vec![0.0; len];
    let shared_grad = SharedSlice::new(&mut grad);
    let shared = SharedSlice::new(&mut partial);
    for_each_unit(out_channels, |filter| {
        // SAFETY: every unit has its own filter, of all chunks.
        let sum = unsafe { shared.range(filter * per_filter, per_filter) };
        for chunk in 1..num_chunks {
            // SAFETY: the unit's filter of another chunk than `sum`'s.
            let other = unsafe { shared.range(chunk * len + filter * per_filter, per_filter) };
            for (sum, other) in sum.iter_mut().zip(other) {
                *sum += *other;
            }
        }
        // SAFETY: every unit has its own filter.
        let grad = unsafe { shared_grad.range(filter * per_filter, per_filter) };
        // [cells, channels] to [channels, cells]
        let cells = kernel_height * kernel_width;
        transpose(isa, sum, in_channels, grad, cells, cells, in_channels);
    });
    grad
}

/// x with zeros around it, `[N, Hp, Wp, C]`, and room for reads beyond the end.
struct PaddedInput<'a> {
    values: PaddedValues<'a>,
    height: usize,
    width: usize,
    channels: usize,
    /// Step from one output pixel to the next, in padded pixels.
    stride: [usize; 2],
}

enum PaddedValues<'a> {
    InPlace(&'a [f32]),
    Copied(Scratch),
}

impl<'a> PaddedInput<'a> {
    fn new(x: Maps<'a>, shape: &ConvShape) -> Self {
        let [in_height, in_width] = shape.in_size;
        let [out_height, out_width] = shape.out_size;
        let channels = shape.in_channels;
        // Kernel rows that end within a vector read further; at the last pixel they would leave the maps.
        let whole = (shape.kernel[1] * channels).is_multiple_of(LANES);
        if shape.params.padding == [0, 0] && whole {
            let values = PaddedValues::InPlace(x.values);
            return Self { values, height: in_height, width: in_width, channels, stride: shape.params.stride };
        }
        // A 1 × 1 kernel reads only every stride-th pixel, so that only those are copied.
        let pointwise = shape.kernel == [1, 1] && shape.params.padding == [0, 0];
        let (sampling, stride) = if pointwise { (shape.params.stride, [1, 1]) } else { ([1, 1], shape.params.stride) };
        let height = (out_height - 1) * stride[0] + shape.kernel[0];
        let width = (out_width - 1) * stride[1] + shape.kernel[1];
        let [padding_y, padding_x] = shape.params.padding;
        let row_len = width * channels;
        let mut values = Scratch::take(shape.num_images * height * row_len + PANEL);
        let shared = SharedSlice::new(&mut values);
        for_each_unit(shape.num_images * height, |unit| {
            let (image, padded_y) = (unit / height, unit % height);
            // SAFETY: every unit has its own row.
            let row = unsafe { shared.range(unit * row_len, row_len) };
            let y = (padded_y * sampling[0]).checked_sub(padding_y).filter(|&y| y < in_height);
            let Some(y) = y else {
                row.fill(0.0);
                return;
            };
            let source = &x.values[(image * in_height + y) * in_width * channels..][..in_width * channels];
            if sampling[1] > 1 {
                for (target, pixel) in row.chunks_exact_mut(channels).zip(source.chunks(channels * sampling[1])) {
                    target.copy_from_slice(&pixel[..channels]);
                }
                return;
            }
            copy_row(row, source, -((padding_x * channels) as isize));
        });
        // Values beyond the end are multiplied into columns that are never read.
        let end = values.len() - PANEL;
        values[end..].fill(0.0);
        Self { values: PaddedValues::Copied(values), height, width, channels, stride }
    }

    /// The input of kernel row `kernel_y`, beginning with output row `y` of an image and column `first` of the run.
    fn rows(&self, image: usize, y: usize, kernel_y: usize, first: usize) -> Operand<'_> {
        let values: &[f32] = match &self.values {
            PaddedValues::InPlace(values) => values,
            PaddedValues::Copied(values) => values,
        };
        let row_len = self.width * self.channels;
        let start = (image * self.height + y * self.stride[0] + kernel_y) * row_len + first;
        Operand {
            values: &values[start..],
            step: 1,
            inner: self.stride[1] * self.channels,
            outer: self.stride[0] * row_len,
        }
    }
}
