//! A convolution as one matrix product whose left side is read in place.
//!
//! Maps are channels last, so that the input of a kernel row at a position is one run of floats, and the next
//! position's run starts `stride · C` later. The rows of the product are positions; its depth runs over the rows of the
//! kernel and the floats of a run. If the kernel extends beyond the edges, a unit first copies its rows with zeros
//! around them.

use super::panels::Panels;
use crate::parallel::{Raw, for_each_unit};
use crate::product::{Epilogue, Operand, PANEL, PanelProduct, Prefetch};
use crate::scratch::Scratch;
use crate::simd::Isa;

/// Approximate number of positions per unit of work: 96 rows of 256 floats are 98 KB.
const UNIT_POSITIONS: usize = 96;
/// Approximate number of positions per unit if the unit copies its input: neighbouring rows share the copy, so larger
/// units are better.
const COPYING_UNIT_POSITIONS: usize = 240;
/// Maximum number of floats of a run that are multiplied at a time, so that a panel's part remains in a near cache.
const BLOCK_DEPTH: usize = 2048;
/// Target number of units, so that no thread waits long for the last.
const MIN_UNITS: usize = 8;

/// Channels-last maps, `[N, H, W, C]`.
#[derive(Clone, Copy)]
pub(crate) struct Maps<'a> {
    pub(crate) values: &'a [f32],
    pub(crate) num_images: usize,
    pub(crate) size: [usize; 2],
    pub(crate) channels: usize,
}

/// The positions of grid points in the output maps.
#[derive(Clone, Copy)]
pub(crate) struct Target {
    /// Size of the output maps.
    pub(crate) size: [usize; 2],
    /// Pixel of the first grid position.
    pub(crate) origin: [usize; 2],
    /// Step from one grid position to the next.
    pub(crate) step: [usize; 2],
}

/// Positions whose inputs are one run of floats each, at equal steps in memory.
#[derive(Clone, Copy)]
struct Runs {
    /// Number of positions.
    count: usize,
    /// Floats from the start of one run to the next.
    step: usize,
    /// Floats of a run.
    len: usize,
    /// Output pixel of the first position.
    pixel: usize,
}

/// A convolution, or one phase of a transposed convolution.
pub(crate) struct DirectConv<'a> {
    pub(crate) source: Maps<'a>,
    /// Input pixel of the window's first cell at the first position.
    pub(crate) first: [isize; 2],
    /// Cells of the window.
    pub(crate) window: [usize; 2],
    pub(crate) stride: [usize; 2],
    /// Number of computed positions.
    pub(crate) grid: [usize; 2],
    pub(crate) filters: &'a Panels,
    pub(crate) epilogue: Epilogue<'a>,
    pub(crate) target: Target,
}

