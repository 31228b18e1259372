//! Winograd's transforms of weights, on sixteen filters at a time, down the columns of a kernel and then along its
//! rows. With a = 1/√2, b = √2:
//!
//! ```text
//! G: u₀ = g₀, u₁,₂ = −⅔ (g₀ ± a g₁ + a² g₂), u₃,₄ = ⅙ (g₀ ± b g₁ + b² g₂), u₅ = g₂
//! ```

#![allow(clippy::needless_range_loop)] // Rows and columns of a tile are numbers, here and in the sources.

use super::tiling::INPUT_TILE;
use super::transform::{A, A2, B, B2};
use crate::product::PANEL;
use crate::simd::lanes::{LANES, Lanes};
use crate::simd::{Isa, lanes_kernel};

const NA: f32 = -2.0 / 3.0;
const NB: f32 = 1.0 / 6.0;

/// Computes G g.
#[inline(always)]
unsafe fn filter_line<L: Lanes>(g: [L; 3]) -> [L; 6] {
    // SAFETY: registers only.
    unsafe {
        let even_a = g[0].mul(L::splat(NA)).add(g[2].mul(L::splat(NA * A2)));
        let odd_a = g[1].mul(L::splat(NA * A));
        let even_b = g[0].mul(L::splat(NB)).add(g[2].mul(L::splat(NB * B2)));
        let odd_b = g[1].mul(L::splat(NB * B));
        [g[0], even_a.add(odd_a), even_a.sub(odd_a), even_b.add(odd_b), even_b.sub(odd_b), g[2]]
    }
}

/// Computes Gᵀ u, the adjoint of [`filter_line`].
#[inline(always)]
unsafe fn filter_line_adjoint<L: Lanes>(u: [L; 6]) -> [L; 3] {
    // SAFETY: registers only.
    unsafe {
        let (sum_a, difference_a) = (u[1].add(u[2]), u[1].sub(u[2]));
        let (sum_b, difference_b) = (u[3].add(u[4]), u[3].sub(u[4]));
        [
            sum_a.mul_add(L::splat(NA), sum_b.mul_add(L::splat(NB), u[0])),
            difference_a.mul_add(L::splat(NA * A), difference_b.mul(L::splat(NB * B))),
            sum_a.mul_add(L::splat(NA * A2), sum_b.mul_add(L::splat(NB * B2), u[5])),
        ]
    }
}

/// `G g Gᵀ` of the first `width` columns of a panel of weights `[channels, 9, 32]`, written to `target` at every
/// frequency.
///
/// # Safety
/// `target` has room for `channels · width` floats at each frequency, which are `step` apart.
pub(super) unsafe fn filter_transform(
    isa: Isa,
    gathered: &[f32],
    channels: usize,
    width: usize,
    flipped: bool,
    target: *mut f32,
    step: usize,
) {
    assert!(gathered.len() >= channels * 9 * PANEL && width.is_multiple_of(LANES) && width <= PANEL);
    // SAFETY: the panel's length was asserted; the target is the caller's promise.
    unsafe { filter_panel(isa, gathered, channels, width, flipped, target, step) };
}

lanes_kernel! {
    unsafe fn filter_panel(
        gathered: &[f32],
        channels: usize,
        width: usize,
        flipped: bool,
        target: *mut f32,
        step: usize,
    ) = filter_lanes
}

#[inline(always)]
unsafe fn filter_lanes<L: Lanes>(
    gathered: &[f32],
    channels: usize,
    width: usize,
    flipped: bool,
    target: *mut f32,
    step: usize,
) {
    // SAFETY: elements of the panel and of the target, by the caller's promise.
    unsafe {
        for channel in 0..channels {
            for column in (0..width).step_by(LANES) {
                let from = gathered.as_ptr().add(channel * 9 * PANEL + column);
                let target = target.add(channel * width + column);
                let mut middle = [[L::splat(0.0); 3]; INPUT_TILE];
                for column in 0..3 {
                    let mut values = [L::splat(0.0); 3];
                    for row in 0..3 {
                        let cell = row * 3 + column;
                        values[row] = L::load(from.add(if flipped { 8 - cell } else { cell } * PANEL));
                    }
                    let values = filter_line(values);
                    for row in 0..INPUT_TILE {
                        middle[row][column] = values[row];
                    }
                }
                for row in 0..INPUT_TILE {
                    let values = filter_line(middle[row]);
                    for column in 0..INPUT_TILE {
                        values[column].store(target.add((row * INPUT_TILE + column) * step));
                    }
                }
            }
        }
    }
}

/// `Gᵀ ū G` of sixteen filters and all channels: `[channels, 9, 16]` from `[36, channels, Co]`.
///
/// # Safety
/// `source` has sixteen readable floats at every frequency and channel.
pub(super) unsafe fn filter_transform_adjoint(
    isa: Isa,
    source: *const f32,
    step: usize,
    channels: usize,
    channel_step: usize,
    target: &mut [f32],
) {
    assert!(target.len() >= channels * 9 * LANES);
    // SAFETY: the target's length was asserted; the source is the caller's promise.
    unsafe { filter_gradient_panel(isa, source, step, channels, channel_step, target.as_mut_ptr()) };
}

lanes_kernel! {
    unsafe fn filter_gradient_panel(
        source: *const f32,
        step: usize,
        channels: usize,
        channel_step: usize,
        target: *mut f32,
    ) = filter_gradient_lanes
}

#[inline(always)]
unsafe fn filter_gradient_lanes<L: Lanes>(
    source: *const f32,
    step: usize,
    channels: usize,
    channel_step: usize,
    target: *mut f32,
) {
    // SAFETY: elements of source and target, by the caller's promise.
    unsafe {
        for channel in 0..channels {
            let from = source.add(channel * channel_step);
            let target = target.add(channel * 9 * LANES);
            let mut middle = [[L::splat(0.0); INPUT_TILE]; 3];
            for column in 0..INPUT_TILE {
                let mut values = [L::splat(0.0); INPUT_TILE];
                for row in 0..INPUT_TILE {
                    values[row] = L::load(from.add((row * INPUT_TILE + column) * step));
                }
                let values = filter_line_adjoint(values);
                for row in 0..3 {
                    middle[row][column] = values[row];
                }
            }
            for row in 0..3 {
                let values = filter_line_adjoint(middle[row]);
                for column in 0..3 {
                    values[column].store(target.add((row * 3 + column) * LANES));
                }
            }
        }
    }
}
