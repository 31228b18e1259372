//! The extension on burn's `NdArray`: only composed defaults, as a reference that is not fast.

// burn deprecates the backend in favour of `Flex`; it remains for comparisons.
#![allow(deprecated)]

use burn::backend::NdArray;

use crate::extension::KernelBackend;

impl KernelBackend for NdArray {}

#[cfg(feature = "autodiff")]
impl<C: burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy> KernelBackend
    for burn::backend::Autodiff<NdArray, C>
{
}
