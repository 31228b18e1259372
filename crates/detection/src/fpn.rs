//! The feature pyramid: every level adds the next coarser one, upsampled.
//!
//! ```text
//! res5 ─ lateral ─────────┬─ output ─ p5 ─ every second cell ─ p6
//! res4 ─ lateral ─ + ─────┼─ output ─ p4      (+: coarser level, doubled)
//! res3 ─ lateral ─ + ─────┼─ output ─ p3
//! res2 ─ lateral ─ + ─────┴─ output ─ p2
//! ```

use burn::module::Module;
use burn::tensor::{Tensor, s};
use sdg_kernels::{Activation, upsample_nearest_2x};
use sdg_layers::{Conv2d, Conv2dShape, Distribution, Initializer};

use crate::config::FpnConfig;

/// The convolutions of the pyramid.
#[derive(Module, Debug)]
pub struct Fpn {
    /// 1×1 on res2.
    pub fpn_lateral2: Conv2d,
    /// 1×1 on res3.
    pub fpn_lateral3: Conv2d,
    /// 1×1 on res4.
    pub fpn_lateral4: Conv2d,
    /// 1×1 on res5.
    pub fpn_lateral5: Conv2d,
    /// 3×3 to p2.
    pub fpn_output2: Conv2d,
    /// 3×3 to p3.
    pub fpn_output3: Conv2d,
    /// 3×3 to p4.
    pub fpn_output4: Conv2d,
    /// 3×3 to p5.
    pub fpn_output5: Conv2d,
}

impl Fpn {
    /// Initialises the parameters at random, for stages with `stage_channels` channels.
    pub fn init(config: &FpnConfig, stage_channels: [usize; 4], init: &mut Initializer) -> Self {
        let mut conv = |in_channels, kernel| {
            let shape = Conv2dShape::new(in_channels, config.channels, kernel);
            shape.init(Distribution::lecun_uniform(shape.fan_in()), config.norm, init)
        };
        let [c2, c3, c4, c5] = stage_channels;
        Self {
            fpn_lateral2: conv(c2, 1),
            fpn_lateral3: conv(c3, 1),
            fpn_lateral4: conv(c4, 1),
            fpn_lateral5: conv(c5, 1),
            fpn_output2: conv(config.channels, 3),
            fpn_output3: conv(config.channels, 3),
            fpn_output4: conv(config.channels, 3),
            fpn_output5: conv(config.channels, 3),
        }
    }

    /// Returns p2 to p6.
    ///
    /// # Shapes
    /// - `stages`: res2 to res5, `[N, C_l, H/s, W/s]`, strides 4 to 32
    /// - output: `[N, C, H/s, W/s]`, strides 4 to 64 (rounded up at 64)
    pub fn forward(&self, stages: [Tensor<4>; 4]) -> [Tensor<4>; 5] {
        let [res2, res3, res4, res5] = stages;
        let lateral = |conv: &Conv2d, x: Tensor<4>, coarser: Tensor<4>| {
            conv.forward_then(x, Some(upsample_nearest_2x(coarser)), Activation::Identity)
        };
        let merged5 = self.fpn_lateral5.forward(res5);
        let merged4 = lateral(&self.fpn_lateral4, res4, merged5.clone());
        let merged3 = lateral(&self.fpn_lateral3, res3, merged4.clone());
        let merged2 = lateral(&self.fpn_lateral2, res2, merged3.clone());
        let p5 = self.fpn_output5.forward(merged5);
        // Max pooling with a kernel of one cell and stride 2 is subsampling.
        let p6 = p5.clone().slice(s![.., .., ..;2, ..;2]);
        [
            self.fpn_output2.forward(merged2),
            self.fpn_output3.forward(merged3),
            self.fpn_output4.forward(merged4),
            p5,
            p6,
        ]
    }
}
