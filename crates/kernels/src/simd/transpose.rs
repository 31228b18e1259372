//! Transposes maps between channels first and channels last.

use super::isa::Isa;

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
        #[cfg(any(target_arch = "aarch64", all(target_arch = "wasm32", target_feature = "simd128")))]
        Isa::Quads => {
            let (block_rows, block_columns) = (rows / 4 * 4, columns / 4 * 4);
            let (from, to) = (source.as_ptr(), target.as_mut_ptr());
            // SAFETY: bounds were asserted above.
            unsafe { super::quads::transpose_blocks(from, source_step, to, target_step, block_rows, block_columns) };
            (block_rows, block_columns)
        }
    };
    // The remainder of the blocks: the columns beside them, then the rows below.
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

/// Transposes blocks of 8 × 8.
///
/// # Safety
/// AVX is available; `rows` and `columns` are multiples of 8 and within both buffers.
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
        _mm256_loadu_ps, _mm256_permute2f128_ps as halves, _mm256_setzero_ps, _mm256_shuffle_ps as shuffle,
        _mm256_storeu_ps, _mm256_unpackhi_ps as high, _mm256_unpacklo_ps as low,
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
