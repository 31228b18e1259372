//! Plain loops, compiled for the widest instructions that the machine has.

use pulp::WithSimd;

/// Points, pixels or places that are processed at once.
pub(crate) const LANES: usize = 8;

/// The larger of two numbers; `b` if one is not a number. `f32::max` is not vectorised in WebAssembly: it calls a
/// function for each number.
#[inline(always)]
pub(crate) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The smaller of two numbers; `b` if one is not a number. For `f32::min` the same is true.
#[inline(always)]
pub(crate) fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Does the work with the widest instructions that the machine has.
#[cfg(not(target_arch = "wasm32"))]
#[inline]
pub(crate) fn in_lanes<W: WithSimd>(work: W) -> W::Output {
    pulp::Arch::new().dispatch(work)
}

/// Does the work with the instructions for which the web page is compiled: the page contains one version, not three.
#[cfg(target_arch = "wasm32")]
#[inline]
pub(crate) fn in_lanes<W: WithSimd>(work: W) -> W::Output {
    work.with_simd(pulp::Scalar::new())
}
