//! AdamW's update of one parameter, whose gradient is first clipped to a maximum norm.
//!
//! If an update were composed of tensor operations, it would read and write its moments a dozen times, on one thread;
//! this takes a fifth of the `edge` preset's training step. Here an update is three passes on all cores: norm, moments,
//! value.
//!
//! Source: Loshchilov and Hutter, Decoupled Weight Decay Regularization (2019).

use std::mem::MaybeUninit;

use burn::backend::Dispatch;
use burn::tensor::Tensor;

use crate::extension::KernelBackend;
use crate::parallel::{Output, for_each_unit};
use crate::params::AdamWParams;
use crate::simd::{Isa, widest};

/// Values per unit of work: its reads and writes are about 300 KB.
const UNIT: usize = 16 * 1024;

/// The parameter and its moments after a step.
///
/// # Shapes
/// `param` and `grad` have the same shape; `moments` is `[2, number of values]`: the running means of the gradient
/// and of its squares, zeros (or `None`) before the first step. No gradient is tracked.
///
/// # Panics
/// For other shapes.
pub fn adamw<const D: usize>(
    param: Tensor<D>,
    grad: Tensor<D>,
    moments: Option<Tensor<2>>,
    params: AdamWParams,
) -> (Tensor<D>, Tensor<2>) {
    let shape = param.dims();
    let count: usize = shape.iter().product();
    assert!(grad.dims() == shape, "adamw: expected a gradient of the parameter's {shape:?}, found {:?}", grad.dims());
    let moments = moments.unwrap_or_else(|| Tensor::zeros([2, count], (&param.device(), param.dtype())));
    assert!(moments.dims() == [2, count], "adamw: expected moments of [2, {count}], found {:?}", moments.dims());
    // Two operations, since an operation of the extension has one result.
    let moments: Tensor<2> =
        Tensor::from_dispatch(Dispatch::kernel_adamw_moments(grad.into_dispatch(), moments.into_dispatch(), params));
    let value: Tensor<2> = Tensor::from_dispatch(Dispatch::kernel_adamw_value(
        param.into_dispatch(),
        moments.clone().into_dispatch(),
        params,
    ));
    (value.reshape(shape), moments)
}

/// Both moments after a step, one after the other, in the layout of `moments`.
pub(crate) fn moments_after(isa: Isa, grad: &[f32], moments: &[f32], params: AdamWParams) -> Vec<f32> {
    let count = grad.len();
    let factor = clip_factor(isa, grad, params.max_norm);
    let output = Output::new(2 * count);
    for_each_unit(count.div_ceil(UNIT), |unit| {
        let range = unit * UNIT..count.min((unit + 1) * UNIT);
        // SAFETY: every unit has its own values of both moments.
        let [first, second] = [0, count].map(|start| unsafe { output.range(start + range.start, range.len()) });
        let before = [0, count].map(|start| &moments[start + range.start..start + range.end]);
        average(isa, [first, second], before, &grad[range], factor, [params.beta_1, params.beta_2]);
    });
    // SAFETY: the units together are all values of both moments.
    unsafe { output.into_vec() }
}

/// The values after a step with known moments.
pub(crate) fn value_after(isa: Isa, values: &[f32], moments: &[f32], params: AdamWParams) -> Vec<f32> {
    let count = values.len();
    let (firsts, seconds) = moments.split_at(count);
    let output = Output::new(count);
    for_each_unit(count.div_ceil(UNIT), |unit| {
        let range = unit * UNIT..count.min((unit + 1) * UNIT);
        // SAFETY: every unit has its own values.
        let target = unsafe { output.range(range.start, range.len()) };
        take_step(isa, target, &values[range.clone()], &firsts[range.clone()], &seconds[range], params);
    });
    // SAFETY: the units together are all values.
    unsafe { output.into_vec() }
}

/// The factor that limits the gradient's norm to `max_norm`.
fn clip_factor(isa: Isa, grad: &[f32], max_norm: Option<f32>) -> f32 {
    let Some(max_norm) = max_norm else { return 1.0 };
    let units = grad.len().div_ceil(UNIT);
    let sums = Output::new(units);
    for_each_unit(units, |unit| {
        let values = &grad[unit * UNIT..grad.len().min((unit + 1) * UNIT)];
        // SAFETY: every unit has its own sum.
        unsafe { sums.range(unit, 1)[0].write(sum_of_squares(isa, values)) };
    });
    // SAFETY: every unit wrote its sum.
    let sums = unsafe { sums.into_vec() };
    let norm = sums.iter().map(|&sum| f64::from(sum)).sum::<f64>().sqrt();
    (f64::from(max_norm) / (norm + f64::from(f32::MIN_POSITIVE))).min(1.0) as f32
}

widest! {
    fn average(
        after: [&mut [MaybeUninit<f32>]; 2],
        before: [&[f32]; 2],
        grad: &[f32],
        factor: f32,
        beta: [f32; 2],
    ) -> () {
        let [first, second] = after;
        let before = before[0].iter().zip(before[1]).zip(grad);
        for ((first, second), ((old_first, old_second), grad)) in first.iter_mut().zip(second).zip(before) {
            let grad = grad * factor;
            first.write(old_first * beta[0] + grad * (1.0 - beta[0]));
            second.write(old_second * beta[1] + grad * grad * (1.0 - beta[1]));
        }
    }
}

widest! {
    fn take_step(
        after: &mut [MaybeUninit<f32>],
        before: &[f32],
        first: &[f32],
        second: &[f32],
        params: AdamWParams,
    ) -> () {
        let [first_correction, second_correction] = params.corrections().map(|correction| 1.0 / correction);
        let keep = 1.0 - params.learning_rate * params.weight_decay;
        for (((after, before), first), second) in after.iter_mut().zip(before).zip(first).zip(second) {
            let delta = first * first_correction / ((second * second_correction).sqrt() + params.epsilon);
            after.write(before * keep - params.learning_rate * delta);
        }
    }
}

