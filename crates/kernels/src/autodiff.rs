//! The extension on `Autodiff<Flex>`: what is kept for the backward pass, and which gradients are computed.

use burn::backend::autodiff::checkpoint::base::Checkpointer;
use burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy;
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::flex::FlexTensor;
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Flex};

use crate::composed;
use crate::extension::KernelBackend;
use crate::flex::{all_f32, shape4, tensor, values};
use crate::roi_align::{self, RoiAlignParams};

impl<C: CheckpointStrategy> KernelBackend for Autodiff<Flex, C> {
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
        let prepared = RoiAlignBackward
            .prepare::<C>([features.node()])
            .compute_bound()
            .stateful();
        let crops = Flex::kernel_roi_align(features.into_primitive(), rois.clone(), params);
        match prepared {
            OpsKind::Tracked(prep) => prep.finish((rois, shape, params), crops),
            OpsKind::UnTracked(prep) => prep.finish(crops),
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
            let grad =
                roi_align::kernel::backward(values(&crop_grad), shape, values(&rois), &params);
            grads.register::<Flex>(features.id, tensor(grad, shape));
        }
    }
}
