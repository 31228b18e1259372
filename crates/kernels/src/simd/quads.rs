//! Lanes of four vectors of 128 bits: NEON's on aarch64, and WebAssembly's. Their presence is fixed when a kernel is
//! compiled, so their intrinsics need no runtime check.

use super::lanes::Lanes;

#[cfg(target_arch = "aarch64")]
mod vector {
    pub(super) use std::arch::aarch64::{float32x4_t as Vector, vld1q_f32 as load, vst1q_f32 as store};
    use std::arch::aarch64::{
        vaddq_f32, vdupq_n_f32, vfmaq_f32, vmaxq_f32, vmulq_f32, vreinterpretq_f32_f64, vreinterpretq_f64_f32,
        vsubq_f32, vzip1q_f32, vzip1q_f64, vzip2q_f32, vzip2q_f64,
    };

    /// Of the thirty-two registers, twenty-four hold sums, four the vectors that all rows of a tile have in common, and
    /// one a factor.
    pub(super) const ROWS: usize = 6;

    #[inline(always)]
    pub(super) fn splat(value: f32) -> Vector {
        // SAFETY: every aarch64 has NEON; no memory is touched.
        unsafe { vdupq_n_f32(value) }
    }

    #[inline(always)]
    pub(super) fn add(a: Vector, b: Vector) -> Vector {
        // SAFETY: every aarch64 has NEON; no memory is touched.
        unsafe { vaddq_f32(a, b) }
    }

    #[inline(always)]
    pub(super) fn sub(a: Vector, b: Vector) -> Vector {
        // SAFETY: every aarch64 has NEON; no memory is touched.
        unsafe { vsubq_f32(a, b) }
    }

    #[inline(always)]
    pub(super) fn mul(a: Vector, b: Vector) -> Vector {
        // SAFETY: every aarch64 has NEON; no memory is touched.
        unsafe { vmulq_f32(a, b) }
    }

    #[inline(always)]
    pub(super) fn mul_add(a: Vector, factor: Vector, summand: Vector) -> Vector {
        // SAFETY: every aarch64 has NEON; no memory is touched.
        unsafe { vfmaq_f32(summand, a, factor) }
    }

    /// ReLU; the instruction gives a NaN if either operand is one.
    #[inline(always)]
    pub(super) fn relu(a: Vector) -> Vector {
        // SAFETY: every aarch64 has NEON; no memory is touched.
        unsafe { vmaxq_f32(a, splat(0.0)) }
    }

    /// Transposes four rows of four.
    #[inline(always)]
    pub(super) fn transposed(r: [Vector; 4]) -> [Vector; 4] {
        // Pairs of rows, then quadruples as pairs of twice the width.
        // SAFETY: every aarch64 has NEON; no memory is touched.
        unsafe {
            let low = |a, b| vreinterpretq_f64_f32(vzip1q_f32(a, b));
            let high = |a, b| vreinterpretq_f64_f32(vzip2q_f32(a, b));
            let p = [low(r[0], r[1]), high(r[0], r[1]), low(r[2], r[3]), high(r[2], r[3])];
            [
                vreinterpretq_f32_f64(vzip1q_f64(p[0], p[2])),
                vreinterpretq_f32_f64(vzip2q_f64(p[0], p[2])),
                vreinterpretq_f32_f64(vzip1q_f64(p[1], p[3])),
                vreinterpretq_f32_f64(vzip2q_f64(p[1], p[3])),
            ]
        }
    }
}

#[cfg(target_arch = "wasm32")]
mod vector {
    pub(super) use std::arch::wasm32::{
        f32x4_add as add, f32x4_mul as mul, f32x4_splat as splat, f32x4_sub as sub, v128 as Vector,
    };
    use std::arch::wasm32::{f32x4_pmax, i32x4_shuffle as shuffle, v128_load, v128_store};

    /// A browser maps vectors onto sixteen registers of 128 bits (of which it can use fifteen on x86). A tile of two
    /// rows has eight sums, four common vectors, a factor and a product: fourteen. A third row would spill.
    pub(super) const ROWS: usize = 2;

    /// Loads four floats.
    ///
    /// # Safety
    /// `from` is valid for four floats.
    #[inline(always)]
    pub(super) unsafe fn load(from: *const f32) -> Vector {
        // SAFETY: the caller's promise; the instruction needs no alignment.
        unsafe { v128_load(from.cast()) }
    }

