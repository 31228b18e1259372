//! Winograd's transforms of maps, on sixteen channels at a time.
//!
//! Each is one-dimensional, applied down the columns of a tile and then along its rows. With a = 1/√2, b = √2:
//!
//! ```text
//! Bᵀ: p₀ = d₀ − 2.5 d₂ + d₄             Aᵀ: y₀ = m₀ + (m₁ + m₂) + (m₃ + m₄)
//!     p₁,₂ = (d₄ − 2 d₂) ± a (d₃ − 2 d₁)     y₁ = a (m₁ − m₂) + b (m₃ − m₄)
//!     p₃,₄ = (d₄ − d₂/2) ± b (d₃ − d₁/2)     y₂ = a² (m₁ + m₂) + b² (m₃ + m₄)
//!     p₅ = d₁ − 2.5 d₃ + d₅                  y₃ = a³ (m₁ − m₂) + b³ (m₃ − m₄) + m₅
//! ```

#![allow(clippy::needless_range_loop)] // Rows and columns of a tile are numbers, here and in the sources.

use std::ops::Range;

use super::tiling::{FREQUENCIES, INPUT_TILE, OUTPUT_TILE, Tiling};
use crate::conv::direct::Maps;
use crate::parallel::Raw;
use crate::product::Epilogue;
use crate::scratch::Scratch;
use crate::simd::lanes::{LANES, Lanes};
use crate::simd::{Isa, lanes_kernel};

pub(super) const A: f32 = std::f32::consts::FRAC_1_SQRT_2;
pub(super) const A2: f32 = 0.5;
const A3: f32 = A * A2;
pub(super) const B: f32 = std::f32::consts::SQRT_2;
pub(super) const B2: f32 = 2.0;
const B3: f32 = B * B2;

/// Computes Bᵀ d.
#[inline(always)]
unsafe fn input_transform_1d<L: Lanes>(d: [L; 6]) -> [L; 6] {
    // SAFETY: registers only.
    unsafe {
        let minus_two = L::splat(-2.0);
        let minus_half = L::splat(-0.5);
        let minus_sum = L::splat(-2.5);
        let (a, b) = (L::splat(A), L::splat(B));
        let (minus_a, minus_b) = (L::splat(-A), L::splat(-B));
        let even_a = d[2].mul_add(minus_two, d[4]);
        let odd_a = d[1].mul_add(minus_two, d[3]);
        let even_b = d[2].mul_add(minus_half, d[4]);
        let odd_b = d[1].mul_add(minus_half, d[3]);
        [
            d[2].mul_add(minus_sum, d[0].add(d[4])),
            odd_a.mul_add(a, even_a),
            odd_a.mul_add(minus_a, even_a),
            odd_b.mul_add(b, even_b),
            odd_b.mul_add(minus_b, even_b),
            d[3].mul_add(minus_sum, d[1].add(d[5])),
        ]
    }
}

/// Computes Aᵀ m.
#[inline(always)]
unsafe fn output_transform_1d<L: Lanes>(m: [L; 6]) -> [L; 4] {
    // SAFETY: registers only.
    unsafe {
        let (sum_a, difference_a) = (m[1].add(m[2]), m[1].sub(m[2]));
        let (sum_b, difference_b) = (m[3].add(m[4]), m[3].sub(m[4]));
        [
            m[0].add(sum_a).add(sum_b),
            difference_a.mul_add(L::splat(A), difference_b.mul(L::splat(B))),
            sum_a.mul_add(L::splat(A2), sum_b.mul(L::splat(B2))),
            difference_a.mul_add(L::splat(A3), difference_b.mul_add(L::splat(B3), m[5])),
        ]
    }
}

/// Computes A y, the adjoint of [`output_transform_1d`].
#[inline(always)]
unsafe fn output_transform_adjoint_1d<L: Lanes>(y: [L; 4]) -> [L; 6] {
    // SAFETY: registers only.
    unsafe {
        let even_a = y[2].mul_add(L::splat(A2), y[0]);
        let odd_a = y[1].mul(L::splat(A)).add(y[3].mul(L::splat(A3)));
        let even_b = y[2].mul_add(L::splat(B2), y[0]);
        let odd_b = y[1].mul(L::splat(B)).add(y[3].mul(L::splat(B3)));
        [y[0], even_a.add(odd_a), even_a.sub(odd_a), even_b.add(odd_b), even_b.sub(odd_b), y[3]]
    }
}

// No closures below: a closure lacks the instructions that are enabled for its function.

/// `Bᵀ d B` of the input tiles of some output tiles, zeros outside the maps: `[36, tiles, C]`.
///
/// # Safety
/// `target` has room for all tiles of every frequency, which are `step` apart.
pub(super) unsafe fn input_transform(
    isa: Isa,
    source: Maps<'_>,
    padding: [usize; 2],
    tiling: Tiling,
    tiles: Range<usize>,
    target: *mut f32,
    step: usize,
) {
    assert!(source.channels.is_multiple_of(LANES));
    assert!(source.values.len() >= source.num_images * source.size[0] * source.size[1] * source.channels);
    let mut zeros = Scratch::take(source.channels);
    zeros.fill(0.0);
    // SAFETY: pixels are inside the maps or the zeros; the target is the caller's promise.
    unsafe { input_transform_tiles(isa, source, padding, tiling, tiles, target, step, &zeros) };
}

