//! The extension on `Autodiff<Flex>`: the state kept for the backward pass, and the computed gradients.

use std::cell::RefCell;
use std::collections::HashSet;
use std::sync::Arc;

use burn::backend::autodiff::checkpoint::base::Checkpointer;
use burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy;
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::flex::FlexTensor;
use burn::backend::ops::{ActivationOps, ModuleOps};
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Flex, TensorMetadata};

use crate::conv::direct::Maps;
use crate::conv::panels::Direction;
use crate::conv::shape::ConvShape;
use crate::conv::weight_gradient::weight_gradient;
use crate::extension::KernelBackend;
use crate::flex::convolved;
use crate::flex_tensor::{all_f32, channels_last, last_values, shape4, tensor, tensor_channels_last, values};
use crate::group_norm::kernel::{self as norm, Statistics};
use crate::packed::Keep;
use crate::params::CosineParams;
use crate::params::MaxPool2dParams;
use crate::params::RoiAlignParams;
use crate::params::{Activation, FusedGroupNormParams, GroupNormParams};
use crate::params::{Conv2dParams, FusedConv2dParams};
use crate::product::Epilogue;
use crate::resize;
use crate::resize::kernel::PoolShape;
use crate::roi_align;
use crate::simd::Isa;
use crate::{composed, cosines, elementwise, log_softmax, permute};

