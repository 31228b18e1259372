//! Sixteen floats at a time, as one AVX-512 register, two AVX2 registers, four registers of NEON or WebAssembly
//! (quads.rs), or an array.
//!
//! Kernels are written once over [`Lanes`] and compiled for every instruction set by
//! [`lanes_kernel!`](super::lanes_kernel), inside functions with enabled instructions: only there do
//! these methods become single instructions.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::*;

/// Number of floats in a [`Lanes`].
pub(crate) const LANES: usize = 16;

/// Sixteen floats.
///
/// # Safety
/// Pointers must be valid for as many floats as a method reads or writes, and the machine must have
/// the implementation's instructions.
pub(crate) trait Lanes: Copy {
    /// Rows of a tile whose sums, with [`Self::VECTORS`] columns of lanes, stay in registers.
    const ROWS: usize;
    /// Lanes side by side in a tile, 1 or 2.
    const VECTORS: usize;

    unsafe fn splat(value: f32) -> Self;
    unsafe fn load(from: *const f32) -> Self;
    unsafe fn store(self, to: *mut f32);
    /// Loads the first `len` of sixteen floats, followed by zeros.
    #[inline(always)]
    unsafe fn load_first(from: *const f32, len: usize) -> Self {
        let mut values = [0.0_f32; LANES];
        // SAFETY: valid for `len` floats, which is at most 16.
        unsafe {
            std::ptr::copy_nonoverlapping(from, values.as_mut_ptr(), len);
            Self::load(values.as_ptr())
        }
    }
    /// Stores the first `len` of sixteen floats; the memory after them is not changed.
    #[inline(always)]
    unsafe fn store_first(self, to: *mut f32, len: usize) {
        let mut values = [0.0_f32; LANES];
        // SAFETY: valid for `len` floats, which is at most 16.
        unsafe {
            self.store(values.as_mut_ptr());
            std::ptr::copy_nonoverlapping(values.as_ptr(), to, len);
        }
    }
    unsafe fn add(self, other: Self) -> Self;
    unsafe fn sub(self, other: Self) -> Self;
    unsafe fn mul(self, other: Self) -> Self;
    /// `self · factor + summand`, fused if that is one instruction.
    unsafe fn mul_add(self, factor: Self, summand: Self) -> Self;
    /// `max(self, 0)`; a NaN stays NaN.
    unsafe fn relu(self) -> Self;
    /// Prefetches a cache line that is read soon; a hint only, valid for any pointer.
    #[inline(always)]
    fn prefetch(at: *const f32) {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: every x86-64 has it, and it never faults.
        unsafe {
            _mm_prefetch::<_MM_HINT_T1>(at.cast());
        }
        #[cfg(not(target_arch = "x86_64"))]
        let _ = at;
    }
}

/// One AVX-512 register.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
pub(crate) struct Zmm(__m512);