/// `A ȳ Aᵀ` of tiles of the output's gradient: `[36, tiles, C]`.
///
/// # Safety
/// As for [`input_transform`].
pub(super) unsafe fn output_transform_adjoint(
    isa: Isa,
    gradient: Maps<'_>,
    tiling: Tiling,
    tiles: Range<usize>,
    target: *mut f32,
    step: usize,
) {
    assert!(gradient.channels.is_multiple_of(LANES));
    assert!(gradient.values.len() >= gradient.num_images * gradient.size[0] * gradient.size[1] * gradient.channels);
    let mut zeros = Scratch::take(gradient.channels);
    zeros.fill(0.0);
    // SAFETY: pixels of the gradient are inside the maps or the zeros; the target is the caller's promise.
    unsafe { output_transform_adjoint_tiles(isa, gradient, [0, 0], tiling, tiles, target, step, &zeros) };
}

lanes_kernel! {
    unsafe fn input_transform_tiles(
        source: Maps<'_>,
        padding: [usize; 2],
        tiling: Tiling,
        tiles: Range<usize>,
        target: *mut f32,
        step: usize,
        zeros: &[f32],
    ) = input_transform_lanes
}

lanes_kernel! {
    unsafe fn output_transform_adjoint_tiles(
        source: Maps<'_>,
        padding: [usize; 2],
        tiling: Tiling,
        tiles: Range<usize>,
        target: *mut f32,
        step: usize,
        zeros: &[f32],
    ) = output_transform_adjoint_lanes
}

#[inline(always)]
unsafe fn input_transform_lanes<L: Lanes>(
    source: Maps<'_>,
    padding: [usize; 2],
    tiling: Tiling,
    tiles: Range<usize>,
    target: *mut f32,
    step: usize,
    zeros: &[f32],
) {
    let channels = source.channels;
    for (slot, tile) in tiles.enumerate() {
        let mut pixels = [[zeros.as_ptr(); INPUT_TILE]; INPUT_TILE];
        point_at_pixels(&mut pixels, &source, padding, tiling.place(tile));
        for channel in (0..channels).step_by(LANES) {
            // SAFETY: sixteen channels of a pixel or of the zeros; the target is the caller's promise.
            unsafe {
                let target = target.add(slot * channels + channel);
                let mut middle = [[L::splat(0.0); INPUT_TILE]; INPUT_TILE];
                for column in 0..INPUT_TILE {
                    let mut values = [L::splat(0.0); INPUT_TILE];
                    for row in 0..INPUT_TILE {
                        values[row] = L::load(pixels[row][column].add(channel));
                    }
                    let values = input_transform_1d(values);
                    for row in 0..INPUT_TILE {
                        middle[row][column] = values[row];
                    }
                }
                store_frequencies(middle, target, step);
            }
        }
    }
}

#[inline(always)]
unsafe fn output_transform_adjoint_lanes<L: Lanes>(
    source: Maps<'_>,
    padding: [usize; 2],
    tiling: Tiling,
    tiles: Range<usize>,
    target: *mut f32,
    step: usize,
    zeros: &[f32],
) {
    let channels = source.channels;
    for (slot, tile) in tiles.enumerate() {
        let mut pixels = [[zeros.as_ptr(); OUTPUT_TILE]; OUTPUT_TILE];
        point_at_pixels(&mut pixels, &source, padding, tiling.place(tile));
        for channel in (0..channels).step_by(LANES) {
            // SAFETY: sixteen channels of a pixel or of the zeros; the target is the caller's promise.
            unsafe {
                let target = target.add(slot * channels + channel);
                let mut middle = [[L::splat(0.0); OUTPUT_TILE]; INPUT_TILE];
                for column in 0..OUTPUT_TILE {
                    let mut values = [L::splat(0.0); OUTPUT_TILE];
                    for row in 0..OUTPUT_TILE {
                        values[row] = L::load(pixels[row][column].add(channel));
                    }
                    let values = output_transform_adjoint_1d(values);
                    for row in 0..INPUT_TILE {
                        middle[row][column] = values[row];
                    }
                }
                for row in 0..INPUT_TILE {
                    let values = output_transform_adjoint_1d(middle[row]);
                    for column in 0..INPUT_TILE {
                        values[column].store(target.add((row * INPUT_TILE + column) * step));
                    }
                }
            }
        }
    }
}

/// Sets pointers to a tile's pixels; entries outside the maps are not changed.
#[inline(always)]
fn point_at_pixels<const SIDE: usize>(
    pixels: &mut [[*const f32; SIDE]; SIDE],
    source: &Maps<'_>,
    padding: [usize; 2],
    (image, [y, x]): (usize, [usize; 2]),
) {
    let Maps { values, size: [height, width], channels, .. } = *source;
    for (dy, pixels) in pixels.iter_mut().enumerate() {
        let y = (y + dy).wrapping_sub(padding[0]);
        for (dx, pixel) in pixels.iter_mut().enumerate() {
            let x = (x + dx).wrapping_sub(padding[1]);
            if y < height && x < width {
                *pixel = values.as_ptr().wrapping_add(((image * height + y) * width + x) * channels);
            }
        }
    }
}