impl<C: CheckpointStrategy> KernelBackend for Autodiff<Flex, C> {
    fn kernel_conv2d(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        scale: FloatTensor<Self>,
        residual: FloatTensor<Self>,
        params: FusedConv2dParams,
    ) -> FloatTensor<Self> {
        let primitives = [&x, &weight, &bias, &scale, &residual].map(|operand| operand.primitive());
        if !all_f32(primitives) {
            return composed::conv2d::<Self>(x, weight, bias, scale, residual, params);
        }
        let shape = ConvShape::forward(shape4(x.primitive()), shape4(weight.primitive()), params.conv);
        let prepared = Conv2dBackward
            .prepare::<C>([x.node(), weight.node(), bias.node(), residual.node()])
            .compute_bound()
            .stateful();
        let keep = if weight.is_tracked() { Keep::No } else { Keep::Yes };
        let (x_tracked, weight_tracked) = (x.is_tracked(), weight.is_tracked());
        let x = channels_last(x.into_primitive());
        let residual = params.added.then(|| channels_last(residual.into_primitive()));
        let (weight, bias) = (weight.into_primitive(), bias.into_primitive().to_contiguous());
        let scale = params.scaled.then(|| scale.into_primitive().to_contiguous());
        let relu = params.activation == Activation::Relu;
        let epilogue = Epilogue {
            scale: scale.as_ref().map(values),
            bias: Some(values(&bias)),
            residual: residual.as_ref().map(last_values),
            relu,
        };
        let output = convolved(Direction::Forward, &x, weight.clone(), epilogue, &shape, keep);
        match prepared {
            OpsKind::Tracked(prep) => {
                // Each operand is kept only if the other's gradient is required.
                let kept = Conv2dKept {
                    x: weight_tracked.then_some(x),
                    weight: x_tracked.then_some(weight),
                    scale,
                    output: relu.then(|| output.clone()),
                    shape,
                    keep,
                };
                prep.finish(kept, output)
            }
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
        let keep = if weight.is_tracked() { Keep::No } else { Keep::Yes };
        let (x_tracked, weight_tracked) = (x.is_tracked(), weight.is_tracked());
        let x = channels_last(x.into_primitive());
        let (weight, bias) = (weight.into_primitive(), bias.into_primitive().to_contiguous());
        let epilogue = Epilogue { bias: Some(values(&bias)), ..Epilogue::default() };
        let output = convolved(Direction::Backward, &x, weight.clone(), epilogue, &shape, keep);
        match prepared {
            OpsKind::Tracked(prep) => {
                let kept = Conv2dKept {
                    x: weight_tracked.then_some(x),
                    weight: x_tracked.then_some(weight),
                    scale: None,
                    output: None,
                    shape,
                    keep,
                };
                prep.finish(kept, output)
            }
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
        // ROIs are constants: they are not parents of the crops.
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
        residual: FloatTensor<Self>,
        params: FusedGroupNormParams,
    ) -> FloatTensor<Self> {
        if !all_f32([&x, &gamma, &beta, &residual].map(|operand| operand.primitive())) {
            return composed::group_norm::<Self>(x, gamma, beta, residual, params);
        }
        let shape = shape4(x.primitive());
        let prepared = GroupNormBackward
            .prepare::<C>([x.node(), gamma.node(), beta.node(), residual.node()])
            .compute_bound()
            .stateful();
        let x = channels_last(x.into_primitive());
        let residual = params.added.then(|| channels_last(residual.into_primitive()));
        let [gamma, beta] = [gamma, beta].map(|operand| operand.into_primitive().to_contiguous());
        let (output, statistics) = norm::forward(
            Isa::detect(),
            last_values(&x),
            shape,
            values(&gamma),
            values(&beta),
            residual.as_ref().map(last_values),
            &params.norm,
        );
        let output = tensor_channels_last(output, shape);
        match prepared {
            OpsKind::Tracked(prep) => {
                let statistics = Arc::new(statistics);
                let kept = GroupNormKept { x, gamma, output: output.clone(), statistics, params: params.norm };
                prep.finish(kept, output)
            }
            OpsKind::UnTracked(prep) => prep.finish(output),
        }
    }

    fn kernel_max_pool2d(x: FloatTensor<Self>, params: MaxPool2dParams) -> FloatTensor<Self> {
        if !all_f32([x.primitive()]) {
            return Self::max_pool2d(x, params.kernel, params.stride, params.padding, [1, 1], false);
        }
        let shape = PoolShape::new(shape4(x.primitive()), params);
        let prepared = MaxPoolBackward.prepare::<C>([x.node()]).compute_bound().stateful();
        let x = channels_last(x.into_primitive());
        let output = Flex::kernel_max_pool2d(x.clone(), params);
        match prepared {
            OpsKind::Tracked(prep) => prep.finish((x, output.clone(), shape), output),
            OpsKind::UnTracked(prep) => prep.finish(output),
        }
    }

    fn kernel_log_softmax(x: FloatTensor<Self>) -> FloatTensor<Self> {
        if !all_f32([x.primitive()]) {
            return Self::log_softmax(x, 1);
        }
        let prepared = LogSoftmaxBackward.prepare::<C>([x.node()]).compute_bound().stateful();
        let x = x.into_primitive().to_contiguous();
        let shape = [x.shape()[0], x.shape()[1]];
        let (output, kept) = log_softmax::forward(Isa::detect(), values(&x), shape[1]);
        let output = tensor(output, shape);
        match prepared {
            OpsKind::Tracked(prep) => prep.finish((kept, shape), output),
            OpsKind::UnTracked(prep) => prep.finish(output),
        }
    }

    fn kernel_cosines(one: FloatTensor<Self>, other: FloatTensor<Self>, params: CosineParams) -> FloatTensor<Self> {
        if !all_f32([one.primitive(), other.primitive()]) {
            return composed::cosines::<Self>(one, other, params);
        }
        let prepared = CosinesBackward.prepare::<C>([one.node(), other.node()]).compute_bound().stateful();
        let shape = shape4(one.primitive());
        let [one, other] = [one, other].map(|map| channels_last(map.into_primitive()));
        let (output, kept) = cosines::forward(Isa::detect(), last_values(&one), last_values(&other), shape, params);
        let side = 2 * params.reach + 1;
        let output = tensor(output, [shape[0], side * side, shape[2], shape[3]]);
        match prepared {
            OpsKind::Tracked(prep) => prep.finish((Arc::new(kept), shape), output),
            OpsKind::UnTracked(prep) => prep.finish(output),
        }
    }

    fn kernel_permute_maps(x: FloatTensor<Self>, order: Arc<[usize]>) -> FloatTensor<Self> {
        if !all_f32([x.primitive()]) {
            return composed::permute_maps::<Self>(x, &order);
        }
        let prepared = PermuteBackward.prepare::<C>([x.node()]).compute_bound().stateful();
        let output = Flex::kernel_permute_maps(x.into_primitive(), Arc::clone(&order));
        match prepared {
            OpsKind::Tracked(prep) => prep.finish(permute::inverse(&order), output),
            OpsKind::UnTracked(prep) => prep.finish(output),
        }
    }

    fn kernel_upsample_nearest_2x(x: FloatTensor<Self>) -> FloatTensor<Self> {
        if !all_f32([x.primitive()]) {
            return composed::upsample_nearest_2x::<Self>(x);
        }
        let shape = shape4(x.primitive());
        let prepared = UpsampleBackward.prepare::<C>([x.node()]).compute_bound().stateful();
        let output = Flex::kernel_upsample_nearest_2x(x.into_primitive());
        match prepared {
            OpsKind::Tracked(prep) => prep.finish(shape, output),
            OpsKind::UnTracked(prep) => prep.finish(output),
        }
    }
}

thread_local! {
    /// Nodes whose gradient was given by an operation of this crate and not yet taken.
    static GIVEN: RefCell<HashSet<u64>> = RefCell::default();
}

/// The gradient of a node's output, as an input of the rest of the backward pass.
macro_rules! consumed {
    ($grads:ident, $node:expr) => {{
        GIVEN.with_borrow_mut(|given| given.remove(&$node.id.value));
        channels_last($grads.consume::<Flex>(&$node))
    }};
}

/// The earlier gradient of a map if it came from this crate: it is removed, to be stored again with another gradient
/// added.
///
/// burn itself adds a second gradient to the first, but reads both in the order of their shape. This order is the
/// slowest for channels-last maps and takes a tenth of a training step of the `edge` preset. This is a macro because a
/// node's type has no name outside burn. The gradient of a leaf is read after the pass and cannot be taken out. A leaf
/// is recognised by its `requirement`, which differs from that of an operation's node.
macro_rules! given_before {
    ($grads:ident, $ops_node:expr, $parent:expr) => {{
        let first = GIVEN.with_borrow_mut(|given| given.insert($parent.id.value));
        (!first && $parent.requirement == $ops_node.requirement)
            .then(|| channels_last($grads.consume::<Flex>(&$parent)))
    }};
}

/// Gives a map its gradient, `[N, C, H, W]` in channels-last layout.
macro_rules! give {
    ($grads:ident, $ops_node:expr, $parent:expr, $gradient:expr) => {{
        let gradient = $gradient;
        let gradient = match given_before!($grads, $ops_node, $parent) {
            None => gradient,
            Some(before) => sum(&gradient, &before),
        };
        $grads.register::<Flex>($parent.id, gradient);
    }};
}

/// The sum of two channels-last maps.
fn sum(a: &FlexTensor, b: &FlexTensor) -> FlexTensor {
    tensor_channels_last(elementwise::sum(Isa::detect(), last_values(a), last_values(b)), shape4(a))
}

const KEPT: &str = "an operand is kept where the other is tracked";

/// The data for a convolution's gradients.
#[derive(Clone, Debug)]
struct Conv2dKept {
    x: Option<FlexTensor>,
    weight: Option<FlexTensor>,
    scale: Option<FlexTensor>,
    /// The output, if a ReLU follows.
    output: Option<FlexTensor>,
    shape: ConvShape,
    keep: Keep,
}

#[derive(Debug)]
struct Conv2dBackward;

impl Backward<Flex, 4> for Conv2dBackward {
    type State = Conv2dKept;

    fn backward(self, ops: Ops<Self::State, 4>, grads: &mut Gradients, _: &mut Checkpointer) {
        let isa = Isa::detect();
        let mut output_grad = consumed!(grads, ops.node);
        let Conv2dKept { x: kept_x, weight: kept_weight, scale, output, shape, keep } = ops.state;
        let [x, weight, bias, residual] = ops.parents;
        let mut bias_grad = None;
        if let Some(output) = output {
            let (masked, sums) =
                elementwise::relu_gradient(isa, last_values(&output_grad), last_values(&output), shape.out_channels);
            output_grad = tensor_channels_last(masked, shape.output());
            bias_grad = Some(sums);
        }
        if let Some(bias) = bias {
            let sums = || elementwise::channel_sums(isa, last_values(&output_grad), shape.out_channels);
            grads.register::<Flex>(bias.id, tensor(bias_grad.unwrap_or_else(sums), [shape.out_channels]));
        }
        if let Some(residual) = residual {
            give!(grads, ops.node, residual, output_grad.clone());
        }
        if let Some(scale) = scale
            && (x.is_some() || weight.is_some())
        {
            let mut scaled = last_values(&output_grad).to_vec();
            elementwise::scale_channels(isa, &mut scaled, values(&scale));
            output_grad = tensor_channels_last(scaled, shape.output());
        }
        if let Some(x) = x {
            let weight = kept_weight.expect(KEPT);
            let before = given_before!(grads, ops.node, x);
            let epilogue = Epilogue { residual: before.as_ref().map(last_values), ..Epilogue::default() };
            let grad = convolved(Direction::Backward, &output_grad, weight, epilogue, &shape, keep);
            grads.register::<Flex>(x.id, grad);
        }
        if let Some(weight) = weight {
            let x = kept_x.expect(KEPT);
            let grad = weight_gradient(isa, input_maps(&x, &shape), output_maps(&output_grad, &shape), &shape);
            grads.register::<Flex>(weight.id, tensor(grad, shape.weight()));
        }
    }
}

/// A transposed convolution's output corresponds to the convolution's input, so their gradients are also exchanged.
#[derive(Debug)]
struct ConvTranspose2dBackward;

impl Backward<Flex, 3> for ConvTranspose2dBackward {
    type State = Conv2dKept;

    fn backward(self, ops: Ops<Self::State, 3>, grads: &mut Gradients, _: &mut Checkpointer) {
        let isa = Isa::detect();
        let output_grad = consumed!(grads, ops.node);
        let Conv2dKept { x: kept_x, weight: kept_weight, shape, keep, .. } = ops.state;
        let [x, weight, bias] = ops.parents;
        if let Some(x) = x {
            let weight = kept_weight.expect(KEPT);
            let before = given_before!(grads, ops.node, x);
            let epilogue = Epilogue { residual: before.as_ref().map(last_values), ..Epilogue::default() };
            let grad = convolved(Direction::Forward, &output_grad, weight, epilogue, &shape, keep);
            grads.register::<Flex>(x.id, grad);
        }
        if let Some(weight) = weight {
            let x = kept_x.expect(KEPT);
            let grad = weight_gradient(isa, input_maps(&output_grad, &shape), output_maps(&x, &shape), &shape);
            grads.register::<Flex>(weight.id, tensor(grad, shape.weight()));
        }
        if let Some(bias) = bias {
            let grad = elementwise::channel_sums(isa, last_values(&output_grad), shape.in_channels);
            grads.register::<Flex>(bias.id, tensor(grad, [shape.in_channels]));
        }
    }
}

fn input_maps<'a>(tensor: &'a FlexTensor, shape: &ConvShape) -> Maps<'a> {
    let (num_images, size, channels) = (shape.num_images, shape.in_size, shape.in_channels);
    Maps { values: last_values(tensor), num_images, size, channels }
}

