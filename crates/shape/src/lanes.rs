//! Plain loops, compiled for the widest instructions that the machine has.

use pulp::WithSimd;

/// Points, pixels or places that are processed at once.
pub(crate) const LANES: usize = 8;

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