/// Applies [`input_transform_1d`] along the rows and stores the result at every frequency.
#[inline(always)]
unsafe fn store_frequencies<L: Lanes>(middle: [[L; INPUT_TILE]; INPUT_TILE], target: *mut f32, step: usize) {
    for row in 0..INPUT_TILE {
        // SAFETY: the target is the caller's promise.
        unsafe {
            let values = input_transform_1d(middle[row]);
            for column in 0..INPUT_TILE {
                values[column].store(target.add((row * INPUT_TILE + column) * step));
            }
        }
    }
}

/// The target of finished tiles.
pub(super) struct OutputPlace<'a> {
    pub(super) tiling: Tiling,
    pub(super) size: [usize; 2],
    pub(super) channels: usize,
    pub(super) epilogue: Epilogue<'a>,
    pub(super) output: Raw,
}

/// `Aᵀ m A` and the epilogue, written to the output; `finite` becomes false if a sum is not finite.
///
/// # Safety
/// Nothing else accesses these tiles of the output.
pub(super) unsafe fn output_transform(
    isa: Isa,
    products: &[f32],
    step: usize,
    place: &OutputPlace<'_>,
    tiles: Range<usize>,
    finite: &mut bool,
) {
    let [height, width] = place.size;
    assert!(place.channels.is_multiple_of(LANES));
    assert!(products.len() >= (FREQUENCIES - 1) * step + tiles.len() * place.channels);
    let len = place.tiling.num_images * height * width * place.channels;
    assert!(place.output.len >= len);
    assert!(place.epilogue.residual.is_none_or(|residual| residual.len() >= len));
    for vector in [place.epilogue.scale, place.epilogue.bias].into_iter().flatten() {
        assert!(vector.len() >= place.channels);
    }
    // SAFETY: the asserted lengths hold every element of products, output and epilogue.
    unsafe { output_transform_tiles(isa, products, step, place, tiles, finite) };
}

lanes_kernel! {
    unsafe fn output_transform_tiles(
        products: &[f32],
        step: usize,
        place: &OutputPlace<'_>,
        tiles: Range<usize>,
        finite: &mut bool,
    ) = output_transform_lanes
}

#[inline(always)]
unsafe fn output_transform_lanes<L: Lanes>(
    products: &[f32],
    step: usize,
    place: &OutputPlace<'_>,
    tiles: Range<usize>,
    finite: &mut bool,
) {
    let [height, width] = place.size;
    let channels = place.channels;
    let epilogue = place.epilogue;
    // SAFETY: elements of the products, of the output and of the epilogue's vectors, by the caller's assertions.
    unsafe {
        // The value stays 0 as long as every sum is finite: 0 · ∞ and 0 · NaN are NaN.
        let mut watch = L::splat(0.0);
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        for (slot, tile) in tiles.enumerate() {
            let (image, [y, x]) = place.tiling.place(tile);
            let rows = (height - y).min(OUTPUT_TILE);
            let columns = (width - x).min(OUTPUT_TILE);
            let first = ((image * height + y) * width + x) * channels;
            for channel in (0..channels).step_by(LANES) {
                let from = products.as_ptr().add(slot * channels + channel);
                let mut middle = [[zero; INPUT_TILE]; OUTPUT_TILE];
                for column in 0..INPUT_TILE {
                    let mut values = [zero; INPUT_TILE];
                    for row in 0..INPUT_TILE {
                        values[row] = L::load(from.add((row * INPUT_TILE + column) * step));
                    }
                    let values = output_transform_1d(values);
                    for row in 0..OUTPUT_TILE {
                        middle[row][column] = values[row];
                    }
                }
                let scale = match epilogue.scale {
                    Some(scale) => L::load(scale.as_ptr().add(channel)),
                    None => one,
                };
                let bias = match epilogue.bias {
                    Some(bias) => L::load(bias.as_ptr().add(channel)),
                    None => zero,
                };
                for row in 0..OUTPUT_TILE {
                    if row >= rows {
                        break;
                    }
                    let values = output_transform_1d(middle[row]);
                    for column in 0..OUTPUT_TILE {
                        if column >= columns {
                            break;
                        }
                        watch = values[column].mul_add(zero, watch);
                        let at = first + (row * width + column) * channels + channel;
                        let mut value = values[column].mul_add(scale, bias);
                        if let Some(residual) = epilogue.residual {
                            value = value.add(L::load(residual.as_ptr().add(at)));
                        }
                        if epilogue.relu {
                            value = value.relu();
                        }
                        value.store(place.output.at(at));
                    }
                }
            }
        }
        let mut watched = [0.0_f32; LANES];
        watch.store(watched.as_mut_ptr());
        *finite = watched.iter().all(|value| *value == 0.0);
    }
}