#[cfg(target_arch = "x86_64")]
impl Lanes for Zmm {
    const ROWS: usize = 12;
    const VECTORS: usize = 2;

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        // SAFETY: the caller promises AVX-512; no memory is touched.
        unsafe { Self(_mm512_set1_ps(value)) }
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the caller promises AVX-512, and `from` is valid for 16 floats; the instruction needs no alignment.
        unsafe { Self(_mm512_loadu_ps(from)) }
    }
    #[inline(always)]
    unsafe fn load_first(from: *const f32, len: usize) -> Self {
        // SAFETY: the caller promises AVX-512, and `from` is valid for `len` floats: the masked load reads no others.
        unsafe { Self(_mm512_maskz_loadu_ps(first_mask(len), from)) }
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: the caller promises AVX-512, and `to` is valid for 16 floats; the instruction needs no alignment.
        unsafe { _mm512_storeu_ps(to, self.0) }
    }
    #[inline(always)]
    unsafe fn store_first(self, to: *mut f32, len: usize) {
        // SAFETY: the caller promises AVX-512, and `to` is valid for `len` floats: the masked store writes no others.
        unsafe { _mm512_mask_storeu_ps(to, first_mask(len), self.0) }
    }
    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        // SAFETY: the caller promises AVX-512; no memory is touched.
        unsafe { Self(_mm512_add_ps(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn sub(self, other: Self) -> Self {
        // SAFETY: the caller promises AVX-512; no memory is touched.
        unsafe { Self(_mm512_sub_ps(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn mul(self, other: Self) -> Self {
        // SAFETY: the caller promises AVX-512; no memory is touched.
        unsafe { Self(_mm512_mul_ps(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn mul_add(self, factor: Self, summand: Self) -> Self {
        // SAFETY: the caller promises AVX-512; no memory is touched.
        unsafe { Self(_mm512_fmadd_ps(self.0, factor.0, summand.0)) }
    }
    #[inline(always)]
    unsafe fn relu(self) -> Self {
        // If either operand is NaN, the result is the second operand.
        // SAFETY: the caller promises AVX-512; no memory is touched.
        unsafe { Self(_mm512_max_ps(_mm512_setzero_ps(), self.0)) }
    }
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn first_mask(len: usize) -> __mmask16 {
    ((1_u32 << len) - 1) as __mmask16
}

/// Two AVX2 registers.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
pub(crate) struct Ymm2([__m256; 2]);

/// An intrinsic on both halves; no closure, which would lack the enabled instructions.
#[cfg(target_arch = "x86_64")]
macro_rules! halves {
    ($intrinsic:ident, $a:expr, $b:expr) => {
        // SAFETY: the caller promises AVX2 and FMA; no memory is touched.
        unsafe { Ymm2([$intrinsic($a[0], $b[0]), $intrinsic($a[1], $b[1])]) }
    };
}

#[cfg(target_arch = "x86_64")]
impl Lanes for Ymm2 {
    const ROWS: usize = 6;
    const VECTORS: usize = 1;

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        // SAFETY: the caller promises AVX2 and FMA; no memory is touched.
        unsafe { Self([_mm256_set1_ps(value); 2]) }
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the caller promises AVX2 and FMA, and 16 floats at `from`; the instruction needs no alignment.
        unsafe { Self([_mm256_loadu_ps(from), _mm256_loadu_ps(from.add(8))]) }
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: the caller promises AVX2 and FMA, and room for 16 floats at `to`; the instruction needs no alignment.
        unsafe {
            _mm256_storeu_ps(to, self.0[0]);
            _mm256_storeu_ps(to.add(8), self.0[1]);
        }
    }
    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        halves!(_mm256_add_ps, self.0, other.0)
    }
    #[inline(always)]
    unsafe fn sub(self, other: Self) -> Self {
        halves!(_mm256_sub_ps, self.0, other.0)
    }
    #[inline(always)]
    unsafe fn mul(self, other: Self) -> Self {
        halves!(_mm256_mul_ps, self.0, other.0)
    }
    #[inline(always)]
    unsafe fn mul_add(self, factor: Self, summand: Self) -> Self {
        // SAFETY: the caller promises AVX2 and FMA; no memory is touched.
        unsafe {
            Self([
                _mm256_fmadd_ps(self.0[0], factor.0[0], summand.0[0]),
                _mm256_fmadd_ps(self.0[1], factor.0[1], summand.0[1]),
            ])
        }
    }
    #[inline(always)]
    unsafe fn relu(self) -> Self {
        // SAFETY: the caller promises AVX2 and FMA; no memory is touched.
        let zeros = unsafe { [_mm256_setzero_ps(); 2] };
        halves!(_mm256_max_ps, zeros, self.0)
    }
}

/// An array, which compilers translate to the vectors of the machine.
#[derive(Clone, Copy)]
pub(crate) struct Plain([f32; LANES]);

impl Plain {
    #[inline(always)]
    fn zip(self, other: Self, with: impl Fn(f32, f32) -> f32) -> Self {
        let mut values = self.0;
        for (value, other) in values.iter_mut().zip(other.0) {
            *value = with(*value, other);
        }
        Self(values)
    }
}

impl Lanes for Plain {
    const ROWS: usize = 4;
    const VECTORS: usize = 1;

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        Self([value; LANES])
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: valid for 16 floats by the caller's promise; arrays of floats need no more alignment.
        unsafe { Self(*from.cast::<[f32; LANES]>()) }
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: valid for 16 floats by the caller's promise.
        unsafe { *to.cast::<[f32; LANES]>() = self.0 };
    }
    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
    #[inline(always)]
    unsafe fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
    #[inline(always)]
    unsafe fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
    #[inline(always)]
    unsafe fn mul_add(self, factor: Self, summand: Self) -> Self {
        let mut values = summand.0;
        for (idx, value) in values.iter_mut().enumerate() {
            // Elsewhere `mul_add` would be a call into the C library.
            *value = if cfg!(any(target_feature = "fma", target_arch = "aarch64")) {
                self.0[idx].mul_add(factor.0[idx], *value)
            } else {
                self.0[idx] * factor.0[idx] + *value
            };
        }
        Self(values)
    }
    #[inline(always)]
    unsafe fn relu(self) -> Self {
        self.zip(self, |a, _| if a <= 0.0 { 0.0 } else { a })
    }
}
