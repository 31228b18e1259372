//! Cosines between each cell of a map and the neighbouring cells of another: the correlation by which two views are
//! compared.
//!
//! If the correlation were composed of tensor operations, each shift of one map would write all products and read them
//! again for summation. Here a row of sums stays in registers.
//!
//! Legend: C channels of a map of H × W cells, reach r; a shift is (dy, dx) from (−r, −r) to (r, r), row by row.

use std::mem::MaybeUninit;

use burn::backend::Dispatch;
use burn::tensor::Tensor;

use crate::elementwise::channels_last;
use crate::extension::KernelBackend;
use crate::parallel::{Output, SharedSlice, for_each_unit};
use crate::params::CosineParams;
use crate::simd::{Isa, widest};

/// The cosine between each cell of `one` and the cells up to `reach` cells away in `other`; 0 beyond the border.
/// `epsilon` is added to the square of a cell's length, so that a cell without features becomes a zero vector.
///
/// # Shapes
/// `one` and `other` are `[N, C, H, W]`; the result is `[N, (2 reach + 1)², H, W]`.
///
/// # Panics
/// If the shapes differ.
pub fn cosines(one: Tensor<4>, other: Tensor<4>, reach: usize, epsilon: f32) -> Tensor<4> {
    assert!(
        one.dims() == other.dims(),
        "cosines: expected maps of the same shape, found {:?} and {:?}",
        one.dims(),
        other.dims()
    );
    let params = CosineParams { reach, epsilon };
    Tensor::from_dispatch(Dispatch::kernel_cosines(one.into_dispatch(), other.into_dispatch(), params))
}

/// State kept for the backward pass.
#[derive(Clone, Debug)]
pub(crate) struct Kept {
    one: UnitMaps,
    other: UnitMaps,
    shape: [usize; 4],
    reach: usize,
}

/// Maps whose cells have length 1, channels first, so that a row of a map is a run of values.
#[derive(Clone, Debug)]
struct UnitMaps {
    /// The maps `[N, C, H, W]`; the maps of `other` have `reach` cells of zeros on each side.
    values: Vec<f32>,
    /// Lengths of the cells before normalisation, `[N, H, W]`.
    lengths: Vec<f32>,
}

impl UnitMaps {
    /// Normalises channels-last maps, `[N, H, W, C]`.
    fn new(isa: Isa, values: &[f32], [num_images, channels, height, width]: [usize; 4], epsilon: f32) -> Self {
        let pixels = height * width;
        let mut values = channels_last(isa, values, num_images, pixels, channels);
        let mut lengths = vec![0.0; num_images * pixels];
        let maps = values.chunks_exact_mut((channels * pixels).max(1));
        for (map, lengths) in maps.zip(lengths.chunks_exact_mut(pixels.max(1))) {
            to_unit(isa, map, lengths, epsilon);
        }
        Self { values, lengths }
    }
}

/// The cosines of channels-last maps, `[N, H, W, C]`; the result is `[N, (2 reach + 1)², H, W]`.
pub(crate) fn forward(
    isa: Isa,
    one: &[f32],
    other: &[f32],
    shape: [usize; 4],
    params: CosineParams,
) -> (Vec<f32>, Kept) {
    let [num_images, channels, height, width] = shape;
    let CosineParams { reach, epsilon } = params;
    let (side, pixels) = (2 * reach + 1, height * width);
    let one = UnitMaps::new(isa, one, shape, epsilon);
    let mut other = UnitMaps::new(isa, other, shape, epsilon);
    other.values = padded(&other.values, [num_images * channels, height, width], reach);
    let [padded_height, padded_width] = [height, width].map(|length| length + 2 * reach);
    let output = Output::new(num_images * side * side * pixels);
    for_each_unit(num_images * side * side, |at| {
        let (image, dy, dx) = (at / (side * side), at / side % side, at % side);
        // SAFETY: every unit has its own map.
        let target = unsafe { output.range(at * pixels, pixels) };
        for (row, target) in target.chunks_exact_mut(width.max(1)).enumerate() {
            let of_one = &one.values[image * channels * pixels + row * width..];
            let of_other = (image * channels * padded_height + row + dy) * padded_width + dx;
            let maps = [of_one, &other.values[of_other..]];
            products(isa, target, maps, [pixels, padded_height * padded_width], channels);
        }
    });
    // SAFETY: the units together are all maps.
    (unsafe { output.into_vec() }, Kept { one, other, shape, reach })
}