fn output_maps<'a>(tensor: &'a FlexTensor, shape: &ConvShape) -> Maps<'a> {
    let (num_images, size, channels) = (shape.num_images, shape.out_size, shape.out_channels);
    Maps { values: last_values(tensor), num_images, size, channels }
}

#[derive(Debug)]
struct LogSoftmaxBackward;

impl Backward<Flex, 1> for LogSoftmaxBackward {
    type State = (log_softmax::Kept, [usize; 2]);

    fn backward(self, ops: Ops<Self::State, 1>, grads: &mut Gradients, _: &mut Checkpointer) {
        let output_grad = grads.consume::<Flex>(&ops.node).to_contiguous();
        let (kept, shape) = ops.state;
        if let [Some(x)] = ops.parents {
            let grad = log_softmax::backward(Isa::detect(), values(&output_grad), &kept);
            grads.register::<Flex>(x.id, tensor(grad, shape));
        }
    }
}

#[derive(Debug)]
struct CosinesBackward;

impl Backward<Flex, 2> for CosinesBackward {
    type State = (Arc<cosines::Kept>, [usize; 4]);

    fn backward(self, ops: Ops<Self::State, 2>, grads: &mut Gradients, _: &mut Checkpointer) {
        let output_grad = grads.consume::<Flex>(&ops.node).to_contiguous();
        let (kept, shape) = ops.state;
        let found = cosines::backward(Isa::detect(), values(&output_grad), &kept);
        for (parent, grad) in ops.parents.into_iter().zip(found) {
            if let Some(parent) = parent {
                grads.register::<Flex>(parent.id, tensor(grad, shape));
            }
        }
    }
}

