//! The gradient of a convolution with respect to its weight.
//!
//! `grad[m, ky, kx, c] = Σ_p output_grad[m, p] · x[c, position(p)·stride + (ky, kx) − padding]`
//!
//! With x copied channels-last and zeros around it, the values that a kernel row ky needs of a position are
//! one run of Kw·C floats, and the next position's begin stride·C later: the product's right-hand side is read
//! where it stands, nothing is gathered. The left-hand side is the output gradient with 8 channels interleaved.
//!
//! Sums over positions are cut into chunks by the shapes alone, computed apart and added in order.

use super::kernel::ConvShape;
use crate::parallel::{SharedSlice, for_each_unit};
use crate::scratch::Scratch;
use crate::simd::{COLUMNS, GROUP, Isa, ROWS, Rows, multiply_tile, transpose};

/// Positions a tile sums at a time, at most: 208 rows of 48 floats are 39 KB.
const BLOCK_POSITIONS: usize = 208;
/// Positions that are worth a chunk of their own.
const CHUNK_POSITIONS: usize = 2048;
/// Units to aim at, so that no thread waits long for the last.
const MIN_UNITS: usize = 8;
const TILE: usize = ROWS * COLUMNS;

/// The gradient with respect to the weight, `[Co, Ci, Kh, Kw]`.
pub(crate) fn weight_gradient(isa: Isa, x: &[f32], output_grad: &[f32], shape: &ConvShape) -> Vec<f32> {
    let padded = PaddedInput::new(isa, x, shape);
    let left = interleave_channels(isa, output_grad, shape);
    let [out_height, out_width] = shape.out_size;
    let [kernel_height, kernel_width] = shape.kernel;
    let channels = shape.in_channels;
    let positions = shape.num_images * out_height * out_width;

    // Blocks of whole output rows of one image, as even as they come.
    let blocks_per_image = (out_height * out_width).div_ceil(BLOCK_POSITIONS).min(out_height);
    let block_rows = out_height.div_ceil(blocks_per_image);
    let blocks_per_image = out_height.div_ceil(block_rows);
    let num_blocks = shape.num_images * blocks_per_image;
    let num_chunks = (positions / CHUNK_POSITIONS).clamp(1, MIN_UNITS).min(num_blocks);

    // Tiles of the gradient: [⌈Co/8⌉, Kh, ⌈Kw·C/48⌉].
    let filter_blocks = shape.out_channels.div_ceil(ROWS);
    let filter_chunks = MIN_UNITS.div_ceil(num_chunks).min(filter_blocks);
    let chunk_filters = filter_blocks.div_ceil(filter_chunks);
    let filter_chunks = filter_blocks.div_ceil(chunk_filters);
    let run = kernel_width * channels;
    let panels = run.div_ceil(COLUMNS);
    let filter_len = kernel_height * panels * TILE;

    let mut partial = Scratch::take(num_chunks * filter_blocks * filter_len);
    let shared = SharedSlice::new(&mut partial);
    for_each_unit(num_chunks * filter_chunks, |unit| {
        let chunk = unit / filter_chunks;
        let first_filter = unit % filter_chunks * chunk_filters;
        let filters = first_filter..(first_filter + chunk_filters).min(filter_blocks);
        let start = (chunk * filter_blocks + first_filter) * filter_len;
        // SAFETY: every unit has its own chunk and filters.
        let tiles = unsafe { shared.range(start, filters.len() * filter_len) };
        let first_block = chunk * num_blocks / num_chunks;
        let end_block = (chunk + 1) * num_blocks / num_chunks;
        for block in first_block..end_block {
            let image = block / blocks_per_image;
            let y = block % blocks_per_image * block_rows;
            let rows = block_rows.min(out_height - y);
            for kernel_y in 0..kernel_height {
                for panel in 0..panels {
                    let right = padded.rows(image, y, kernel_y, rows, panel * COLUMNS);
                    let groups = (run - panel * COLUMNS).min(COLUMNS).div_ceil(GROUP);
                    for (slot, filter) in filters.clone().enumerate() {
                        let position = (image * out_height + y) * out_width;
                        let at = (filter * positions + position) * ROWS;
                        let left = &left[at..at + rows * out_width * ROWS];
                        let tile = (slot * kernel_height + kernel_y) * panels + panel;
                        let tile = &mut tiles[tile * TILE..][..TILE];
                        multiply_tile(isa, left, right, groups, tile, block > first_block);
                    }
                }
            }
        }
    });

    let mut grad = vec![0.0; shape.weight().iter().product()];
    let per_filter = channels * kernel_height * kernel_width;
    let shared_grad = SharedSlice::new(&mut grad);
    let shared = SharedSlice::new(&mut partial);
    for_each_unit(filter_blocks, |block| {
        // SAFETY: every unit has its own filters, of all chunks.
        let sum = unsafe { shared.range(block * filter_len, filter_len) };
        for chunk in 1..num_chunks {
            let start = (chunk * filter_blocks + block) * filter_len;
            // SAFETY: as above; another chunk than `sum`.
            let other = unsafe { shared.range(start, filter_len) };
            for (sum, other) in sum.iter_mut().zip(other) {
                *sum += *other;
            }
        }
        for row in 0..ROWS.min(shape.out_channels - block * ROWS) {
            let start = (block * ROWS + row) * per_filter;
            // SAFETY: every unit has its own filters.
            let grad = unsafe { shared_grad.range(start, per_filter) };
            for kernel_y in 0..kernel_height {
                for column in 0..run {
                    let tile = (kernel_y * panels + column / COLUMNS) * TILE;
                    let value = sum[tile + row * COLUMNS + column % COLUMNS];
                    let (kernel_x, channel) = (column / channels, column % channels);
                    grad[(channel * kernel_height + kernel_y) * kernel_width + kernel_x] = value;
                }
            }
        }
    });
    grad
}

