//! Cosines between each cell of a map and the cells about it in another: the correlation by which two views are compared.
//!
//! Composed of tensor operations, every shift of the two maps against each other writes all their products and reads them
//! again to add them up. Here a row of sums stays in registers.
//!
//! Legend: C channels of a map of H × W cells, reach r; a shift is (dy, dx) from (−r, −r) to (r, r), row by row.

use std::mem::MaybeUninit;

use burn::backend::Dispatch;
use burn::tensor::Tensor;

use crate::elementwise::channels_last;
use crate::extension::KernelBackend;
use crate::parallel::{Output, for_each_unit};
use crate::params::CosineParams;
use crate::simd::{Isa, widest};

/// The cosine between each cell of `one` and the cells up to `reach` cells away in `other`; 0 beyond the border. `epsilon`
/// is added to the square of a cell's length, so that a cell without features has a direction of zero.
///
/// # Shapes
/// `one` and `other` are `[N, C, H, W]`; the result is `[N, (2 reach + 1)², H, W]`.
///
/// # Panics
/// Where the shapes differ.
pub fn cosines(one: Tensor<4>, other: Tensor<4>, reach: usize, epsilon: f32) -> Tensor<4> {
    assert!(one.dims() == other.dims(), "cosines: expected maps alike, found {:?} and {:?}", one.dims(), other.dims());
    let params = CosineParams { reach, epsilon };
    Tensor::from_dispatch(Dispatch::kernel_cosines(one.into_dispatch(), other.into_dispatch(), params))
}

/// The cosines of maps whose values stand channels last, `[N, H, W, C]`; the result is `[N, (2 reach + 1)², H, W]`.
pub(crate) fn forward(
    isa: Isa,
    one: &[f32],
    other: &[f32],
    [num_images, channels, height, width]: [usize; 4],
    params: CosineParams,
) -> Vec<f32> {
    let CosineParams { reach, epsilon } = params;
    let side = 2 * reach + 1;
    let pixels = height * width;
    let unit = |values: &[f32]| {
        // Channels first: a row of the map is a run of values.
        let mut values = channels_last(isa, values, num_images, pixels, channels);
        values.chunks_exact_mut((channels * pixels).max(1)).for_each(|map| to_unit(isa, map, pixels, epsilon));
        values
    };
    let (one, other) = (unit(one), padded(&unit(other), [num_images * channels, height, width], reach));
    let [padded_height, padded_width] = [height, width].map(|length| length + 2 * reach);
    let output = Output::new(num_images * side * side * pixels);
    for_each_unit(num_images * side * side, |at| {
        let (image, dy, dx) = (at / (side * side), at / side % side, at % side);
        // SAFETY: every unit has its own map.
        let target = unsafe { output.range(at * pixels, pixels) };
        for (row, target) in target.chunks_exact_mut(width.max(1)).enumerate() {
            let of_one = &one[image * channels * pixels + row * width..];
            let of_other = (image * channels * padded_height + row + dy) * padded_width + dx;
            products(isa, target, [of_one, &other[of_other..]], [pixels, padded_height * padded_width], channels);
        }
    });
    // SAFETY: the units together are all maps.
    unsafe { output.into_vec() }
}

/// Maps, `[M, H, W]`, with `reach` cells of zeros on each side.
fn padded(values: &[f32], [num_maps, height, width]: [usize; 3], reach: usize) -> Vec<f32> {
    let [padded_height, padded_width] = [height, width].map(|length| length + 2 * reach);
    let mut padded = vec![0.0; num_maps * padded_height * padded_width];
    for (at, row) in values.chunks_exact(width.max(1)).enumerate() {
        let (map, row_idx) = (at / height, at % height);
        let start = (map * padded_height + row_idx + reach) * padded_width + reach;
        padded[start..start + width].copy_from_slice(row);
    }
    padded
}

widest! {
    // Divides each cell of a map, `[C, H·W]`, by its length.
    fn to_unit(map: &mut [f32], pixels: usize, epsilon: f32) -> () {
        let mut lengths = vec![0.0f32; pixels];
        for channel in map.chunks_exact(pixels) {
            for (length, value) in lengths.iter_mut().zip(channel) {
                *length += value * value;
            }
        }
        for length in &mut lengths {
            *length = (*length + epsilon).sqrt();
        }
        for channel in map.chunks_exact_mut(pixels) {
            for (value, length) in channel.iter_mut().zip(&lengths) {
                *value /= length;
            }
        }
    }
}

