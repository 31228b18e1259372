//! Reads tensors from the device, for the steps on the host (top-k, NMS, decoding).
//!
//! Inference is written asynchronously, because a browser gives the results of its graphics card only to asynchronous
//! code. Elsewhere burn's `read_sync` waits for the result of such a function; in a browser with a graphics card
//! `read_sync` panics.

use burn::tensor::{Tensor, Transaction, read_sync};

/// Reads a tensor's values, row by row, without its gradient.
pub(crate) fn host_values<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    read_sync(read(tensor))
}

/// [`host_values`], asynchronous.
pub(crate) async fn read<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    let data = tensor.into_data_async().await.expect("expected readable results of the device");
    data.try_to_vec_as::<f32>().expect("expected f32 values of a float tensor")
}

/// Reads two tensors with one wait for the device.
pub(crate) async fn read_both<const D: usize, const E: usize>(a: Tensor<D>, b: Tensor<E>) -> [Vec<f32>; 2] {
    let read = Transaction::default().register(a).register(b).execute_async().await;
    let read: [_; 2] = read.expect("expected readable results of the device").try_into().expect("expected two results");
    read.map(|data| data.try_to_vec_as::<f32>().expect("expected f32 values of a float tensor"))
}