/// x as `[N, Hp, Wp, C]`, zeros around it, and room to read past the end.
struct PaddedInput {
    values: Scratch,
    height: usize,
    width: usize,
    channels: usize,
    out_width: usize,
    /// From one output pixel to the next, in padded pixels.
    stride: [usize; 2],
}

impl PaddedInput {
    fn new(isa: Isa, x: &[f32], shape: &ConvShape) -> Self {
        let [in_height, in_width] = shape.in_size;
        let [out_height, out_width] = shape.out_size;
        let channels = shape.in_channels;
        // A 1 × 1 kernel looks at every stride-th pixel only, so only those are copied.
        let pointwise = shape.kernel == [1, 1] && shape.params.padding == [0, 0];
        let (sampling, stride) = if pointwise { (shape.params.stride, [1, 1]) } else { ([1, 1], shape.params.stride) };
        let height = (out_height - 1) * stride[0] + shape.kernel[0];
        let width = (out_width - 1) * stride[1] + shape.kernel[1];
        let [padding_y, padding_x] = shape.params.padding;
        let row_len = width * channels;
        let mut values = Scratch::take(shape.num_images * height * row_len + COLUMNS);
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
            let image = &x[image * channels * in_height * in_width..];
            if sampling[1] > 1 {
                for (at, pixel) in row.chunks_exact_mut(channels).enumerate() {
                    for (channel, value) in pixel.iter_mut().enumerate() {
                        *value = image[(channel * in_height + y) * in_width + at * sampling[1]];
                    }
                }
                return;
            }
            let before = padding_x.min(width);
            let inside = in_width.min(width - before);
            row[..before * channels].fill(0.0);
            row[(before + inside) * channels..].fill(0.0);
            transpose(
                isa,
                &image[y * in_width..],
                in_height * in_width,
                &mut row[before * channels..],
                channels,
                channels,
                inside,
            );
        });
        // What lies past the end is multiplied into columns that nobody reads.
        let end = values.len() - COLUMNS;
        values[end..].fill(0.0);
        Self { values, height, width, channels, out_width, stride }
    }

    /// What kernel row `kernel_y` sees from `rows` output rows, from column `first` of its run on.
    fn rows(&self, image: usize, y: usize, kernel_y: usize, rows: usize, first: usize) -> Rows<'_> {
        let row_len = self.width * self.channels;
        let start = (image * self.height + y * self.stride[0] + kernel_y) * row_len + first;
        Rows {
            values: &self.values[start..],
            inner: self.out_width,
            inner_step: self.stride[1] * self.channels,
            outer: rows,
            outer_step: self.stride[0] * row_len,
        }
    }
}

/// `[N, Co, P]` to `[⌈Co/8⌉, N·P, 8]`, zeros where Co ends.
fn interleave_channels(isa: Isa, output_grad: &[f32], shape: &ConvShape) -> Scratch {
    let pixels = shape.out_size[0] * shape.out_size[1];
    let channels = shape.out_channels;
    let blocks = channels.div_ceil(ROWS);
    let mut values = Scratch::take(blocks * shape.num_images * pixels * ROWS);
    let shared = SharedSlice::new(&mut values);
    for_each_unit(blocks * shape.num_images, |unit| {
        let (block, image) = (unit / shape.num_images, unit % shape.num_images);
        // SAFETY: every unit has its own channels and image.
        let target = unsafe { shared.range(unit * pixels * ROWS, pixels * ROWS) };
        let rows = ROWS.min(channels - block * ROWS);
        if rows < ROWS {
            target.fill(0.0);
        }
        let source = &output_grad[(image * channels + block * ROWS) * pixels..];
        transpose(isa, source, pixels, target, ROWS, rows, pixels);
    });
    values
}
