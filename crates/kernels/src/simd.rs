//! The inner loop of every matrix product here, in as wide vectors as the machine has.
//!
//! A *tile* is 8 rows by up to 48 columns of a product. Its sums stay in registers while the products run
//! along: 24 AVX-512 accumulators leave room for the three vectors of the right-hand side. Narrower machines
//! work the same tile off in parts, so that data is laid out alike everywhere.

use std::sync::OnceLock;

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{
    __m256, __m512, __mmask16, _mm256_add_ps, _mm256_fmadd_ps, _mm256_loadu_ps, _mm256_set1_ps, _mm256_setzero_ps,
    _mm256_storeu_ps, _mm512_add_ps, _mm512_fmadd_ps, _mm512_loadu_ps, _mm512_maskz_loadu_ps, _mm512_set1_ps,
    _mm512_setzero_ps, _mm512_storeu_ps,
};

/// Rows of a tile.
pub(crate) const ROWS: usize = 8;
/// Columns are worked off in groups of this many.
pub(crate) const GROUP: usize = 16;
/// Columns of a tile, three groups.
pub(crate) const COLUMNS: usize = 48;

/// The instructions a tile is computed with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Isa {
    #[cfg(target_arch = "x86_64")]
    Avx512,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    Portable,
}

impl Isa {
    /// The widest this machine has.
    pub(crate) fn detect() -> Self {
        static DETECTED: OnceLock<Isa> = OnceLock::new();
        *DETECTED.get_or_init(|| Self::available()[0])
    }

    /// All this machine has, widest first.
    pub(crate) fn available() -> Vec<Self> {
        let mut available = Vec::new();
        #[cfg(target_arch = "x86_64")]
        {
            let avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
            if avx2 && is_x86_feature_detected!("avx512f") {
                available.push(Self::Avx512);
            }
            if avx2 {
                available.push(Self::Avx2);
            }
        }
        available.push(Self::Portable);
        available
    }
}

/// The right-hand side of a tile: `outer` runs of `inner` rows, each row at least as long as the tile is wide.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rows<'a> {
    pub(crate) values: &'a [f32],
    /// Rows of a run.
    pub(crate) inner: usize,
    /// From one row to the next.
    pub(crate) inner_step: usize,
    /// Number of runs.
    pub(crate) outer: usize,
    /// From the first row of a run to that of the next.
    pub(crate) outer_step: usize,
}

/// `tile (+)= Σ_k left[k][0..8]ᵀ · right[k][0..16·groups]`.
///
/// `left` holds 8 values for each row of `right`; `tile` is `[8, 48]`, of which the first `16·groups` columns
/// are written.
pub(crate) fn multiply_tile(
    isa: Isa,
    left: &[f32],
    right: Rows<'_>,
    groups: usize,
    tile: &mut [f32],
    accumulate: bool,
) {
    let rows = right.outer * right.inner;
    assert!(rows > 0 && (1..=3).contains(&groups) && tile.len() >= ROWS * COLUMNS);
    assert!(left.len() >= rows * ROWS);
    let last_row = (right.outer - 1) * right.outer_step + (right.inner - 1) * right.inner_step;
    assert!(right.values.len() >= last_row + groups * GROUP);
    match isa {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the machine has AVX-512 (`Isa::available`); bounds were asserted above.
        Isa::Avx512 => unsafe {
            match groups {
                1 => tile_avx512::<1>(left, right, tile, accumulate),
                2 => tile_avx512::<2>(left, right, tile, accumulate),
                _ => tile_avx512::<3>(left, right, tile, accumulate),
            }
        },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the machine has AVX2 and FMA (`Isa::available`); bounds were asserted above, and the
        // columns of the calls together are `16·groups`.
        Isa::Avx2 => unsafe {
            for row in [0, 4] {
                match groups {
                    1 => tile_avx2::<2>(left, right, tile, accumulate, row, 0),
                    2 => {
                        tile_avx2::<2>(left, right, tile, accumulate, row, 0);
                        tile_avx2::<2>(left, right, tile, accumulate, row, 16);
                    }
                    _ => {
                        tile_avx2::<3>(left, right, tile, accumulate, row, 0);
                        tile_avx2::<3>(left, right, tile, accumulate, row, 24);
                    }
                }
            }
        },
        Isa::Portable => {
            for row in [0, 4] {
                for group in 0..groups {
                    tile_portable(left, right, tile, accumulate, row, group * GROUP);
                }
            }
        }
    }
}

