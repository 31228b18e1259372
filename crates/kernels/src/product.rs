//! The matrix product used by every convolution.
//!
//! `out[i, j] (+)= Σ_o Σ_k left[i·step + o·outer + k·inner] · right[j + o·outer + k·inner]`
//!
//! for up to 32 columns j, a *panel*. Twelve rows i are processed at a time, so 24 AVX-512 registers hold the
//! sums, and only complete sums are written. The depth has two loops (o, k), so the left side may be a window of
//! an image read in place: o runs over rows of the window, k along them.

#![allow(clippy::needless_range_loop)] // Rows and columns of a tile are numbers, here and in the sources.

use crate::parallel::Raw;
use crate::simd::lanes::{LANES, Lanes};
use crate::simd::lanes_kernel;

/// Columns of a panel.
pub(crate) const PANEL: usize = 32;
/// Floats of a cache line.
const LINE: usize = 16;

/// Positions of the values of one side.
#[derive(Clone, Copy)]
pub(crate) struct Operand<'a> {
    pub(crate) values: &'a [f32],
    /// Step from one row (left side) to the next; columns (right side) are adjacent.
    pub(crate) step: usize,
    pub(crate) inner: usize,
    pub(crate) outer: usize,
}

/// Operations on a sum before it is written: `relu(sum · scale + bias + residual)`; absent terms are left out.
#[derive(Clone, Copy, Default)]
pub(crate) struct Epilogue<'a> {
    /// A factor for each column.
    pub(crate) scale: Option<&'a [f32]>,
    /// A summand for each column.
    pub(crate) bias: Option<&'a [f32]>,
    /// A summand for each element of the output.
    pub(crate) residual: Option<&'a [f32]>,
    pub(crate) relu: bool,
}

impl<'a> Epilogue<'a> {
    /// Scale and bias of the columns from `first` on.
    fn columns(&self, first: usize) -> [Option<&'a [f32]>; 2] {
        [self.scale.map(|values| &values[first..]), self.bias.map(|values| &values[first..])]
    }
}

/// One panel of a product.
pub(crate) struct PanelProduct<'a> {
    pub(crate) rows: usize,
    /// Number of columns, at most [`PANEL`].
    pub(crate) columns: usize,
    /// Iterations of the outer and the inner loop over the depth.
    pub(crate) depth: [usize; 2],
    pub(crate) left: Operand<'a>,
    /// Readable for columns rounded up to 16.
    pub(crate) right: Operand<'a>,
    /// Index of the panel's element (0, 0) in the output.
    pub(crate) at: usize,
    /// Step from one row of the output to the next.
    pub(crate) row_step: usize,
    /// Column of the epilogue's vectors for the first column of the panel.
    pub(crate) first_column: usize,
    pub(crate) epilogue: Epilogue<'a>,
    /// Whether to add to the present values of the output.
    pub(crate) accumulate: bool,
    /// The data read next, to be prefetched.
    pub(crate) prefetch: Prefetch<'a>,
}

/// Memory runs that are prefetched while a product computes, a cache line at each step of its depth.
#[derive(Clone, Copy, Default)]
pub(crate) struct Prefetch<'a> {
    pub(crate) runs: [&'a [f32]; 2],
}

impl Prefetch<'_> {
    /// The next lines to prefetch, `steps` of them or fewer if there are no more: their start, and their stride.
    #[inline(always)]
    fn next(&mut self, steps: usize) -> (*const f32, usize) {
        for run in &mut self.runs {
            if !run.is_empty() {
                let (now, later) = run.split_at(run.len().min(steps * LINE));
                *run = later;
                // Lines beyond the end of a run may be prefetched, because a prefetch hint never faults.
                return (now.as_ptr(), LINE);
            }
        }
        (std::ptr::null(), 0)
    }
}

