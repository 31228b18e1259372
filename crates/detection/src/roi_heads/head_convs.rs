//! The first 3×3 convolutions of the keypoint and mask heads.

use sdg_layers::{Conv2d, Conv2dShape, Distribution, Initializer};

use crate::config::NormKind;

/// One convolution for each of `out_channels`, the first from `in_channels`, each followed by a ReLU.
pub(super) fn init(in_channels: usize, out_channels: &[usize], init: &mut Initializer) -> Vec<Conv2d> {
    let inputs = std::iter::once(&in_channels).chain(out_channels);
    let shapes = inputs.zip(out_channels).map(|(&from, &to)| Conv2dShape::new(from, to, 3));
    shapes.map(|shape| shape.init(Distribution::he_normal(shape.fan_out()), NormKind::Identity, init)).collect()
}