widest! {
    // A row of sums over channels, which stand `steps` apart in the two maps.
    fn products(target: &mut [MaybeUninit<f32>], maps: [&[f32]; 2], steps: [usize; 2], channels: usize) -> () {
        /// Sums that stay in registers.
        const BLOCK: usize = 16;
        let width = target.len();
        for (block, target) in target.chunks_mut(BLOCK).enumerate() {
            let start = block * BLOCK;
            let mut sums = [0.0f32; BLOCK];
            let len = target.len().min(width - start);
            for channel in 0..channels {
                let [one, other] = [0, 1].map(|map| &maps[map][channel * steps[map] + start..][..len]);
                if len == BLOCK {
                    for at in 0..BLOCK {
                        sums[at] += one[at] * other[at];
                    }
                } else {
                    for ((sum, one), other) in sums.iter_mut().zip(one).zip(other) {
                        *sum += one * other;
                    }
                }
            }
            for (target, sum) in target.iter_mut().zip(sums) {
                target.write(sum);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use burn::tensor::Device;

    use super::*;
    use crate::reference::{assert_close, random_values, to_last};

    #[test]
    fn cosines_are_those_of_a_plain_loop_on_all_instructions() {
        for shape in [[2, 5, 6, 19], [1, 48, 16, 16], [1, 3, 1, 1]] {
            let [num_images, channels, height, width] = shape;
            let params = CosineParams { reach: 2, epsilon: 1e-4 };
            let [one, other] = [1, 2].map(|seed| random_values(shape.iter().product(), seed));
            let cell = |values: &[f32], image: usize, y: isize, x: isize| -> Option<Vec<f64>> {
                let inside = (0..height as isize).contains(&y) && (0..width as isize).contains(&x);
                let at = |c: usize| ((image * channels + c) * height + y as usize) * width + x as usize;
                inside.then(|| (0..channels).map(|c| f64::from(values[at(c)])).collect())
            };
            let length = |cell: &[f64]| (cell.iter().map(|v| v * v).sum::<f64>() + f64::from(params.epsilon)).sqrt();
            let mut expected = Vec::new();
            for image in 0..num_images {
                for shift in 0..25 {
                    for at in 0..height * width {
                        let (y, x) = ((at / width) as isize, (at % width) as isize);
                        let a = cell(&one, image, y, x).unwrap();
                        let b = cell(&other, image, y + shift / 5 - 2, x + shift % 5 - 2);
                        let cosine = b.map_or(0.0, |b| {
                            a.iter().zip(&b).map(|(a, b)| a * b).sum::<f64>() / (length(&a) * length(&b))
                        });
                        expected.push(cosine as f32);
                    }
                }
            }
            for isa in Isa::available() {
                let found = forward(isa, &to_last(&one, shape), &to_last(&other, shape), shape, params);
                assert_close(&found, &expected, &format!("{isa:?}, {shape:?}"));
            }
        }
    }

    #[test]
    fn the_composition_of_other_backends_is_the_same() {
        let device = Device::flex();
        let shape = [2, 7, 5, 9];
        let [one, other] = [1, 2].map(|seed| {
            let values = random_values(shape.iter().product(), seed);
            Tensor::<1>::from_floats(values.as_slice(), &device).reshape(shape)
        });
        let ours = cosines(one.clone(), other.clone(), 2, 1e-4);
        // With autodiff the composition runs, because it has a gradient.
        let autodiff = Device::flex().autodiff();
        let [one, other] = [one, other].map(|map| Tensor::<4>::from_data(map.into_data(), &autodiff).require_grad());
        let composed = cosines(one.clone(), other, 2, 1e-4);
        let gradient = one.grad(&composed.clone().sum().backward()).unwrap();
        assert!(gradient.abs().max().into_scalar::<f32>() > 0.0);
        let [ours, composed] =
            [ours, composed.inner()].map(|tensor| tensor.into_data().try_to_vec_as::<f32>().unwrap());
        assert_eq!(ours, composed, "added up in the same order");
    }
}
