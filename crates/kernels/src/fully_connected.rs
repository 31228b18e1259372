//! A fully connected layer over whole maps.
//!
//! burn flattens the maps, which copies channels-last ones on one thread, and packs the weight for each product. In
//! inference on the CPU the layer is a convolution instead: N maps of H × W in a row are one map of 1 × N·H·W, and the
//! weight is a kernel of 1 × H·W whose stride is its width. It reads the maps in place and keeps the packed weight. In
//! training, where the weight is packed for each step, this is hardly faster (2 % of a step of the `edge` preset).

use burn::backend::Dispatch;
use burn::backend::TensorMetadata;
use burn::backend::tensor::FloatTensor;
use burn::tensor::{FloatDType, Shape, Tensor};

use crate::extension::KernelBackend;
use crate::params::{Activation, Conv2dParams, FusedConv2dParams};

/// `activation(weight · map + bias)` for each map, flattened as `[C, H, W]`.
///
/// # Shapes
/// `x` `[N, C, H, W]`, `weight` `[F, C·H·W]`, `bias` `[F]`; the result is `[N, F]`.
///
/// # Panics
/// If the shapes do not match.
pub fn fully_connected(x: Tensor<4>, weight: Tensor<2>, bias: Tensor<1>, activation: Activation) -> Tensor<2> {
    let [_, channels, height, width] = x.dims();
    let [features, inputs] = weight.dims();
    assert!(
        inputs == channels * height * width && bias.dims() == [features],
        "fully_connected: expected a weight of [F, {}] and a bias of [F] for maps of {:?}, found {:?} and {:?}",
        channels * height * width,
        x.dims(),
        weight.dims(),
        bias.dims(),
    );
    Tensor::from_dispatch(Dispatch::kernel_fully_connected(
        x.into_dispatch(),
        weight.into_dispatch(),
        bias.into_dispatch(),
        activation,
    ))
}

/// The layer as a convolution of stride H·W, for backends whose convolution reads channels-last maps in place.
pub(crate) fn convolved<B: KernelBackend>(
    x: FloatTensor<B>,
    weight: FloatTensor<B>,
    bias: FloatTensor<B>,
    activation: Activation,
) -> FloatTensor<B> {
    let [shape, weight_shape] = [x.shape(), weight.shape()];
    let (num_maps, channels, cells) = (shape[0], shape[1], shape[2] * shape[3]);
    let features = weight_shape[0];
    let reshaped = |tensor, shape: &[usize]| B::float_reshape(tensor, Shape::from(shape.to_vec()));
    let pixels = reshaped(B::float_permute(x, &[0, 2, 3, 1]), &[1, 1, num_maps * cells, channels]);
    let kernels = reshaped(weight, &[features, channels, 1, cells]);
    let absent = || B::float_zeros(Shape::from([1]), &bias.device(), FloatDType::F32);
    let (scale, residual) = (absent(), reshaped(absent(), &[1; 4]));
    let conv = Conv2dParams { stride: [1, cells], padding: [0, 0] };
    let params = FusedConv2dParams { conv, scaled: false, added: false, activation };
    let output =
        B::kernel_conv2d(B::float_permute(pixels, &[0, 3, 1, 2]), kernels, bias.clone(), scale, residual, params);
    reshaped(B::float_permute(output, &[0, 2, 3, 1]), &[num_maps, features])
}

#[cfg(test)]
mod tests {
    use burn::tensor::Device;

    use super::*;
    use crate::reference::{assert_close, random_values};

    const SHAPES: [([usize; 4], usize); 4] =
        [([3, 5, 7, 7], 9), ([1, 16, 1, 1], 40), ([5, 64, 7, 7], 33), ([4, 7, 2, 3], 1)];

    fn tensor<const D: usize>(shape: [usize; D], seed: u64, device: &Device) -> Tensor<D> {
        let values = random_values(shape.iter().product(), seed);
        Tensor::<1>::from_floats(values.as_slice(), device).reshape(shape)
    }

    fn values<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
        tensor.into_data().try_into_vec().unwrap()
    }

    /// Output and gradients, of maps that are channels last in memory or not.
    fn run(layer: Layer, maps: [usize; 4], features: usize, last: bool, activation: Activation) -> [Vec<f32>; 4] {
        let device = Device::flex().autodiff();
        let [n, c, h, w] = maps;
        let x = if last { tensor([n, h, w, c], 1, &device).permute([0, 3, 1, 2]) } else { tensor(maps, 1, &device) };
        let x = x.require_grad();
        let weight = tensor([features, c * h * w], 2, &device).require_grad();
        let bias = tensor([features], 3, &device).require_grad();
        let output = layer(x.clone(), weight.clone(), bias.clone(), activation);
        let grads = (output.clone() * tensor([n, features], 4, &device)).sum().backward();
        [
            values(output.inner()),
            values(x.grad(&grads).unwrap()),
            values(weight.grad(&grads).unwrap()),
            values(bias.grad(&grads).unwrap()),
        ]
    }

    type Layer = fn(Tensor<4>, Tensor<2>, Tensor<1>, Activation) -> Tensor<2>;

    fn flattened(x: Tensor<4>, weight: Tensor<2>, bias: Tensor<1>, activation: Activation) -> Tensor<2> {
        let [n, c, h, w] = x.dims();
        let output = x.reshape([n, c * h * w]).matmul(weight.transpose()) + bias.unsqueeze();
        if activation == Activation::Relu { burn::tensor::activation::relu(output) } else { output }
    }

    #[test]
    fn results_and_gradients_are_those_of_flattened_maps() {
        for (maps, features) in SHAPES {
            for last in [true, false] {
                for activation in [Activation::Identity, Activation::Relu] {
                    let [ours, theirs] =
                        [fully_connected, flattened].map(|layer: Layer| run(layer, maps, features, last, activation));
                    for (part, (ours, theirs)) in ours.iter().zip(&theirs).enumerate() {
                        assert_close(ours, theirs, &format!("part {part} of {maps:?} to {features}, {activation:?}"));
                    }
                }
            }
        }
    }

    #[test]
    #[should_panic(
        expected = "expected a weight of [F, 12] and a bias of [F] for maps of [1, 3, 2, 2], found [5, 11] and [5]"
    )]
    fn a_weight_of_another_width_is_refused() {
        let device = Device::flex();
        let maps = Tensor::ones([1, 3, 2, 2], &device);
        fully_connected(maps, Tensor::ones([5, 11], &device), Tensor::ones([5], &device), Activation::Identity);
    }
}