/// # Safety
/// AVX-512 is there, and `multiply_tile`'s assertions hold for `GROUPS`.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
unsafe fn tile_avx512<const GROUPS: usize>(left: &[f32], right: Rows<'_>, tile: &mut [f32], accumulate: bool) {
    let mut sums: [[__m512; GROUPS]; ROWS] = [[_mm512_setzero_ps(); GROUPS]; ROWS];
    let mut left = left.as_ptr();
    // SAFETY: `left` has 8 values a row of `right`, every row of `right` has 16·GROUPS values, and the tile
    // has 8 rows of 48, all by the caller's assertions. `wrapping_add` only steps past the last row.
    unsafe {
        let mut run = right.values.as_ptr();
        for _ in 0..right.outer {
            let mut row = run;
            for _ in 0..right.inner {
                let mut columns = [_mm512_setzero_ps(); GROUPS];
                for (group, columns) in columns.iter_mut().enumerate() {
                    *columns = _mm512_loadu_ps(row.add(group * GROUP));
                }
                for (idx, sums) in sums.iter_mut().enumerate() {
                    let factor = _mm512_set1_ps(*left.add(idx));
                    for group in 0..GROUPS {
                        sums[group] = _mm512_fmadd_ps(factor, columns[group], sums[group]);
                    }
                }
                left = left.add(ROWS);
                row = row.wrapping_add(right.inner_step);
            }
            run = run.wrapping_add(right.outer_step);
        }
        for (idx, sums) in sums.iter().enumerate() {
            for (group, sum) in sums.iter().enumerate() {
                let target = tile.as_mut_ptr().add(idx * COLUMNS + group * GROUP);
                let sum = if accumulate { _mm512_add_ps(_mm512_loadu_ps(target), *sum) } else { *sum };
                _mm512_storeu_ps(target, sum);
            }
        }
    }
}

/// Four rows from `first_row` and `8·VECTORS` columns from `first_column`.
///
/// # Safety
/// AVX2 and FMA are there, and `multiply_tile`'s assertions hold up to the last of these columns.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn tile_avx2<const VECTORS: usize>(
    left: &[f32],
    right: Rows<'_>,
    tile: &mut [f32],
    accumulate: bool,
    first_row: usize,
    first_column: usize,
) {
    let mut sums: [[__m256; VECTORS]; 4] = [[_mm256_setzero_ps(); VECTORS]; 4];
    // SAFETY: as in `tile_avx512`, within `first_row + 4` rows and `first_column + 8·VECTORS` columns.
    unsafe {
        let mut left = left.as_ptr().add(first_row);
        let mut run = right.values.as_ptr().add(first_column);
        for _ in 0..right.outer {
            let mut row = run;
            for _ in 0..right.inner {
                let mut columns = [_mm256_setzero_ps(); VECTORS];
                for (vector, columns) in columns.iter_mut().enumerate() {
                    *columns = _mm256_loadu_ps(row.add(vector * 8));
                }
                for (idx, sums) in sums.iter_mut().enumerate() {
                    let factor = _mm256_set1_ps(*left.add(idx));
                    for vector in 0..VECTORS {
                        sums[vector] = _mm256_fmadd_ps(factor, columns[vector], sums[vector]);
                    }
                }
                left = left.wrapping_add(ROWS);
                row = row.wrapping_add(right.inner_step);
            }
            run = run.wrapping_add(right.outer_step);
        }
        for (idx, sums) in sums.iter().enumerate() {
            for (vector, sum) in sums.iter().enumerate() {
                let at = (first_row + idx) * COLUMNS + first_column + vector * 8;
                let target = tile.as_mut_ptr().add(at);
                let sum = if accumulate { _mm256_add_ps(_mm256_loadu_ps(target), *sum) } else { *sum };
                _mm256_storeu_ps(target, sum);
            }
        }
    }
}

/// Four rows from `first_row` and one group of columns from `first_column`.
fn tile_portable(
    left: &[f32],
    right: Rows<'_>,
    tile: &mut [f32],
    accumulate: bool,
    first_row: usize,
    first_column: usize,
) {
    let mut sums = [[0.0_f32; GROUP]; 4];
    for outer in 0..right.outer {
        for inner in 0..right.inner {
            let at = outer * right.outer_step + inner * right.inner_step + first_column;
            let columns = &right.values[at..at + GROUP];
            let at = (outer * right.inner + inner) * ROWS + first_row;
            let factors = &left[at..at + 4];
            for (sums, &factor) in sums.iter_mut().zip(factors) {
                for (sum, &column) in sums.iter_mut().zip(columns) {
                    *sum = multiply_add(factor, column, *sum);
                }
            }
        }
    }
    for (idx, sums) in sums.iter().enumerate() {
        let at = (first_row + idx) * COLUMNS + first_column;
        for (target, sum) in tile[at..at + GROUP].iter_mut().zip(sums) {
            *target = if accumulate { *target + sum } else { *sum };
        }
    }
}