#[derive(Debug)]
struct RoiAlignBackward;

impl Backward<Flex, 1> for RoiAlignBackward {
    /// ROIs, shape of the features, parameters.
    type State = (FlexTensor, [usize; 4], RoiAlignParams);

    fn backward(self, ops: Ops<Self::State, 1>, grads: &mut Gradients, _: &mut Checkpointer) {
        let crop_grad = consumed!(grads, ops.node);
        let (rois, shape, params) = ops.state;
        if let [Some(features)] = ops.parents {
            let grad = roi_align::kernel::backward(last_values(&crop_grad), shape, values(&rois), &params);
            give!(grads, ops.node, features, tensor_channels_last(grad, shape));
        }
    }
}

/// The data for the gradients of a group normalisation.
#[derive(Clone, Debug)]
struct GroupNormKept {
    x: FlexTensor,
    gamma: FlexTensor,
    output: FlexTensor,
    statistics: Arc<Statistics>,
    params: GroupNormParams,
}

#[derive(Debug)]
struct GroupNormBackward;

impl Backward<Flex, 4> for GroupNormBackward {
    type State = GroupNormKept;

    fn backward(self, ops: Ops<Self::State, 4>, grads: &mut Gradients, _: &mut Checkpointer) {
        let output_grad = consumed!(grads, ops.node);
        let kept = ops.state;
        let shape = shape4(&kept.x);
        let found = norm::backward(
            Isa::detect(),
            [last_values(&output_grad), last_values(&kept.output)],
            last_values(&kept.x),
            shape,
            values(&kept.gamma),
            &kept.statistics,
            &kept.params,
        );
        let [x, gamma, beta, residual] = ops.parents;
        if let Some(x) = x {
            give!(grads, ops.node, x, tensor_channels_last(found.x, shape));
        }
        if let Some(gamma) = gamma {
            grads.register::<Flex>(gamma.id, tensor(found.gamma, [shape[1]]));
        }
        if let Some(beta) = beta {
            grads.register::<Flex>(beta.id, tensor(found.beta, [shape[1]]));
        }
        if let Some(residual) = residual {
            let grad = found.masked.map_or(output_grad, |masked| tensor_channels_last(masked, shape));
            give!(grads, ops.node, residual, grad);
        }
    }
}