/// The gradients of both maps, `[N, C, H, W]`, from that of the cosines, `[N, (2 reach + 1)², H, W]`.
pub(crate) fn backward(isa: Isa, grad: &[f32], kept: &Kept) -> [Vec<f32>; 2] {
    let Kept { one, other, shape: [num_images, channels, height, width], reach } = kept;
    let (channels, height, width, reach) = (*channels, *height, *width, *reach);
    let (side, pixels) = (2 * reach + 1, height * width);
    let [padded_height, padded_width] = [height, width].map(|length| length + 2 * reach);
    let of_image = channels * pixels;
    let of_padded = channels * padded_height * padded_width;
    let mut grads = [0, 1].map(|_| vec![0.0; num_images * of_image]);
    let [of_one, of_other] = grads.each_mut().map(|grads| SharedSlice::new(grads));
    for_each_unit(*num_images, |image| {
        // SAFETY: every unit has its own image.
        let [to_one, to_other] = [&of_one, &of_other].map(|all| unsafe { all.range(image * of_image, of_image) });
        let unit_one = &one.values[image * of_image..][..of_image];
        let unit_other = &other.values[image * of_padded..][..of_padded];
        let mut to_padded = vec![0.0; of_padded];
        for shift in 0..side * side {
            let grad = &grad[(image * side * side + shift) * pixels..][..pixels];
            for channel in 0..channels {
                for (row, grad) in grad.chunks_exact(width).enumerate() {
                    let at = (channel * height + row) * width;
                    let at_padded = (channel * padded_height + row + shift / side) * padded_width + shift % side;
                    add_product(isa, &mut to_one[at..at + width], grad, &unit_other[at_padded..][..width]);
                    add_product(isa, &mut to_padded[at_padded..][..width], grad, &unit_one[at..at + width]);
                }
            }
        }
        for (at, row) in to_other.chunks_exact_mut(width.max(1)).enumerate() {
            row.copy_from_slice(inner_row(&to_padded, at, [height, width], reach));
        }
        let mut inner = vec![0.0; of_image];
        for (at, row) in inner.chunks_exact_mut(width.max(1)).enumerate() {
            row.copy_from_slice(inner_row(unit_other, at, [height, width], reach));
        }
        through_lengths(isa, to_one, unit_one, &one.lengths[image * pixels..][..pixels]);
        through_lengths(isa, to_other, &inner, &other.lengths[image * pixels..][..pixels]);
    });
    grads
}

/// Row `at` of all rows of maps, `[M, H, W]`, that have `reach` additional cells on each side.
fn inner_row(padded: &[f32], at: usize, [height, width]: [usize; 2], reach: usize) -> &[f32] {
    let (map, row) = (at / height, at % height);
    let start = (map * (height + 2 * reach) + row + reach) * (width + 2 * reach) + reach;
    &padded[start..start + width]
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
    fn to_unit(map: &mut [f32], lengths: &mut [f32], epsilon: f32) -> () {
        let pixels = lengths.len();
        for channel in map.chunks_exact(pixels) {
            for (length, value) in lengths.iter_mut().zip(channel) {
                *length += value * value;
            }
        }
        for length in &mut *lengths {
            *length = (*length + epsilon).sqrt();
        }
        for channel in map.chunks_exact_mut(pixels) {
            for (value, length) in channel.iter_mut().zip(&*lengths) {
                *value /= length;
            }
        }
    }
}

