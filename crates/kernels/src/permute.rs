//! Permutes maps.
//!
//! burn's own `select` adds its gradient element by element, on one thread, because an index might occur twice.
//! In a permutation each index occurs once, so both directions copy whole maps.

use std::sync::Arc;

use burn::backend::Dispatch;
use burn::tensor::Tensor;

use crate::extension::KernelBackend;
use crate::parallel::{Output, for_each_unit};

/// Permutes the maps of `x`: map i of the result is map `order[i]`.
///
/// # Shapes
/// `x` and the result are `[N, C, H, W]`.
///
/// # Panics
/// If `order` is not a permutation of the N maps.
pub fn permute_maps(x: Tensor<4>, order: &[usize]) -> Tensor<4> {
    let num_maps = x.dims()[0];
    let mut seen = vec![false; num_maps];
    let each_once = order.iter().all(|&map| map < num_maps && !std::mem::replace(&mut seen[map], true));
    assert!(
        order.len() == num_maps && each_once,
        "permute_maps: expected an order of {num_maps} maps, each once, found {order:?}"
    );
    Tensor::from_dispatch(Dispatch::kernel_permute_maps(x.into_dispatch(), Arc::from(order)))
}

/// The inverse of an order.
pub(crate) fn inverse(order: &[usize]) -> Arc<[usize]> {
    let mut back = vec![0; order.len()];
    for (idx, &map) in order.iter().enumerate() {
        back[map] = idx;
    }
    Arc::from(back)
}

/// Permutes runs of equal length, of which there are `order.len()`.
pub(crate) fn permuted(values: &[f32], order: &[usize]) -> Vec<f32> {
    let run = values.len() / order.len().max(1);
    let output = Output::new(values.len());
    for_each_unit(order.len(), |unit| {
        let source = &values[order[unit] * run..][..run];
        // SAFETY: every unit has its own run.
        let target = unsafe { output.range(unit * run, run) };
        for (target, value) in target.iter_mut().zip(source) {
            target.write(*value);
        }
    });
    // SAFETY: the units together are all values.
    unsafe { output.into_vec() }
}

#[cfg(test)]
mod tests {
    use burn::tensor::{Device, Int};

    use super::*;
    use crate::reference::random_values;

    #[test]
    fn values_and_gradients_are_those_of_a_selection() {
        let device = Device::flex().autodiff();
        let order = [3, 0, 4, 1, 2];
        let maps =
            |seed| Tensor::<1>::from_floats(random_values(5 * 36, seed).as_slice(), &device).reshape([5, 6, 2, 3]);
        let run = |ours: bool| {
            let x: Tensor<4> = maps(1).require_grad();
            let doubled = x.clone() * 2.0;
            let moved = if ours {
                permute_maps(doubled, &order)
            } else {
                let indices = order.map(|map| map as i32);
                doubled.select(0, Tensor::<1, Int>::from_ints(indices, &device))
            };
            let gradient = x.grad(&(moved.clone() * maps(2)).sum().backward()).unwrap();
            (moved.inner(), gradient)
        };
        let (ours, theirs) = (run(true), run(false));
        for (ours, theirs) in [(ours.0, theirs.0), (ours.1, theirs.1)] {
            let error: f32 = (ours - theirs).abs().max().into_scalar();
            assert_eq!(error, 0.0);
        }
    }

    #[test]
    fn the_inverse_leads_back() {
        let order = [2, 0, 3, 1];
        let values: Vec<f32> = (0..8).map(|value| value as f32).collect();
        let moved = permuted(&values, &order);
        assert_eq!(moved, [4.0, 5.0, 0.0, 1.0, 6.0, 7.0, 2.0, 3.0]);
        assert_eq!(permuted(&moved, &inverse(&order)), values);
    }

    #[test]
    #[should_panic(expected = "expected an order of 3 maps, each once, found [0, 1, 1]")]
    fn a_map_that_comes_twice_is_refused() {
        permute_maps(Tensor::ones([3, 1, 1, 1], &Device::flex()), &[0, 1, 1]);
    }
}
