//! The logarithm of the softmax of each row.
//!
//! burn composes it from six operations over the whole tensor, and its gradient from as many; a keypoint head has rows
//! of 3136 cells. This kernel needs one pass for each direction, with a row in the cache.
//!
//! Legend: `z = x − max x`, `s = Σ exp z`, the result `z − ln s`, and with `g` the gradient of the result
//! `∂x = g − exp z · Σ g / s`.

use burn::backend::Dispatch;
use burn::tensor::Tensor;

use crate::extension::KernelBackend;
use crate::parallel::{Output, for_each_unit};
use crate::simd::{Isa, widest};

/// Accumulators of a sum: independent chains hide the latency of an addition.
const CHAINS: usize = 8;

/// The logarithm of the softmax over the last axis.
///
/// # Shapes
/// `x` and the result are `[S, K]`.
pub fn log_softmax(x: Tensor<2>) -> Tensor<2> {
    Tensor::from_dispatch(Dispatch::kernel_log_softmax(x.into_dispatch()))
}

/// State kept for the backward pass.
#[derive(Clone, Debug)]
pub(crate) struct Kept {
    /// `exp z`, `[S, K]`.
    exponentials: Vec<f32>,
    /// `s`, `[S]`.
    sums: Vec<f32>,
}

/// The result, `[S, K]`, and the state kept for the backward pass.
pub(crate) fn forward(isa: Isa, x: &[f32], row_len: usize) -> (Vec<f32>, Kept) {
    let num_rows = x.len() / row_len.max(1);
    let [output, exponentials, sums] = [x.len(), x.len(), num_rows].map(Output::new);
    for_each_unit(num_rows, |row| {
        let x = &x[row * row_len..][..row_len];
        let max = x.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        // SAFETY: every unit has its own row of both.
        let [target, kept] = [&output, &exponentials].map(|all| unsafe { all.range(row * row_len, row_len) });
        for (kept, x) in kept.iter_mut().zip(x) {
            kept.write((x - max).exp());
        }
        // SAFETY: written just now.
        let kept = unsafe { std::slice::from_raw_parts(kept.as_ptr().cast::<f32>(), row_len) };
        let sum = sum(isa, kept);
        let log_sum = sum.ln();
        for (target, x) in target.iter_mut().zip(x) {
            target.write((x - max) - log_sum);
        }
        // SAFETY: every unit has its own sum.
        unsafe { sums.range(row, 1)[0].write(sum) };
    });
    // SAFETY: the units together are all rows.
    let [output, exponentials, sums] = [output, exponentials, sums].map(|all| unsafe { all.into_vec() });
    (output, Kept { exponentials, sums })
}

/// The gradient of `x`, `[S, K]`.
pub(crate) fn backward(isa: Isa, grad: &[f32], kept: &Kept) -> Vec<f32> {
    let row_len = grad.len() / kept.sums.len().max(1);
    let output = Output::new(grad.len());
    for_each_unit(kept.sums.len(), |row| {
        let [grad, exponentials] = [grad, &kept.exponentials].map(|all| &all[row * row_len..][..row_len]);
        let factor = -sum(isa, grad) * (1.0 / kept.sums[row]);
        // SAFETY: every unit has its own row.
        let target = unsafe { output.range(row * row_len, row_len) };
        for ((target, grad), exponential) in target.iter_mut().zip(grad).zip(exponentials) {
            target.write(grad + factor * exponential);
        }
    });
    // SAFETY: the units together are all rows.
    unsafe { output.into_vec() }
}

/// The sum in the order in which burn's CPU backend adds on this machine, so that results equal burn's.
fn sum(isa: Isa, values: &[f32]) -> f32 {
    match isa {
        #[cfg(target_arch = "x86_64")]
        Isa::Avx512 => sum_by_16(isa, values),
        #[cfg(target_arch = "x86_64")]
        Isa::Avx2 => sum_by_8(isa, values),
        #[cfg(any(target_arch = "aarch64", all(target_arch = "wasm32", target_feature = "simd128")))]
        Isa::Quads => sum_by_4(isa, values),
        Isa::Portable => sum_by_4(isa, values),
    }
}