impl PanelProduct<'_> {
    /// Computes the panel and writes it.
    ///
    /// # Safety
    /// No other thread accesses the panel's elements of `output`, and they are initialised if it accumulates.
    pub(crate) unsafe fn run(&self, isa: crate::simd::Isa, output: Raw) {
        let [outer, inner] = self.depth;
        if self.rows == 0 || self.columns == 0 {
            return;
        }
        assert!(outer > 0 && inner > 0 && self.columns <= PANEL);
        let last = |operand: &Operand<'_>| (outer - 1) * operand.outer + (inner - 1) * operand.inner;
        assert!(self.left.values.len() > (self.rows - 1) * self.left.step + last(&self.left));
        assert!(self.right.values.len() >= last(&self.right) + self.columns.next_multiple_of(LANES));
        let end = self.at + (self.rows - 1) * self.row_step + self.columns;
        assert!(end <= output.len);
        assert!(self.epilogue.residual.is_none_or(|residual| residual.len() >= end));
        let [scale, bias] = self.epilogue.columns(self.first_column);
        assert!(scale.is_none_or(|scale| scale.len() >= self.columns));
        assert!(bias.is_none_or(|bias| bias.len() >= self.columns));
        // SAFETY: every access is within the asserted bounds, and the machine has `isa`.
        unsafe { panel(isa, self, output.at(self.at)) };
    }
}

