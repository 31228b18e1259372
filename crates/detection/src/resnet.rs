//! The residual network: stem and four stages.
//!
//! ```text
//! image [N, 3, H, W] ─ stem 7×7/2, pool 3×3/2 ─ res2 ─ res3 ─ res4 ─ res5
//! stride                               4          4      8     16     32
//! ```
//!
//! Paths of the parameters follow Detectron2: `stem.conv1.weight`, `res2.0.conv1.norm.bias`,
//! `res3.0.shortcut.weight`.

use burn::module::{Module, ModuleMapper, Param};
use burn::tensor::Tensor;
use sdg_kernels::{Activation, MaxPool2dParams, max_pool2d};
use sdg_layers::{Conv2d, Conv2dShape, Distribution, Initializer};

use crate::config::{BlockKind, Freeze, ResNetConfig, StrideIn};

/// The first convolution and pooling.
#[derive(Module, Debug)]
pub struct Stem {
    /// 7×7, stride 2.
    pub conv1: Conv2d,
}

impl Stem {
    /// Computes `[N, C, H/4, W/4]` from `[N, 3, H, W]`.
    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        max_pool2d(self.conv1.forward_relu(x), MaxPool2dParams { kernel: [3, 3], stride: [2, 2], padding: [1, 1] })
    }
}

/// A residual block, basic (two convolutions) or bottleneck (three).
#[derive(Module, Debug)]
pub struct ResidualBlock {
    /// 3×3 (basic) or 1×1 (bottleneck).
    pub conv1: Conv2d,
    /// 3×3.
    pub conv2: Conv2d,
    /// 1×1, bottleneck only.
    pub conv3: Option<Conv2d>,
    /// 1×1, if the shape changes.
    pub shortcut: Option<Conv2d>,
}

impl ResidualBlock {
    fn init(config: &ResNetConfig, stage: usize, in_channels: usize, stride: usize, init: &mut Initializer) -> Self {
        let out_channels = config.stage_channels()[stage];
        let mut conv = |shape: Conv2dShape| shape.init(Distribution::he_normal(shape.fan_out()), config.norm, init);
        let (conv1, conv2, conv3) = match config.block {
            BlockKind::Basic => (
                conv(Conv2dShape::new(in_channels, out_channels, 3).with_stride(stride)),
                conv(Conv2dShape::new(out_channels, out_channels, 3)),
                None,
            ),
            BlockKind::Bottleneck { inner_channels, stride_in } => {
                let inner = inner_channels << stage;
                let (stride_1x1, stride_3x3) = match stride_in {
                    StrideIn::Conv1x1 => (stride, 1),
                    StrideIn::Conv3x3 => (1, stride),
                };
                (
                    conv(Conv2dShape::new(in_channels, inner, 1).with_stride(stride_1x1)),
                    conv(Conv2dShape::new(inner, inner, 3).with_stride(stride_3x3)),
                    Some(conv(Conv2dShape::new(inner, out_channels, 1))),
                )
            }
        };
        let shortcut = (in_channels != out_channels || stride != 1)
            .then(|| conv(Conv2dShape::new(in_channels, out_channels, 1).with_stride(stride)));
        Self { conv1, conv2, conv3, shortcut }
    }

    /// Computes `[N, C_out, H/stride, W/stride]` from `[N, C_in, H, W]`.
    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let identity = match &self.shortcut {
            Some(shortcut) => shortcut.forward(x.clone()),
            None => x.clone(),
        };
        let inner = self.conv1.forward_relu(x);
        match &self.conv3 {
            Some(conv3) => conv3.forward_then(self.conv2.forward_relu(inner), Some(identity), Activation::Relu),
            None => self.conv2.forward_then(inner, Some(identity), Activation::Relu),
        }
    }
}

/// The residual network.
#[derive(Module, Debug)]
pub struct ResNet {
    /// Stem, stride 4.
    pub stem: Stem,
    /// Stage of stride 4.
    pub res2: Vec<ResidualBlock>,
    /// Stage of stride 8.
    pub res3: Vec<ResidualBlock>,
    /// Stage of stride 16.
    pub res4: Vec<ResidualBlock>,
    /// Stage of stride 32.
    pub res5: Vec<ResidualBlock>,
}

impl ResNet {
    /// Initialises the parameters at random and freezes the configured part.
    pub fn init(config: &ResNetConfig, init: &mut Initializer) -> Self {
        let shape = Conv2dShape::new(3, config.stem_channels, 7).with_stride(2);
        let stem = Stem { conv1: shape.init(Distribution::he_normal(shape.fan_out()), config.norm, init) };
        let channels = config.stage_channels();
        let mut stage = |idx: usize| -> Vec<ResidualBlock> {
            let before = match idx {
                0 => config.stem_channels,
                _ => channels[idx - 1],
            };
            (0..config.num_blocks[idx])
                .map(|block| match block {
                    0 => {
                        let stride = if idx == 0 { 1 } else { 2 };
                        ResidualBlock::init(config, idx, before, stride, init)
                    }
                    _ => ResidualBlock::init(config, idx, channels[idx], 1, init),
                })
                .collect()
        };
        let mut net = Self { stem, res2: stage(0), res3: stage(1), res4: stage(2), res5: stage(3) };
        if config.freeze >= Freeze::Stem {
            net.stem = frozen(net.stem);
        }
        if config.freeze >= Freeze::ThroughRes2 {
            net.res2 = frozen(net.res2);
        }
        if config.freeze >= Freeze::ThroughRes3 {
            net.res3 = frozen(net.res3);
        }
        net
    }

    /// Returns res2 to res5.
    ///
    /// # Shapes
    /// - `x`: `[N, 3, H, W]`, H and W multiples of 32
    /// - output: `[N, C_l, H/s_l, W/s_l]` with strides 4, 8, 16, 32
    pub fn forward(&self, x: Tensor<4>) -> [Tensor<4>; 4] {
        let run = |x: Tensor<4>, stage: &[ResidualBlock]| stage.iter().fold(x, |x, block| block.forward(x));
        let res2 = run(self.stem.forward(x), &self.res2);
        let res3 = run(res2.clone(), &self.res3);
        let res4 = run(res3.clone(), &self.res4);
        let res5 = run(res4.clone(), &self.res5);
        [res2, res3, res4, res5]
    }
}

/// Excludes a module's parameters from training.
pub(crate) fn frozen<M: Module>(module: M) -> M {
    struct Freezer;
    impl ModuleMapper for Freezer {
        fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
            param.set_require_grad(false)
        }
    }
    module.map(&mut Freezer)
}