    /// Stores four floats.
    ///
    /// # Safety
    /// `to` is valid for four floats.
    #[inline(always)]
    pub(super) unsafe fn store(to: *mut f32, vector: Vector) {
        // SAFETY: the caller's promise; the instruction needs no alignment.
        unsafe { v128_store(to.cast(), vector) };
    }

    #[inline(always)]
    pub(super) fn mul_add(a: Vector, factor: Vector, summand: Vector) -> Vector {
        add(mul(a, factor), summand)
    }

    /// `if a < b { b } else { a }`, one instruction, unlike `f32x4_max`: a NaN stays NaN.
    #[inline(always)]
    pub(super) fn relu(a: Vector) -> Vector {
        f32x4_pmax(a, splat(0.0))
    }

    /// Transposes four rows of four.
    #[inline(always)]
    pub(super) fn transposed(r: [Vector; 4]) -> [Vector; 4] {
        // Pairs of rows, then quadruples.
        let p = [
            shuffle::<0, 4, 1, 5>(r[0], r[1]),
            shuffle::<2, 6, 3, 7>(r[0], r[1]),
            shuffle::<0, 4, 1, 5>(r[2], r[3]),
            shuffle::<2, 6, 3, 7>(r[2], r[3]),
        ];
        [
            shuffle::<0, 1, 4, 5>(p[0], p[2]),
            shuffle::<2, 3, 6, 7>(p[0], p[2]),
            shuffle::<0, 1, 4, 5>(p[1], p[3]),
            shuffle::<2, 3, 6, 7>(p[1], p[3]),
        ]
    }
}

use vector::Vector;

/// Four vectors of four floats.
#[derive(Clone, Copy)]
pub(crate) struct Quads([Vector; 4]);

/// An intrinsic on all four; no closure, which would be a separate function in builds without optimisation.
macro_rules! quads {
    ($intrinsic:path, $($a:expr),*) => {
        Quads([$intrinsic($($a[0]),*), $intrinsic($($a[1]),*), $intrinsic($($a[2]),*), $intrinsic($($a[3]),*)])
    };
}

impl Lanes for Quads {
    const ROWS: usize = vector::ROWS;
    const VECTORS: usize = 1;

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        Self([vector::splat(value); 4])
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        use vector::load;
        // SAFETY: valid for 16 floats by the caller's promise; the instruction needs no alignment.
        unsafe { Self([load(from), load(from.add(4)), load(from.add(8)), load(from.add(12))]) }
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        for (idx, vector) in self.0.into_iter().enumerate() {
            // SAFETY: valid for 16 floats by the caller's promise; the instruction needs no alignment.
            unsafe { vector::store(to.add(4 * idx), vector) };
        }
    }
    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        quads!(vector::add, self.0, other.0)
    }
    #[inline(always)]
    unsafe fn sub(self, other: Self) -> Self {
        quads!(vector::sub, self.0, other.0)
    }
    #[inline(always)]
    unsafe fn mul(self, other: Self) -> Self {
        quads!(vector::mul, self.0, other.0)
    }
    #[inline(always)]
    unsafe fn mul_add(self, factor: Self, summand: Self) -> Self {
        quads!(vector::mul_add, self.0, factor.0, summand.0)
    }
    #[inline(always)]
    unsafe fn relu(self) -> Self {
        quads!(vector::relu, self.0)
    }
}

/// Transposes blocks of four by four; steps as in [`transpose`](super::transpose).
///
/// # Safety
/// `rows` and `columns` are multiples of 4 and within both buffers.
pub(crate) unsafe fn transpose_blocks(
    source: *const f32,
    source_step: usize,
    target: *mut f32,
    target_step: usize,
    rows: usize,
    columns: usize,
) {
    for column in (0..columns).step_by(4) {
        for row in (0..rows).step_by(4) {
            // SAFETY: the block lies inside both buffers by the caller's promise.
            unsafe {
                let from = source.add(row * source_step + column);
                let rows = std::array::from_fn(|idx| vector::load(from.add(idx * source_step)));
                let to = target.add(column * target_step + row);
                for (idx, column) in vector::transposed(rows).into_iter().enumerate() {
                    vector::store(to.add(idx * target_step), column);
                }
            }
        }
    }
}