widest! {
    fn sum_of_squares(values: &[f32]) -> f32 {
        // Sixteen parallel sums fill a vector; their order is the same for every instruction set.
        let mut sums = [0.0_f32; 16];
        let chunks = values.chunks_exact(sums.len());
        let rest: f32 = chunks.remainder().iter().map(|value| value * value).sum();
        for chunk in chunks {
            for (sum, value) in sums.iter_mut().zip(chunk) {
                *sum += value * value;
            }
        }
        sums.iter().sum::<f32>() + rest
    }
}

#[cfg(test)]
mod tests {
    use burn::tensor::{Device, Distribution, TensorData};

    use super::*;
    use crate::composed;

    const PARAMS: AdamWParams = AdamWParams {
        learning_rate: 0.01,
        beta_1: 0.9,
        beta_2: 0.999,
        epsilon: 1e-8,
        weight_decay: 0.1,
        max_norm: Some(1.0),
        step: 3,
    };

    fn values(count: usize, seed: f32) -> Vec<f32> {
        (0..count).map(|idx| ((idx as f32 * 0.37 + seed).sin() * 3.0).powi(3)).collect()
    }

    #[test]
    fn steps_are_those_of_the_formula() {
        for count in [1, 15, 16, 17, UNIT, 2 * UNIT + 5] {
            let (before, grad) = (values(count, 0.0), values(count, 1.0));
            let mut moments = values(count, 2.0);
            moments.extend(values(count, 3.0).iter().map(|value| value.abs()));
            for max_norm in [None, Some(1.0), Some(1e9)] {
                let params = AdamWParams { max_norm, ..PARAMS };
                let norm = grad.iter().map(|&g| f64::from(g).powi(2)).sum::<f64>().sqrt();
                let factor = max_norm.map_or(1.0, |most| (f64::from(most) / norm).min(1.0));
                for isa in Isa::available() {
                    let averaged = moments_after(isa, &grad, &moments, params);
                    let mut after = value_after(isa, &before, &averaged, params);
                    after.extend(averaged);
                    for idx in 0..count {
                        let grad = f64::from(grad[idx]) * factor;
                        let first = 0.9 * f64::from(moments[idx]) + 0.1 * grad;
                        let second = 0.999 * f64::from(moments[count + idx]) + 0.001 * grad * grad;
                        let delta =
                            first / (1.0 - 0.9_f64.powi(3)) / ((second / (1.0 - 0.999_f64.powi(3))).sqrt() + 1e-8);
                        let value = f64::from(before[idx]) * (1.0 - 0.01 * 0.1) - 0.01 * delta;
                        for (found, wanted) in
                            [after[idx], after[count + idx], after[2 * count + idx]].iter().zip([value, first, second])
                        {
                            let error = (f64::from(*found) - wanted).abs();
                            assert!(
                                error <= 1e-4 * (1.0 + wanted.abs()),
                                "{isa:?} {count} {idx}: {found} for {wanted}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn other_backends_take_the_same_step() {
        let device = Device::flex();
        let tensor = |values: Vec<f32>| Tensor::<2>::from_data(TensorData::new(values, [4, 25]), &device);
        let (param, grad) = (tensor(values(100, 0.0)), tensor(values(100, 1.0)));
        let moments = Tensor::<2>::random([2, 100], Distribution::Uniform(0.0, 1.0), &device);
        let (value, after) = adamw(param.clone(), grad.clone(), Some(moments.clone()), PARAMS);
        type Any = burn::backend::Dispatch;
        let flat = |tensor: Tensor<2>| tensor.reshape([1, 100]).into_dispatch();
        let averaged = composed::adamw_moments::<Any>(flat(grad), moments.into_dispatch(), PARAMS);
        let stepped = composed::adamw_value::<Any>(flat(param), averaged.clone(), PARAMS);
        let composed = Tensor::<2>::cat(vec![Tensor::from_dispatch(stepped), Tensor::from_dispatch(averaged)], 0);
        let found = Tensor::cat(vec![value.reshape([1, 100]), after], 0);
        let error: f32 = (found - composed).abs().max().into_scalar();
        assert!(error < 1e-5, "{error}");
    }

    #[test]
    fn a_step_after_a_step_goes_on() {
        let device = Device::flex();
        let grad = Tensor::<2>::ones([3, 40], &device);
        let (value, moments) =
            adamw(Tensor::zeros([3, 40], &device), grad.clone(), None, AdamWParams { step: 1, ..PARAMS });
        // All gradients equal: every value moves by the learning rate.
        let first: Vec<f32> = value.clone().into_data().try_to_vec().unwrap();
        assert!(first.iter().all(|value| (value + 0.01).abs() < 1e-6), "{first:?}");
        let (value, _) = adamw(value, grad, Some(moments), AdamWParams { step: 2, ..PARAMS });
        let second: Vec<f32> = value.into_data().try_to_vec().unwrap();
        assert!(second.iter().all(|value| (value + 0.02 - 0.01 * 0.001).abs() < 1e-5), "{second:?}");
    }

    #[test]
    fn what_is_not_finite_is_not_hidden() {
        let params = AdamWParams { max_norm: None, ..PARAMS };
        let moments = moments_after(Isa::detect(), &[f32::NAN, 1.0], &[0.0; 4], params);
        let after = value_after(Isa::detect(), &[1.0, 1.0], &moments, params);
        assert!(after[0].is_nan() && after[1].is_finite());
    }
}