/// Fused where that is one instruction; elsewhere `mul_add` would be a call into the C library.
#[inline(always)]
fn multiply_add(a: f32, b: f32, c: f32) -> f32 {
    if cfg!(any(target_feature = "fma", target_arch = "aarch64")) { a.mul_add(b, c) } else { a * b + c }
}

/// A run of neighbouring columns of a panel and where their values stand.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ColumnRun {
    /// In the source, before a row's own offset.
    pub(crate) source: usize,
    /// First column in the panel.
    pub(crate) column: usize,
    pub(crate) len: usize,
}

/// Gathers a panel of `[row_offsets.len(), 48]` from runs of the source.
///
/// Runs are in the order of their columns, without gaps. Columns that no run covers are left undefined.
pub(crate) fn pack_panel(isa: Isa, panel: &mut [f32], source: &[f32], row_offsets: &[usize], runs: &[ColumnRun]) {
    let end = runs.iter().map(|run| run.source + run.len).max();
    let last = row_offsets.iter().max();
    let (Some(end), Some(last)) = (end, last) else {
        return;
    };
    assert!(source.len() >= end + last);
    assert!(runs.iter().all(|run| run.column + run.len <= COLUMNS));
    // Whole vectors are written, up to one past the end of the last row.
    assert!(panel.len() >= row_offsets.len() * COLUMNS + GROUP);
    match isa {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the machine has AVX-512; bounds were asserted above.
        Isa::Avx512 => unsafe { pack_avx512(panel, source, row_offsets, runs) },
        _ => {
            for (row, offset) in panel.chunks_exact_mut(COLUMNS).zip(row_offsets) {
                for run in runs {
                    let from = run.source + offset;
                    row[run.column..run.column + run.len].copy_from_slice(&source[from..from + run.len]);
                }
            }
        }
    }
}

/// # Safety
/// AVX-512 is there, and `pack_panel`'s assertions hold.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
unsafe fn pack_avx512(panel: &mut [f32], source: &[f32], row_offsets: &[usize], runs: &[ColumnRun]) {
    let source = source.as_ptr();
    let panel = panel.as_mut_ptr();
    // SAFETY: every read is within `run.len` of a run's start, masked at its end; every write begins inside a
    // row and is 16 long, and the panel has 16 to spare. What a write spills past its run, the next overwrites.
    unsafe {
        if let [run] = runs
            && run.len == COLUMNS
        {
            for (idx, offset) in row_offsets.iter().enumerate() {
                let from = source.add(run.source + offset);
                let to = panel.add(idx * COLUMNS);
                _mm512_storeu_ps(to, _mm512_loadu_ps(from));
                _mm512_storeu_ps(to.add(16), _mm512_loadu_ps(from.add(16)));
                _mm512_storeu_ps(to.add(32), _mm512_loadu_ps(from.add(32)));
            }
            return;
        }
        for (idx, offset) in row_offsets.iter().enumerate() {
            for run in runs {
                let mut from = source.add(run.source + offset);
                let mut to = panel.add(idx * COLUMNS + run.column);
                let mut left = run.len;
                while left >= GROUP {
                    _mm512_storeu_ps(to, _mm512_loadu_ps(from));
                    from = from.add(GROUP);
                    to = to.add(GROUP);
                    left -= GROUP;
                }
                if left > 0 {
                    let mask: __mmask16 = (1 << left) - 1;
                    _mm512_storeu_ps(to, _mm512_maskz_loadu_ps(mask, from));
                }
            }
        }
    }
}

