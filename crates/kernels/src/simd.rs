//! Vector instructions: the available sets, and the compilation of a kernel for each of them.

mod isa;
pub(crate) mod lanes;
#[cfg(any(target_arch = "aarch64", all(target_arch = "wasm32", target_feature = "simd128")))]
pub(crate) mod quads;
mod transpose;

pub(crate) use isa::Isa;
pub(crate) use transpose::transpose;

/// Compiles a plain loop for every instruction set and selects one when called, with the set as first argument.
///
/// Nothing is fused or reordered: the result is bit-identical on all sets.
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
                #[cfg(any(target_arch = "aarch64", all(target_arch = "wasm32", target_feature = "simd128")))]
                $crate::simd::Isa::Quads => plain($($arg),*),
                $crate::simd::Isa::Portable => plain($($arg),*),
            }
        }
    };
}
pub(crate) use widest;

/// Compiles a kernel over [`Lanes`](lanes::Lanes) for every instruction set and selects one when called, with
/// the set as first argument.
///
/// Multiplications and additions may be fused, so the last bits may differ between instruction sets.
macro_rules! lanes_kernel {
    ($(#[$meta:meta])* $vis:vis unsafe fn $name:ident($($arg:ident: $kind:ty),* $(,)?) = $generic:ident) => {
        $(#[$meta])*
        #[allow(clippy::too_many_arguments)] // A kernel's inner loop has many.
        $vis unsafe fn $name(isa: $crate::simd::Isa, $($arg: $kind),*) {
            #[cfg(target_arch = "x86_64")]
            #[allow(clippy::too_many_arguments)]
            #[target_feature(enable = "avx512f,avx2,fma")]
            unsafe fn avx512($($arg: $kind),*) {
                // SAFETY: the promise of the caller; the instructions are switched on.
                unsafe { $generic::<$crate::simd::lanes::Zmm>($($arg),*) }
            }

            #[cfg(target_arch = "x86_64")]
            #[allow(clippy::too_many_arguments)]
            #[target_feature(enable = "avx2,fma")]
            unsafe fn avx2($($arg: $kind),*) {
                // SAFETY: the promise of the caller; the instructions are switched on.
                unsafe { $generic::<$crate::simd::lanes::Ymm2>($($arg),*) }
            }

            // SAFETY: the machine has the instructions (`Isa::available`); the rest is the caller's promise.
            unsafe {
                match isa {
                    #[cfg(target_arch = "x86_64")]
                    $crate::simd::Isa::Avx512 => avx512($($arg),*),
                    #[cfg(target_arch = "x86_64")]
                    $crate::simd::Isa::Avx2 => avx2($($arg),*),
                    #[cfg(any(target_arch = "aarch64", all(target_arch = "wasm32", target_feature = "simd128")))]
                    $crate::simd::Isa::Quads => $generic::<$crate::simd::quads::Quads>($($arg),*),
                    $crate::simd::Isa::Portable => $generic::<$crate::simd::lanes::Plain>($($arg),*),
                }
            }
        }
    };
}
pub(crate) use lanes_kernel;