#[cfg(target_arch = "x86_64")]
widest! {
    fn sum_by_16(values: &[f32]) -> f32 {
        sum_by::<16>(values)
    }
}

#[cfg(target_arch = "x86_64")]
widest! {
    fn sum_by_8(values: &[f32]) -> f32 {
        sum_by::<8>(values)
    }
}

widest! {
    fn sum_by_4(values: &[f32]) -> f32 {
        sum_by::<4>(values)
    }
}

#[inline(always)]
fn sum_by<const LANES: usize>(values: &[f32]) -> f32 {
    let mut chains = [[0.0f32; LANES]; CHAINS];
    let blocks = values.chunks_exact(CHAINS * LANES);
    let rest = blocks.remainder();
    for block in blocks {
        for (chain, values) in chains.iter_mut().zip(block.chunks_exact(LANES)) {
            add(chain, values);
        }
    }
    let mut width = CHAINS;
    while width > 1 {
        width /= 2;
        // Neighbours first: (0 + 1), (2 + 3), and so on.
        for at in 0..width {
            let other = chains[2 * at + 1];
            chains[at] = chains[2 * at];
            add(&mut chains[at], &other);
        }
    }
    let mut lanes = chains[0];
    let vectors = rest.chunks_exact(LANES);
    let rest = vectors.remainder();
    vectors.for_each(|vector| add(&mut lanes, vector));
    let mut width = LANES;
    while width > 1 {
        width /= 2;
        for at in 0..width {
            lanes[at] += lanes[at + width];
        }
    }
    lanes[0] + rest.iter().sum::<f32>()
}

#[inline(always)]
fn add<const LANES: usize>(lanes: &mut [f32; LANES], values: &[f32]) {
    for (lane, value) in lanes.iter_mut().zip(values) {
        *lane += value;
    }
}

#[cfg(test)]
mod tests {
    use burn::tensor::{Device, activation};

    use super::*;
    use crate::reference::{assert_close, random_values};

    /// One value, less than a vector, a length that uses every part of the sum, and a keypoint's heatmap.
    const ROW_LENS: [usize; 4] = [1, 7, 128 + 40, 3136];

    #[test]
    fn values_and_gradients_are_those_of_burns_composition() {
        let device = Device::flex().autodiff();
        for row_len in ROW_LENS {
            let tensor = |seed, scale: f32| {
                let values: Vec<f32> = random_values(5 * row_len, seed).iter().map(|value| scale * value).collect();
                Tensor::<1>::from_floats(values.as_slice(), &device).reshape([5, row_len])
            };
            let run = |ours: bool| {
                let x: Tensor<2> = tensor(1, 20.0).require_grad();
                let doubled = x.clone() * 2.0;
                let result = if ours { log_softmax(doubled) } else { activation::log_softmax(doubled, 1) };
                let gradient = x.grad(&(result.clone() * tensor(2, 1.0)).sum().backward()).unwrap();
                [result.inner(), gradient].map(|tensor| tensor.into_data().try_to_vec_as::<f32>().unwrap())
            };
            for (ours, theirs) in run(true).iter().zip(&run(false)) {
                assert_close(ours, theirs, &format!("rows of {row_len}"));
            }
        }
    }

    #[test]
    fn a_sum_is_the_same_on_all_instructions_but_for_its_order() {
        for row_len in ROW_LENS {
            let values = random_values(row_len, 3);
            let expected: f64 = values.iter().map(|&value| f64::from(value)).sum();
            for isa in Isa::available() {
                assert!((f64::from(sum(isa, &values)) - expected).abs() < 1e-4, "{isa:?}, {row_len} values");
            }
        }
    }

    #[test]
    fn two_equal_values_and_one_far_below_by_hand() {
        let x = Tensor::<2>::from_floats([[5.0, 5.0, -500.0]], &Device::flex());
        let found = log_softmax(x).into_data().try_to_vec_as::<f32>().unwrap();
        assert_close(&found, &[-2f32.ln(), -2f32.ln(), -505.0 - 2f32.ln()], "by hand");
    }
}
