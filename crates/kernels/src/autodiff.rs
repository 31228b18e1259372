//! The extension on `Autodiff<Flex>`: what is kept for the backward pass, and which gradients are computed.

use std::sync::Arc;

use burn::backend::autodiff::checkpoint::base::Checkpointer;
use burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy;
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::flex::FlexTensor;
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Flex};

use crate::composed;
use crate::conv::Conv2dParams;
use crate::conv::kernel::{self as conv, ConvShape};
use crate::conv::weight_gradient::weight_gradient;
use crate::extension::KernelBackend;
use crate::flex::{all_f32, shape4, tensor, values};
use crate::group_norm::GroupNormParams;
use crate::group_norm::kernel::{self as norm, Statistics};
use crate::roi_align::{self, RoiAlignParams};
use crate::simd::Isa;

impl<C: CheckpointStrategy> KernelBackend for Autodiff<Flex, C> {
    fn kernel_conv2d(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        params: Conv2dParams,
    ) -> FloatTensor<Self> {
        if !all_f32([x.primitive(), weight.primitive(), bias.primitive()]) {
            return composed::conv2d::<Self>(x, weight, bias, params);
        }
        let shape = ConvShape::forward(shape4(x.primitive()), shape4(weight.primitive()), params);
        let prepared = Conv2dBackward.prepare::<C>([x.node(), weight.node(), bias.node()]).compute_bound().stateful();
        let kept = Operands::keep::<C>(&x, &weight);
        let output = Flex::kernel_conv2d(x.into_primitive(), weight.into_primitive(), bias.into_primitive(), params);
        match prepared {
            OpsKind::Tracked(prep) => prep.finish((kept, shape), output),
            OpsKind::UnTracked(prep) => prep.finish(output),
        }
    }

    fn kernel_conv_transpose2d(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        params: Conv2dParams,
    ) -> FloatTensor<Self> {
        if !all_f32([x.primitive(), weight.primitive(), bias.primitive()]) {
            return composed::conv_transpose2d::<Self>(x, weight, bias, params);
        }
        let shape = ConvShape::transposed(shape4(x.primitive()), shape4(weight.primitive()), params);
        let prepared =
            ConvTranspose2dBackward.prepare::<C>([x.node(), weight.node(), bias.node()]).compute_bound().stateful();
        let kept = Operands::keep::<C>(&x, &weight);
        let output =
            Flex::kernel_conv_transpose2d(x.into_primitive(), weight.into_primitive(), bias.into_primitive(), params);
        match prepared {
            OpsKind::Tracked(prep) => prep.finish((kept, shape), output),
            OpsKind::UnTracked(prep) => prep.finish(output),
        }
    }

    fn kernel_roi_align(
        features: FloatTensor<Self>,
        rois: FloatTensor<Self>,
        params: RoiAlignParams,
    ) -> FloatTensor<Self> {
        if !all_f32([features.primitive(), rois.primitive()]) {
            return composed::roi_align::<Self>(features, rois, params);
        }
        // ROIs are constants: they are no parent of the crops.
        let rois = rois.into_primitive().to_contiguous();
        let shape = shape4(features.primitive());
        let prepared = RoiAlignBackward.prepare::<C>([features.node()]).compute_bound().stateful();
        let crops = Flex::kernel_roi_align(features.into_primitive(), rois.clone(), params);
        match prepared {
            OpsKind::Tracked(prep) => prep.finish((rois, shape, params), crops),
            OpsKind::UnTracked(prep) => prep.finish(crops),
        }
    }

    fn kernel_group_norm(
        x: FloatTensor<Self>,
        gamma: FloatTensor<Self>,
        beta: FloatTensor<Self>,
        params: GroupNormParams,
    ) -> FloatTensor<Self> {
        if !all_f32([x.primitive(), gamma.primitive(), beta.primitive()]) {
            return composed::group_norm::<Self>(x, gamma, beta, params);
        }
        let shape = shape4(x.primitive());
        let prepared = GroupNormBackward.prepare::<C>([x.node(), gamma.node(), beta.node()]).compute_bound().stateful();
        let operands = [x, gamma, beta].map(|operand| operand.into_primitive().to_contiguous());
        let [x, gamma, beta] = operands.each_ref().map(values);
        let (output, statistics) = norm::forward(Isa::detect(), x, shape, gamma, beta, &params);
        let output = tensor(output, shape);
        match prepared {
            OpsKind::Tracked(prep) => {
                let kept = GroupNormKept { operands, statistics: Arc::new(statistics), params };
                prep.finish(kept, output)
            }
            OpsKind::UnTracked(prep) => prep.finish(output),
        }
    }
}

/// What a convolution's gradients need: each operand only where the other's gradient is wanted.
#[derive(Clone, Debug)]
struct Operands {
    x: Option<FlexTensor>,
    weight: Option<FlexTensor>,
}

