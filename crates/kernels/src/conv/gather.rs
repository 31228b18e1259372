//! A convolution as a matrix product whose right-hand side is gathered panel by panel.
//!
//! `output[m, p] = bias[m] + Σ_k filter[m, k] · source[channel(k), position(p)·stride + tap(k)]`
//!
//! where p runs over the grid positions of all images in one row, so that panels of 48 columns stay full on
//! small maps too. A convolution is one such product; the gradient with respect to its input, and a transposed
//! convolution, are one for each phase of the stride, each writing every stride-th pixel.
//!
//! Glossary: *tap*, a kernel cell as an offset from a grid position; *panel*, 48 positions with all their K
//! values gathered, in blocks of at most [`BLOCK_DEPTH`] so that they stay in the first-level cache; *band*,
//! a unit's rows of one image, copied with zeros around and columns sorted by stride phase, so that every tap
//! of a run of positions is a run of floats.

use crate::parallel::{Output, for_each_unit};
use crate::scratch::Scratch;
use crate::simd::{COLUMNS, ColumnRun, GROUP, Isa, ROWS, Rows, multiply_tile, pack_panel};

/// Rows of a panel gathered at a time: 192 · 48 floats are 36 KB.
const BLOCK_DEPTH: usize = 192;
/// Panels a unit of work has at most.
const UNIT_PANELS: usize = 13;
/// Units to aim at, so that no thread waits long for the last.
const MIN_UNITS: usize = 8;

/// A kernel cell: where it looks, from a grid position times stride.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tap {
    pub(crate) dy: isize,
    pub(crate) dx: isize,
}

/// Filters in the order the tiles read them: `[⌈M/8⌉, K, 8]`, zeros where M ends.
pub(crate) struct PackedFilters {
    values: Scratch,
    num_filters: usize,
}

impl PackedFilters {
    /// Filter m's k-th value is `weight[m · filter_step + offsets[k]]`.
    pub(crate) fn new(weight: &[f32], num_filters: usize, filter_step: usize, offsets: &[usize]) -> Self {
        let depth = offsets.len();
        let blocks = num_filters.div_ceil(ROWS);
        let mut values = Scratch::take(blocks * depth * ROWS);
        for (block, target) in values.chunks_exact_mut(depth * ROWS).enumerate() {
            let rows = ROWS.min(num_filters - block * ROWS);
            let base = &weight[block * ROWS * filter_step..];
            for (target, offset) in target.chunks_exact_mut(ROWS).zip(offsets) {
                for (idx, value) in target.iter_mut().enumerate() {
                    *value = if idx < rows { base[idx * filter_step + offset] } else { 0.0 };
                }
            }
        }
        Self { values, num_filters }
    }
}

/// The maps that are convolved, `[N, C, H, W]`.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a> {
    pub(crate) values: &'a [f32],
    pub(crate) num_images: usize,
    pub(crate) channels: usize,
    pub(crate) height: usize,
    pub(crate) width: usize,
}

/// Where grid positions land in the output maps.
#[derive(Clone, Copy)]
pub(crate) struct Target {
    /// Size of the output maps.
    pub(crate) size: [usize; 2],
    /// Pixel of the first grid position.
    pub(crate) origin: [usize; 2],
    /// From one grid position to the next.
    pub(crate) step: [usize; 2],
}

/// One gathered matrix product.
pub(crate) struct GatherConv<'a> {
    pub(crate) source: Source<'a>,
    pub(crate) taps: &'a [Tap],
    pub(crate) stride: [usize; 2],
    /// Positions computed, `[Gh, Gw]`.
    pub(crate) grid: [usize; 2],
    /// K runs over channels, and within a channel over taps.
    pub(crate) filters: &'a PackedFilters,
    pub(crate) bias: Option<&'a [f32]>,
    pub(crate) target: Target,
}

/// Where the K values of a position stand, in the maps themselves or in a unit's bands.
struct Reach {
    min_dy: isize,
    min_dx: isize,
    /// Rows and columns from the first tap to the last, inclusive.
    span: [usize; 2],
    /// Whether the maps are read in place: no tap leaves them, and columns follow each other.
    in_place: bool,
    /// Stride phases of a band's rows that some tap needs.
    phases: usize,
    /// Columns of one phase.
    phase_len: usize,
    /// Rows a band has room for.
    band_rows: usize,
    /// Offset of each k from its position.
    offsets: Vec<usize>,
}