widest! {
    // Converts the gradient with respect to a map's cells of length 1 to that with respect to the map: with u the cell
    // of length 1 and l its original length, (g − u (u · g)) / l.
    fn through_lengths(grad: &mut [f32], unit: &[f32], lengths: &[f32]) -> () {
        let pixels = lengths.len();
        let mut dots = vec![0.0f32; pixels];
        for (grad, unit) in grad.chunks_exact(pixels).zip(unit.chunks_exact(pixels)) {
            for ((dot, grad), unit) in dots.iter_mut().zip(grad).zip(unit) {
                *dot += grad * unit;
            }
        }
        for (grad, unit) in grad.chunks_exact_mut(pixels).zip(unit.chunks_exact(pixels)) {
            for (((grad, unit), dot), length) in grad.iter_mut().zip(unit).zip(&dots).zip(lengths) {
                *grad = (*grad - unit * dot) / length;
            }
        }
    }
}

widest! {
    fn add_product(target: &mut [f32], a: &[f32], b: &[f32]) -> () {
        for ((target, a), b) in target.iter_mut().zip(a).zip(b) {
            *target += a * b;
        }
    }
}

widest! {
    // A row of sums over channels, which are `steps` apart in the two maps.
    fn products(target: &mut [MaybeUninit<f32>], maps: [&[f32]; 2], steps: [usize; 2], channels: usize) -> () {
        /// Number of sums that stay in registers.
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
    use burn::backend::Flex;
    use burn::tensor::Device;
    use burn::tensor::ops::PadMode;

    use super::*;
    use crate::composed;
    use crate::flex_tensor::{tensor, values};
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
                let (found, _) = forward(isa, &to_last(&one, shape), &to_last(&other, shape), shape, params);
                assert_close(&found, &expected, &format!("{isa:?}, {shape:?}"));
            }
        }
    }

    #[test]
    fn values_and_gradients_are_those_of_the_composition() {
        let device = Device::flex().autodiff();
        let shape = [2, 7, 5, 9];
        let params = CosineParams { reach: 2, epsilon: 1e-4 };
        let run = |ours: bool| {
            let map = |seed, dims: [usize; 4]| {
                let values = random_values(dims.iter().product(), seed);
                Tensor::<1>::from_floats(values.as_slice(), &device).reshape(dims)
            };
            let [one, other] = [1, 2].map(|seed| map(seed, shape).require_grad());
            let doubled = [&one, &other].map(|map| map.clone() * 2.0);
            let [a, b] = doubled;
            let found = if ours { cosines(a, b, params.reach, params.epsilon) } else { by_composition(a, b, params) };
            let grads = (found.clone() * map(3, found.dims())).sum().backward();
            [found.inner(), one.grad(&grads).unwrap(), other.grad(&grads).unwrap()]
                .map(|tensor| tensor.into_data().try_to_vec_as::<f32>().unwrap())
        };
        let (ours, theirs) = (run(true), run(false));
        assert_eq!(ours[0], theirs[0], "added up in the same order");
        for (ours, theirs) in ours.iter().zip(&theirs) {
            assert_close(ours, theirs, "values, gradients");
        }
    }

    /// The composition, as tensors.
    fn by_composition(one: Tensor<4>, other: Tensor<4>, params: CosineParams) -> Tensor<4> {
        let [_, _, height, width] = one.dims();
        let reach = params.reach;
        let unit = |map: Tensor<4>| map.clone() / ((map.clone() * map).sum_dim(1) + params.epsilon).sqrt();
        let other = unit(other).pad((reach, reach, reach, reach), PadMode::Constant(0.0));
        let one = unit(one);
        let shifts = (0..=2 * reach).flat_map(|dy| (0..=2 * reach).map(move |dx| (dy, dx)));
        let products = shifts
            .map(|(dy, dx)| (one.clone() * other.clone().narrow(2, dy, height).narrow(3, dx, width)).sum_dim(1))
            .collect();
        Tensor::cat(products, 1)
    }

    #[test]
    fn the_default_of_other_backends_is_the_same() {
        let shape = [2, 7, 5, 9];
        let params = CosineParams { reach: 2, epsilon: 1e-4 };
        let map = |seed| tensor(random_values(shape.iter().product(), seed), shape);
        let ours = Flex::kernel_cosines(map(1), map(2), params).to_contiguous();
        let composed = composed::cosines::<Flex>(map(1), map(2), params).to_contiguous();
        assert_eq!(values(&ours), values(&composed));
    }
}