/// Transposes `[rows, columns]`, rows `source_step` apart, into rows of `target` that are `target_step` apart.
pub(crate) fn transpose(
    isa: Isa,
    source: &[f32],
    source_step: usize,
    target: &mut [f32],
    target_step: usize,
    rows: usize,
    columns: usize,
) {
    if rows == 0 || columns == 0 {
        return;
    }
    assert!(source.len() >= (rows - 1) * source_step + columns);
    assert!(target.len() >= (columns - 1) * target_step + rows);
    let (block_rows, block_columns) = match isa {
        Isa::Portable => (0, 0),
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the machine has AVX; bounds were asserted above.
        Isa::Avx512 | Isa::Avx2 => unsafe {
            let (block_rows, block_columns) = (rows / 8 * 8, columns / 8 * 8);
            transpose_blocks_avx(
                source.as_ptr(),
                source_step,
                target.as_mut_ptr(),
                target_step,
                block_rows,
                block_columns,
            );
            (block_rows, block_columns)
        },
    };
    // What the 8 × 8 blocks left over: the columns beside them, then the rows below.
    for row in 0..block_rows {
        for column in block_columns..columns {
            target[column * target_step + row] = source[row * source_step + column];
        }
    }
    for column in 0..columns {
        for row in block_rows..rows {
            target[column * target_step + row] = source[row * source_step + column];
        }
    }
}

/// # Safety
/// AVX is there; `rows` and `columns` are multiples of 8 and within both buffers.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx")]
unsafe fn transpose_blocks_avx(
    source: *const f32,
    source_step: usize,
    target: *mut f32,
    target_step: usize,
    rows: usize,
    columns: usize,
) {
    use std::arch::x86_64::{
        _mm256_permute2f128_ps as halves, _mm256_shuffle_ps as shuffle, _mm256_unpackhi_ps as high,
        _mm256_unpacklo_ps as low,
    };
    for column in (0..columns).step_by(8) {
        for row in (0..rows).step_by(8) {
            // SAFETY: the block lies inside both buffers by the caller's promise.
            unsafe {
                let from = source.add(row * source_step + column);
                let mut r = [_mm256_setzero_ps(); 8];
                for (idx, r) in r.iter_mut().enumerate() {
                    *r = _mm256_loadu_ps(from.add(idx * source_step));
                }
                // Pairs of rows, then quadruples, then the two 128-bit halves.
                let p = [
                    low(r[0], r[1]),
                    high(r[0], r[1]),
                    low(r[2], r[3]),
                    high(r[2], r[3]),
                    low(r[4], r[5]),
                    high(r[4], r[5]),
                    low(r[6], r[7]),
                    high(r[6], r[7]),
                ];
                let q = [
                    shuffle::<0x44>(p[0], p[2]),
                    shuffle::<0xEE>(p[0], p[2]),
                    shuffle::<0x44>(p[1], p[3]),
                    shuffle::<0xEE>(p[1], p[3]),
                    shuffle::<0x44>(p[4], p[6]),
                    shuffle::<0xEE>(p[4], p[6]),
                    shuffle::<0x44>(p[5], p[7]),
                    shuffle::<0xEE>(p[5], p[7]),
                ];
                let to = target.add(column * target_step + row);
                for idx in 0..4 {
                    let first = halves::<0x20>(q[idx], q[idx + 4]);
                    let second = halves::<0x31>(q[idx], q[idx + 4]);
                    _mm256_storeu_ps(to.add(idx * target_step), first);
                    _mm256_storeu_ps(to.add((idx + 4) * target_step), second);
                }
            }
        }
    }
}

/// Compiles a plain loop for every instruction set and picks one when called, with the set as first argument.
///
/// Nothing is fused or reordered: the result is the same bits on all of them.
macro_rules! widest {
    (fn $name:ident($($arg:ident: $kind:ty),* $(,)?) -> $result:ty $body:block) => {
        #[allow(clippy::unused_unit)] // The macro names every result, also `()`.
        fn $name(isa: $crate::simd::Isa, $($arg: $kind),*) -> $result {
            #[inline(always)]
            fn plain($($arg: $kind),*) -> $result $body

            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f")]
            fn avx512($($arg: $kind),*) -> $result {
                plain($($arg),*)
            }

            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2")]
            fn avx2($($arg: $kind),*) -> $result {
                plain($($arg),*)
            }

            match isa {
                #[cfg(target_arch = "x86_64")]
                // SAFETY: the machine has AVX-512 (`Isa::available`).
                $crate::simd::Isa::Avx512 => unsafe { avx512($($arg),*) },
                #[cfg(target_arch = "x86_64")]
                // SAFETY: the machine has AVX2 (`Isa::available`).
                $crate::simd::Isa::Avx2 => unsafe { avx2($($arg),*) },
                $crate::simd::Isa::Portable => plain($($arg),*),
            }
        }
    };
}
pub(crate) use widest;