lanes_kernel! {
    unsafe fn panel(product: &PanelProduct<'_>, output: *mut f32) = panel_lanes
}

/// Computes one panel of the product.
///
/// # Safety
/// As asserted by [`PanelProduct::run`].
#[inline(always)]
unsafe fn panel_lanes<L: Lanes>(product: &PanelProduct<'_>, output: *mut f32) {
    let tiles = product.rows.div_ceil(L::ROWS);
    let mut row = 0;
    let mut prefetch = product.prefetch;
    for tile in 0..tiles {
        // Tiles of nearly equal height, because in a short tile each addition waits for the one before.
        let rows = (product.rows - row).div_ceil(tiles - tile);
        let step = LANES * L::VECTORS;
        let mut column = 0;
        while column < product.columns {
            let columns = (product.columns - column).min(step);
            // SAFETY: within the product.
            unsafe {
                if columns > LANES {
                    tile_of_rows::<L, 2>(product, output, row, rows, column, columns, &mut prefetch);
                } else {
                    tile_of_rows::<L, 1>(product, output, row, rows, column, columns, &mut prefetch);
                }
            }
            column += step;
        }
        row += rows;
    }
}

#[inline(always)]
unsafe fn tile_of_rows<L: Lanes, const V: usize>(
    product: &PanelProduct<'_>,
    output: *mut f32,
    row: usize,
    rows: usize,
    column: usize,
    columns: usize,
    prefetch: &mut Prefetch<'_>,
) {
    macro_rules! choose {
        ($($count:literal)*) => {
            match rows {
                // SAFETY: within the product, and `rows` is the count.
                $($count if $count <= L::ROWS => unsafe { tile::<L, $count, V>(product, output, row, column, columns, prefetch) },)*
                _ => unreachable!("a tile has 1 to {} rows", L::ROWS),
            }
        };
    }
    choose!(1 2 3 4 5 6 7 8 9 10 11 12)
}

/// Rows `row..row + R`, columns `column..column + columns`, in V lanes.
#[inline(always)]
unsafe fn tile<L: Lanes, const R: usize, const V: usize>(
    product: &PanelProduct<'_>,
    output: *mut f32,
    row: usize,
    column: usize,
    columns: usize,
    prefetch: &mut Prefetch<'_>,
) {
    let [outer, inner] = product.depth;
    let (mut line, line_step) = prefetch.next(outer * inner);
    let (left, right) = (&product.left, &product.right);
    // SAFETY: reads are the operands' within the depth, as asserted; writes are the tile's. `wrapping_add`
    // only steps past the last.
    unsafe {
        let mut sums = [[L::splat(0.0); V]; R];
        let mut left_run = left.values.as_ptr().add(row * left.step);
        let mut right_run = right.values.as_ptr().add(column);
        let step = left.step;
        for _ in 0..outer {
            // Four pointers three rows apart: an address is a pointer plus 0, 1 or 2 steps.
            let mut at = [left_run, left_run, left_run, left_run];
            for (idx, at) in at.iter_mut().enumerate() {
                *at = left_run.wrapping_add(3 * idx * step);
            }
            let mut of_right = right_run;
            for _ in 0..inner {
                let mut values = [L::splat(0.0); V];
                for (idx, value) in values.iter_mut().enumerate() {
                    *value = L::load(of_right.add(idx * LANES));
                }
                for (idx, sums) in sums.iter_mut().enumerate() {
                    let factor = L::splat(*at[idx / 3].add(idx % 3 * step));
                    for (sum, value) in sums.iter_mut().zip(values) {
                        *sum = factor.mul_add(value, *sum);
                    }
                }
                for at in &mut at {
                    *at = at.wrapping_add(left.inner);
                }
                of_right = of_right.wrapping_add(right.inner);
                L::prefetch(line);
                line = line.wrapping_add(line_step);
            }
            left_run = left_run.wrapping_add(left.outer);
            right_run = right_run.wrapping_add(right.outer);
        }
        finish::<L, R, V>(product, output, sums, row, column, columns);
    }
}

#[inline(always)]
unsafe fn finish<L: Lanes, const R: usize, const V: usize>(
    product: &PanelProduct<'_>,
    output: *mut f32,
    mut sums: [[L; V]; R],
    row: usize,
    column: usize,
    columns: usize,
) {
    let first = product.first_column + column;
    // Floats of each lane; no closures, which would lack the instructions enabled for their function.
    let mut lens = [LANES; V];
    for idx in 0..V {
        lens[idx] = (columns - idx * LANES).min(LANES);
    }
    let whole = columns == V * LANES;
    // SAFETY: the tile's elements, and the epilogue's columns, all asserted.
    unsafe {
        let target = output.add(row * product.row_step + column);
        if product.accumulate {
            for at in 0..R {
                for idx in 0..V {
                    let from = target.add(at * product.row_step + idx * LANES);
                    sums[at][idx] = sums[at][idx].add(load::<L>(from, whole, lens[idx]));
                }
            }
        }
        if product.epilogue.scale.is_some() || product.epilogue.bias.is_some() {
            for idx in 0..V {
                let mut scale = L::splat(1.0);
                if let Some(values) = product.epilogue.scale {
                    scale = load::<L>(values.as_ptr().add(first + idx * LANES), whole, lens[idx]);
                }
                let mut bias = L::splat(0.0);
                if let Some(values) = product.epilogue.bias {
                    bias = load::<L>(values.as_ptr().add(first + idx * LANES), whole, lens[idx]);
                }
                for at in 0..R {
                    sums[at][idx] = sums[at][idx].mul_add(scale, bias);
                }
            }
        }
        if let Some(residual) = product.epilogue.residual {
            let residual = residual.as_ptr().add(product.at + row * product.row_step + column);
            for at in 0..R {
                for idx in 0..V {
                    let from = residual.add(at * product.row_step + idx * LANES);
                    sums[at][idx] = sums[at][idx].add(load::<L>(from, whole, lens[idx]));
                }
            }
        }
        if product.epilogue.relu {
            for at in 0..R {
                for idx in 0..V {
                    sums[at][idx] = sums[at][idx].relu();
                }
            }
        }
        for at in 0..R {
            for idx in 0..V {
                let to = target.add(at * product.row_step + idx * LANES);
                if whole {
                    sums[at][idx].store(to);
                } else {
                    sums[at][idx].store_first(to, lens[idx]);
                }
            }
        }
    }
}

/// Loads sixteen floats, or the first `len` if the group is not `whole`.
///
/// # Safety
/// Sixteen floats, or the first `len` of an incomplete group, are readable.
#[inline(always)]
unsafe fn load<L: Lanes>(from: *const f32, whole: bool, len: usize) -> L {
    // SAFETY: the caller promises that 16 floats, or `len`, can be read.
    unsafe { if whole { L::load(from) } else { L::load_first(from, len) } }
}

/// Width of the storage of panel `panel` of `columns` columns: 32, or 16 if that is enough.
pub(crate) fn panel_width(columns: usize, panel: usize) -> usize {
    let left = columns - panel * PANEL;
    if left > LANES { PANEL } else { LANES }
}

/// Number of floats of panels with `columns` columns and a depth.
pub(crate) fn packed_len(columns: usize, depth: usize) -> usize {
    columns.next_multiple_of(LANES) * depth
}
