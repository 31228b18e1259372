//! The parameters of the operations other than tensors, and the sizes of their results.

/// The movement of a convolution's kernel over its input. Every pair is `[vertical, horizontal]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Conv2dParams {
    /// Step of the kernel from one output pixel to the next, at least 1.
    pub stride: [usize; 2],
    /// Zeros added before and after each axis.
    pub padding: [usize; 2],
}

impl Conv2dParams {
    /// Stride 1, no padding.
    pub const UNIT: Self = Self { stride: [1, 1], padding: [0, 0] };

    /// The same stride and padding on both axes.
    pub const fn square(stride: usize, padding: usize) -> Self {
        Self { stride: [stride, stride], padding: [padding, padding] }
    }

    /// Size of the convolution's output map, or `None` if the padded input is smaller than the kernel.
    ///
    /// # Shapes
    /// `input` is `[Hi, Wi]`, `kernel` is `[Kh, Kw]`; the result is `[Ho, Wo]`.
    pub fn output_size(&self, input: [usize; 2], kernel: [usize; 2]) -> Option<[usize; 2]> {
        let mut output = [0; 2];
        for axis in 0..2 {
            let padded = input[axis] + 2 * self.padding[axis];
            output[axis] = padded.checked_sub(kernel[axis])? / self.stride[axis] + 1;
        }
        Some(output)
    }

    /// Size of the transposed convolution's output map, or `None` if the padding removes all of it.
    ///
    /// # Shapes
    /// `input` is `[Hi, Wi]`, `kernel` is `[Kh, Kw]`; the result is `[Ho, Wo]`.
    pub fn transposed_output_size(&self, input: [usize; 2], kernel: [usize; 2]) -> Option<[usize; 2]> {
        let mut output = [0; 2];
        for axis in 0..2 {
            let full = input[axis].checked_sub(1)? * self.stride[axis] + kernel[axis];
            output[axis] = full.checked_sub(2 * self.padding[axis]).filter(|&size| size > 0)?;
        }
        Some(output)
    }
}

impl Default for Conv2dParams {
    fn default() -> Self {
        Self::UNIT
    }
}

/// A convolution and the present parts of its [epilogue](crate::Conv2dEpilogue).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FusedConv2dParams {
    /// The movement of the kernel.
    pub conv: Conv2dParams,
    /// Whether there is a scale.
    pub scaled: bool,
    /// Whether there is a residual.
    pub added: bool,
    /// Activation of the output.
    pub activation: Activation,
}

/// The function after a normalisation or a convolution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Activation {
    /// `x` itself.
    #[default]
    Identity,
    /// `max(x, 0)`.
    Relu,
}

/// Parameters of [`group_norm`](crate::group_norm).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroupNormParams {
    /// Number of groups of channels; divides the number of channels.
    pub num_groups: usize,
    /// Added to the variance, such as 1e-5.
    pub epsilon: f32,
    /// The activation.
    pub activation: Activation,
}

/// A group normalisation, and whether there is a residual.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FusedGroupNormParams {
    /// The normalisation.
    pub norm: GroupNormParams,
    /// Whether there is a residual.
    pub added: bool,
}

/// The movement of a pooling's window. Every pair is `[vertical, horizontal]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaxPool2dParams {
    /// Size of the window, at most 255 pixels in all.
    pub kernel: [usize; 2],
    /// Step of the window from one output pixel to the next, at least 1.
    pub stride: [usize; 2],
    /// Padding before and after each axis, whose pixels are never the maximum; at most half the window.
    pub padding: [usize; 2],
}

impl MaxPool2dParams {
    /// Size of the output map, or `None` if the padded input is smaller than the window.
    pub(crate) fn output_size(&self, input: [usize; 2]) -> Option<[usize; 2]> {
        let conv = Conv2dParams { stride: self.stride, padding: self.padding };
        conv.output_size(input, self.kernel)
    }
}

/// Number of bilinear samples that a bin averages along each axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SamplingRatio {
    /// The length of the bin in feature pixels, rounded up (`sampling_ratio = 0` in Detectron2).
    Adaptive,
    /// Always this many, at least 1.
    Fixed(usize),
}

/// Position of a feature pixel's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoiAlignment {
    /// At the pixel's centre: boxes are shifted by half a pixel (Detectron2's `aligned = True`).
    HalfPixel,
    /// At the pixel's corner, and no ROI is smaller than one feature pixel (torchvision's default).
    Legacy,
}

/// Parameters of [`roi_align`](crate::roi_align).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoiAlignParams {
    /// Bins of the crop, `[Ph, Pw]`.
    pub output_size: [usize; 2],
    /// Feature pixels per image pixel, such as 1/16.
    pub spatial_scale: f32,
    /// Samples per bin and axis.
    pub sampling_ratio: SamplingRatio,
    /// Position of feature values.
    pub alignment: RoiAlignment,
}

/// The numbers of one step of [`adamw`](crate::adamw).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdamWParams {
    /// Factor of the update at this step of the schedule.
    pub learning_rate: f32,
    /// Fraction of the gradient's running mean that a step keeps.
    pub beta_1: f32,
    /// Fraction of the running mean of the gradient's squares that a step keeps.
    pub beta_2: f32,
    /// Added to the root of the mean square.
    pub epsilon: f32,
    /// Fraction of the value that a step with a learning rate of 1 removes.
    pub weight_decay: f32,
    /// Maximum Euclidean norm of the gradient; larger gradients are scaled down to it.
    pub max_norm: Option<f32>,
    /// Index of the step, from 1.
    pub step: i32,
}

impl AdamWParams {
    /// The divisors of the moments, which correct for their start at zero.
    pub(crate) fn corrections(&self) -> [f32; 2] {
        [1.0 - self.beta_1.powi(self.step), 1.0 - self.beta_2.powi(self.step)]
    }
}

/// Parameters of [`cosines`](crate::cosines()).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CosineParams {
    /// Maximum distance of the compared cells along each axis, in cells.
    pub reach: usize,
    /// Added to the square of a cell's length.
    pub epsilon: f32,
}