impl Reach {
    fn new(conv: &GatherConv<'_>, unit_columns: usize) -> Self {
        let min_dy = conv.taps.iter().map(|tap| tap.dy).min().unwrap_or(0);
        let max_dy = conv.taps.iter().map(|tap| tap.dy).max().unwrap_or(0);
        let min_dx = conv.taps.iter().map(|tap| tap.dx).min().unwrap_or(0);
        let max_dx = conv.taps.iter().map(|tap| tap.dx).max().unwrap_or(0);
        let [grid_height, grid_width] = conv.grid;
        let [step_y, step_x] = conv.stride;
        let last_y = ((grid_height - 1) * step_y) as isize + max_dy;
        let last_x = ((grid_width - 1) * step_x) as isize + max_dx;
        let Source { channels, height, width, .. } = conv.source;
        let in_place = step_x == 1 && min_dy >= 0 && min_dx >= 0 && last_y < height as isize && last_x < width as isize;
        let span = [(max_dy - min_dy) as usize + 1, (max_dx - min_dx) as usize + 1];
        let phases = step_x.min(span[1]);
        let phase_len = ((grid_width - 1) * step_x + span[1]).div_ceil(step_x);
        // A unit that begins inside a row touches one row more.
        let rows = grid_height.min(unit_columns.div_ceil(grid_width) + 1);
        let band_rows = (rows - 1) * step_y + span[0];
        let mut offsets = Vec::with_capacity(channels * conv.taps.len());
        for channel in 0..channels {
            for tap in conv.taps {
                offsets.push(if in_place {
                    (channel * height + tap.dy as usize) * width + tap.dx as usize
                } else {
                    let y = (tap.dy - min_dy) as usize;
                    let x = (tap.dx - min_dx) as usize;
                    let row = (channel * band_rows + y) * phases + x % step_x;
                    row * phase_len + x / step_x
                });
            }
        }
        Self { min_dy, min_dx, span, in_place, phases, phase_len, band_rows, offsets }
    }

    fn band_len(&self, channels: usize) -> usize {
        channels * self.band_rows * self.phases * self.phase_len
    }
}