impl DirectConv<'_> {
    /// Computes all positions and writes them to `output`, `[N, H, W, M]` of the target's size for M output channels.
    ///
    /// # Safety
    /// Nothing else accesses the grid's pixels of `output`.
    pub(crate) unsafe fn run(&self, isa: Isa, output: Raw) {
        let Maps { num_images, size: [height, width], channels, .. } = self.source;
        let Target { size, origin, .. } = self.target;
        let reach = |axis: usize| self.window[axis] + (self.grid[axis] - 1) * self.stride[axis];
        let pointwise = self.window == [1, 1] && self.stride == [1, 1] && self.grid == [height, width];
        let from_first = self.first == [0, 0];
        // SAFETY: the caller promises that nothing else accesses the target's pixels of `output`.
        unsafe {
            if from_first && pointwise && self.grid == size {
                let runs = Runs { count: num_images * height * width, step: channels, len: channels, pixel: 0 };
                self.run_runs(isa, output, runs);
            } else if from_first && num_images == 1 && self.grid[0] == 1 && self.window[0] == 1 && reach(1) <= width {
                let (step, len) = (self.stride[1] * channels, self.window[1] * channels);
                let pixel = origin[0] * size[1] + origin[1];
                self.run_runs(isa, output, Runs { count: self.grid[1], step, len, pixel });
            } else {
                self.run_window(isa, output);
            }
        }
    }

    fn num_panels(&self) -> usize {
        self.filters.columns.div_ceil(PANEL)
    }

    /// Computes positions whose input is one run of floats each.
    ///
    /// # Safety
    /// As for [`Self::run`].
    unsafe fn run_runs(&self, isa: Isa, output: Raw, runs: Runs) {
        let values = self.source.values;
        let Runs { count, step, len, pixel } = runs;
        let blocks = len.div_ceil(BLOCK_DEPTH);
        // Deep weights are larger than the caches, and each chunk reads all of them.
        let min_chunks = if blocks == 1 { MIN_UNITS.min(count.div_ceil(12)) } else { 1 };
        let chunks = count.div_ceil(UNIT_POSITIONS).max(min_chunks);
        let chunk = count.div_ceil(chunks).next_multiple_of(12);
        let chunks = count.div_ceil(chunk);
        let groups = MIN_UNITS.div_ceil(chunks).min(self.num_panels());
        for_each_unit(chunks * groups, |unit| {
            let (first, group) = (unit / groups * chunk, unit % groups);
            let end = count.min(first + chunk);
            // The last position's step may end beyond the maps.
            let next = [end, count.min(end + chunk)].map(|position| (position * step).min(values.len()));
            let next = if blocks == 1 { &values[next[0]..next[1]] } else { &[] };
            for block in 0..blocks {
                let [start, stop] = [block * len / blocks, (block + 1) * len / blocks];
                let at = first * step + start;
                let left = Operand { values: &values[at..], step, inner: 1, outer: 0 };
                for panel in self.panels_of(group, groups) {
                    let pixel = pixel + first * self.target.step[1];
                    let mut product = self.product(panel, end - first, left, [1, stop - start], pixel);
                    product.right.values = &product.right.values[start * product.right.inner..];
                    product.accumulate = block > 0;
                    if block + 1 < blocks {
                        product.epilogue = Epilogue::default();
                    }
                    product.prefetch = self.prefetch(panel, self.panels_of(group, groups).end, start, next);
                    // SAFETY: a unit has its own positions and panels.
                    unsafe { product.run(isa, output) };
                }
            }
        });
    }

    unsafe fn run_window(&self, isa: Isa, output: Raw) {
        let Maps { values, num_images, size: [height, width], channels } = self.source;
        let [grid_height, grid_width] = self.grid;
        let [step_y, step_x] = self.stride;
        let last = |axis: usize| {
            let window = self.window[axis] - 1 + (self.grid[axis] - 1) * self.stride[axis];
            self.first[axis] + window as isize
        };
        let in_place =
            self.first[0] >= 0 && self.first[1] >= 0 && last(0) < height as isize && last(1) < width as isize;
        let unit_positions = if in_place { UNIT_POSITIONS } else { COPYING_UNIT_POSITIONS };
        let unit_rows = (unit_positions / grid_width).clamp(1, grid_height);
        let bands = grid_height.div_ceil(unit_rows).max(MIN_UNITS.div_ceil(num_images).min(grid_height));
        let unit_rows = grid_height.div_ceil(bands);
        let bands = grid_height.div_ceil(unit_rows);
        let groups = MIN_UNITS.div_ceil(num_images * bands).min(self.num_panels());
        for_each_unit(num_images * bands * groups, |unit| {
            let (image, band, group) = (unit / groups / bands, unit / groups % bands, unit % groups);
            let rows = band * unit_rows..grid_height.min((band + 1) * unit_rows);
            let copied;
            let (source, row_len) = if in_place {
                let y = image * height + rows.start * step_y + self.first[0] as usize;
                (&values[(y * width + self.first[1] as usize) * channels..], width * channels)
            } else {
                copied = self.copy_band(image, rows.clone());
                (&copied[..], ((grid_width - 1) * step_x + self.window[1]) * channels)
            };
            for panel in self.panels_of(group, groups) {
                for y in rows.clone() {
                    let left = Operand {
                        values: &source[(y - rows.start) * step_y * row_len..],
                        step: step_x * channels,
                        inner: 1,
                        outer: row_len,
                    };
                    let Target { size, origin, step } = self.target;
                    let pixel = (image * size[0] + origin[0] + y * step[0]) * size[1] + origin[1];
                    let depth = [self.window[0], self.window[1] * channels];
                    let product = self.product(panel, grid_width, left, depth, pixel);
                    // SAFETY: a unit has its own rows and panels.
                    unsafe { product.run(isa, output) };
                }
            }
        });
    }

    /// The panels of group number `group` of `groups`.
    fn panels_of(&self, group: usize, groups: usize) -> std::ops::Range<usize> {
        let panels = self.num_panels();
        group * panels / groups..(group + 1) * panels / groups
    }

    fn product<'a>(
        &'a self,
        panel: usize,
        rows: usize,
        left: Operand<'a>,
        depth: [usize; 2],
        pixel: usize,
    ) -> PanelProduct<'a> {
        let filters = self.filters;
        let (values, width) = filters.panel(0, panel);
        let first_column = panel * PANEL;
        PanelProduct {
            rows,
            columns: PANEL.min(filters.columns - first_column),
            depth,
            left,
            right: Operand { values, step: 1, inner: width, outer: depth[1] * width },
            at: pixel * filters.columns + first_column,
            row_step: self.target.step[1] * filters.columns,
            first_column,
            epilogue: self.epilogue,
            accumulate: false,
            prefetch: Prefetch::default(),
        }
    }

    /// The data read after a panel: the next panel from row `start` of its depth on or, after the last panel before
    /// `end`, the next unit's positions (`next`).
    fn prefetch<'a>(&'a self, panel: usize, end: usize, start: usize, next: &'a [f32]) -> Prefetch<'a> {
        let run = if panel + 1 < end {
            let (values, width) = self.filters.panel(0, panel + 1);
            &values[start * width..]
        } else {
            next
        };
        Prefetch { runs: [run, &[]] }
    }

    /// The input of the window for the grid rows `rows` of an image, zeros outside the map.
    fn copy_band(&self, image: usize, rows: std::ops::Range<usize>) -> Scratch {
        let Maps { values, size: [height, width], channels, .. } = self.source;
        let band_width = (self.grid[1] - 1) * self.stride[1] + self.window[1];
        let band_height = (rows.len() - 1) * self.stride[0] + self.window[0];
        let mut band = Scratch::take(band_width * band_height * channels);
        let first_y = (rows.start * self.stride[0]) as isize + self.first[0];
        for (row, target) in band.chunks_exact_mut(band_width * channels).enumerate() {
            let y = first_y + row as isize;
            if y < 0 || y >= height as isize {
                target.fill(0.0);
                continue;
            }
            let source = &values[(image * height + y as usize) * width * channels..][..width * channels];
            copy_row(target, source, self.first[1] * channels as isize);
        }
        band
    }
}

/// `target[i] = source[first + i]`, zeros outside the source.
pub(super) fn copy_row(target: &mut [f32], source: &[f32], first: isize) {
    let before = if first < 0 { first.unsigned_abs().min(target.len()) } else { 0 };
    let from = first.max(0) as usize;
    let inside = source.len().saturating_sub(from).min(target.len() - before);
    target[..before].fill(0.0);
    if inside > 0 {
        target[before..before + inside].copy_from_slice(&source[from..from + inside]);
    }
    target[before + inside..].fill(0.0);
}