#[derive(Debug)]
struct MaxPoolBackward;

impl Backward<Flex, 1> for MaxPoolBackward {
    /// x, output and sizes.
    type State = (FlexTensor, FlexTensor, PoolShape);

    fn backward(self, ops: Ops<Self::State, 1>, grads: &mut Gradients, _: &mut Checkpointer) {
        let output_grad = consumed!(grads, ops.node);
        let (kept_x, output, shape) = ops.state;
        if let [Some(x)] = ops.parents {
            let [output_grad, kept_x, output] = [&output_grad, &kept_x, &output].map(last_values);
            let grad = resize::kernel::max_pool_gradient(Isa::detect(), output_grad, kept_x, output, &shape);
            give!(grads, ops.node, x, tensor_channels_last(grad, shape.input()));
        }
    }
}

#[derive(Debug)]
struct UpsampleBackward;

impl Backward<Flex, 1> for UpsampleBackward {
    /// Shape of the input.
    type State = [usize; 4];

    fn backward(self, ops: Ops<Self::State, 1>, grads: &mut Gradients, _: &mut Checkpointer) {
        let output_grad = consumed!(grads, ops.node);
        if let [Some(x)] = ops.parents {
            let grad = resize::kernel::upsample_gradient(Isa::detect(), last_values(&output_grad), ops.state);
            give!(grads, ops.node, x, tensor_channels_last(grad, ops.state));
        }
    }
}

#[derive(Debug)]
struct PermuteBackward;

impl Backward<Flex, 1> for PermuteBackward {
    /// The inverse order.
    type State = Arc<[usize]>;

    fn backward(self, ops: Ops<Self::State, 1>, grads: &mut Gradients, _: &mut Checkpointer) {
        let output_grad = grads.consume::<Flex>(&ops.node);
        if let [Some(x)] = ops.parents {
            grads.register::<Flex>(x.id, Flex::kernel_permute_maps(output_grad, ops.state));
        }
    }
}