impl GatherConv<'_> {
    /// Computes all positions and writes them into `output`, `[N, M, H, W]` of the target's size.
    ///
    /// Writes every target pixel of the grid, and no other.
    pub(crate) fn run(&self, isa: Isa, output: &Output) {
        let [grid_height, grid_width] = self.grid;
        let num_columns = self.source.num_images * grid_height * grid_width;
        let num_panels = num_columns.div_ceil(COLUMNS);
        let unit_panels = num_panels.div_ceil(MIN_UNITS).min(UNIT_PANELS);
        let num_units = num_panels.div_ceil(unit_panels);
        // On the smallest maps the filters are shared out too.
        let filter_blocks = self.filters.num_filters.div_ceil(ROWS);
        let filter_chunks = MIN_UNITS.div_ceil(num_units).min(filter_blocks);
        let chunk_blocks = filter_blocks.div_ceil(filter_chunks);
        let filter_chunks = filter_blocks.div_ceil(chunk_blocks);

        let unit_columns = unit_panels * COLUMNS;
        let reach = Reach::new(self, unit_columns);
        for_each_unit(num_units * filter_chunks, |unit| {
            let first_column = unit / filter_chunks * unit_columns;
            let columns = first_column..(first_column + unit_columns).min(num_columns);
            let first_block = unit % filter_chunks * chunk_blocks;
            let blocks = first_block..(first_block + chunk_blocks).min(filter_blocks);
            self.run_unit(isa, &reach, columns, blocks, output);
        });
    }

    /// Computes grid positions `columns` for the filters of `blocks`.
    fn run_unit(
        &self,
        isa: Isa,
        reach: &Reach,
        columns: std::ops::Range<usize>,
        blocks: std::ops::Range<usize>,
        output: &Output,
    ) {
        let [grid_height, grid_width] = self.grid;
        let channels = self.source.channels;
        let positions = grid_height * grid_width;
        let first_image = columns.start / positions;
        let last_image = (columns.end - 1) / positions;
        let band_len = reach.band_len(channels);
        let mut bands = Scratch::take(if reach.in_place { 0 } else { (last_image - first_image + 1) * band_len });
        // First grid row of each band.
        let band_start = |image: usize| {
            if image == first_image { columns.start % positions / grid_width } else { 0 }
        };
        if !reach.in_place {
            for (image, band) in (first_image..=last_image).zip(bands.chunks_exact_mut(band_len)) {
                let end =
                    if image == last_image { (columns.end - 1) % positions / grid_width + 1 } else { grid_height };
                self.fill_band(reach, image, band_start(image)..end, band);
            }
        }
        let gathered_from = if reach.in_place { self.source.values } else { &bands };

        let depth = reach.offsets.len();
        let depth_blocks = depth.div_ceil(BLOCK_DEPTH).max(1);
        let block_depth = depth.div_ceil(depth_blocks);
        let mut panel = Scratch::take(block_depth * COLUMNS + GROUP);
        let mut tiles = Scratch::take(blocks.len() * ROWS * COLUMNS);
        let mut runs = Vec::new();
        for panel_start in columns.clone().step_by(COLUMNS) {
            let panel_columns = panel_start..(panel_start + COLUMNS).min(columns.end);
            let groups = panel_columns.len().div_ceil(GROUP);
            runs.clear();
            let mut column = panel_columns.start;
            while column < panel_columns.end {
                let image = column / positions;
                let (y, x) = (column % positions / grid_width, column % positions % grid_width);
                let mut len = (grid_width - x).min(panel_columns.end - column);
                let source = if reach.in_place {
                    if self.stride[0] == 1 && grid_width == self.source.width {
                        // Rows follow each other without a gap.
                        len = (positions - column % positions).min(panel_columns.end - column);
                    }
                    (image * channels * self.source.height + y * self.stride[0]) * self.source.width + x
                } else {
                    let row = (y - band_start(image)) * self.stride[0] * reach.phases;
                    (image - first_image) * band_len + row * reach.phase_len + x
                };
                runs.push(ColumnRun { source, column: column - panel_columns.start, len });
                column += len;
            }

            for (block_idx, offsets) in reach.offsets.chunks(block_depth).enumerate() {
                pack_panel(isa, &mut panel, gathered_from, offsets, &runs);
                let right = Rows { values: &panel, inner: offsets.len(), inner_step: COLUMNS, outer: 1, outer_step: 0 };
                for (block, tile) in blocks.clone().zip(tiles.chunks_exact_mut(ROWS * COLUMNS)) {
                    let start = (block * depth + block_idx * block_depth) * ROWS;
                    let left = &self.filters.values[start..start + offsets.len() * ROWS];
                    multiply_tile(isa, left, right, groups, tile, block_idx > 0);
                }
            }
            self.write_panel(&mut tiles, blocks.clone(), panel_columns, output);
        }
    }

    /// Copies grid rows `rows` of an image, with all that their taps reach, zeros outside the map.
    fn fill_band(&self, reach: &Reach, image: usize, rows: std::ops::Range<usize>, band: &mut [f32]) {
        let Source { values, channels, height, width, .. } = self.source;
        let [step_y, step_x] = self.stride;
        let row_len = reach.phases * reach.phase_len;
        let num_rows = (rows.len() - 1) * step_y + reach.span[0];
        let first_y = (rows.start * step_y) as isize + reach.min_dy;
        for channel in 0..channels {
            let plane = &values[(image * channels + channel) * height * width..][..height * width];
            let band = &mut band[channel * reach.band_rows * row_len..][..num_rows * row_len];
            for (row_idx, target) in band.chunks_exact_mut(row_len).enumerate() {
                if row_idx % step_y >= reach.span[0] {
                    continue;
                }
                let y = first_y + row_idx as isize;
                if y < 0 || y >= height as isize {
                    target.fill(0.0);
                    continue;
                }
                let source = &plane[y as usize * width..][..width];
                for (phase, target) in target.chunks_exact_mut(reach.phase_len).enumerate() {
                    copy_phase(target, source, reach.min_dx + phase as isize, step_x);
                }
            }
        }
    }

    /// Adds the bias and writes the tiles of a panel where they belong.
    fn write_panel(
        &self,
        tiles: &mut [f32],
        blocks: std::ops::Range<usize>,
        columns: std::ops::Range<usize>,
        output: &Output,
    ) {
        let [grid_height, grid_width] = self.grid;
        let positions = grid_height * grid_width;
        let num_filters = self.filters.num_filters;
        let [height, width] = self.target.size;
        let [step_y, step_x] = self.target.step;
        let [origin_y, origin_x] = self.target.origin;
        let dense = self.grid == self.target.size;
        for (block, tile) in blocks.zip(tiles.chunks_exact_mut(ROWS * COLUMNS)) {
            let filters = block * ROWS..num_filters.min((block + 1) * ROWS);
            for (filter, row) in filters.zip(tile.chunks_exact_mut(COLUMNS)) {
                if let Some(bias) = self.bias {
                    let bias = bias[filter];
                    row.iter_mut().for_each(|value| *value += bias);
                }
                let mut column = columns.start;
                while column < columns.end {
                    let image = column / positions;
                    let position = column % positions;
                    let plane = (image * num_filters + filter) * height * width;
                    let (at, len) = if dense {
                        (plane + position, positions - position)
                    } else {
                        let (y, x) = (position / grid_width, position % grid_width);
                        let at = (origin_y + y * step_y) * width + origin_x + x * step_x;
                        (plane + at, grid_width - x)
                    };
                    let len = len.min(columns.end - column);
                    let run = &row[column - columns.start..][..len];
                    // SAFETY: a unit alone writes its grid positions of its filters.
                    unsafe { output.write(at, if dense { 1 } else { step_x }, run) };
                    column += len;
                }
            }
        }
    }
}

/// `target[i] = source[start + i·step]`, zero outside the source.
fn copy_phase(target: &mut [f32], source: &[f32], start: isize, step: usize) {
    let before = if start < 0 { (start.unsigned_abs().div_ceil(step)).min(target.len()) } else { 0 };
    let first = start + (before * step) as isize;
    let inside = if first < source.len() as isize { (source.len() - first as usize).div_ceil(step) } else { 0 };
    let inside = inside.min(target.len() - before);
    target[..before].fill(0.0);
    target[before + inside..].fill(0.0);
    if inside == 0 {
        return;
    }
    let source = &source[first as usize..];
    let target = &mut target[before..before + inside];
    match step {
        1 => target.copy_from_slice(&source[..inside]),
        _ => {
            for (target, source) in target.iter_mut().zip(source.iter().step_by(step)) {
                *target = *source;
            }
        }
    }
}