impl Operands {
    fn keep<C: CheckpointStrategy>(
        x: &FloatTensor<Autodiff<Flex, C>>,
        weight: &FloatTensor<Autodiff<Flex, C>>,
    ) -> Self {
        Self {
            x: weight.is_tracked().then(|| x.primitive().clone()),
            weight: x.is_tracked().then(|| weight.primitive().clone()),
        }
    }
}

const KEPT: &str = "an operand is kept where the other is tracked";

#[derive(Debug)]
struct Conv2dBackward;

impl Backward<Flex, 3> for Conv2dBackward {
    type State = (Operands, ConvShape);

    fn backward(self, ops: Ops<Self::State, 3>, grads: &mut Gradients, _: &mut Checkpointer) {
        let output_grad = grads.consume::<Flex>(&ops.node).to_contiguous();
        let (kept, shape) = ops.state;
        let output_grad = values(&output_grad);
        let [x, weight, bias] = ops.parents;
        if let Some(x) = x {
            let weight = kept.weight.expect(KEPT).to_contiguous();
            let grad = conv::input_gradient(Isa::detect(), output_grad, values(&weight), None, &shape);
            grads.register::<Flex>(x.id, tensor(grad, shape.input()));
        }
        if let Some(weight) = weight {
            let x = kept.x.expect(KEPT).to_contiguous();
            let grad = weight_gradient(Isa::detect(), values(&x), output_grad, &shape);
            grads.register::<Flex>(weight.id, tensor(grad, shape.weight()));
        }
        if let Some(bias) = bias {
            let grad = conv::channel_sums(output_grad, shape.num_images, shape.out_channels);
            grads.register::<Flex>(bias.id, tensor(grad, [shape.out_channels]));
        }
    }
}

/// A transposed convolution's output has the place of the convolution's input, so the gradients change
/// places too.
#[derive(Debug)]
struct ConvTranspose2dBackward;

impl Backward<Flex, 3> for ConvTranspose2dBackward {
    type State = (Operands, ConvShape);

    fn backward(self, ops: Ops<Self::State, 3>, grads: &mut Gradients, _: &mut Checkpointer) {
        let output_grad = grads.consume::<Flex>(&ops.node).to_contiguous();
        let (kept, shape) = ops.state;
        let output_grad = values(&output_grad);
        let [x, weight, bias] = ops.parents;
        if let Some(x) = x {
            let weight = kept.weight.expect(KEPT).to_contiguous();
            let grad = conv::forward(Isa::detect(), output_grad, values(&weight), None, &shape);
            grads.register::<Flex>(x.id, tensor(grad, shape.output()));
        }
        if let Some(weight) = weight {
            let x = kept.x.expect(KEPT).to_contiguous();
            let grad = weight_gradient(Isa::detect(), output_grad, values(&x), &shape);
            grads.register::<Flex>(weight.id, tensor(grad, shape.weight()));
        }
        if let Some(bias) = bias {
            let grad = conv::channel_sums(output_grad, shape.num_images, shape.in_channels);
            grads.register::<Flex>(bias.id, tensor(grad, [shape.in_channels]));
        }
    }
}

#[derive(Debug)]
struct RoiAlignBackward;

impl Backward<Flex, 1> for RoiAlignBackward {
    /// ROIs, shape of the features.
    type State = (FlexTensor, [usize; 4], RoiAlignParams);

    fn backward(self, ops: Ops<Self::State, 1>, grads: &mut Gradients, _: &mut Checkpointer) {
        let crop_grad = grads.consume::<Flex>(&ops.node).to_contiguous();
        let (rois, shape, params) = ops.state;
        if let [Some(features)] = ops.parents {
            let grad = roi_align::kernel::backward(values(&crop_grad), shape, values(&rois), &params);
            grads.register::<Flex>(features.id, tensor(grad, shape));
        }
    }
}

/// What the gradients of a group normalisation need.
#[derive(Clone, Debug)]
struct GroupNormKept {
    /// x, gamma and beta.
    operands: [FlexTensor; 3],
    statistics: Arc<Statistics>,
    params: GroupNormParams,
}

#[derive(Debug)]
struct GroupNormBackward;

impl Backward<Flex, 3> for GroupNormBackward {
    type State = GroupNormKept;

    fn backward(self, ops: Ops<Self::State, 3>, grads: &mut Gradients, _: &mut Checkpointer) {
        let output_grad = grads.consume::<Flex>(&ops.node).to_contiguous();
        let kept = ops.state;
        let shape = shape4(&kept.operands[0]);
        let [x, gamma, beta] = kept.operands.each_ref().map(values);
        let found = norm::backward(
            Isa::detect(),
            values(&output_grad),
            x,
            shape,
            [gamma, beta],
            &kept.statistics,
            &kept.params,
        );
        let [x, gamma, beta] = ops.parents;
        if let Some(x) = x {
            grads.register::<Flex>(x.id, tensor(found.x, shape));
        }
        if let Some(gamma) = gamma {
            grads.register::<Flex>(gamma.id, tensor(found.gamma, [shape[1]]));
        }
        if let Some(beta) = beta {
            grads.register::<Flex>(beta.id, tensor(found.beta, [shape[1]]));
        }
    }
}
