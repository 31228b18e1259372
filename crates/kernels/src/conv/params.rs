//! What a convolution does besides its weights, and the sizes that follow.

use crate::group_norm::Activation;

/// How a convolution's kernel moves over its input. Every pair is `[vertical, horizontal]`.
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

    /// Size of the convolution's output map, or `None` where the padded input is smaller than the kernel.
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

    /// Size of the transposed convolution's output map, or `None` where the padding eats all of it.
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

/// A convolution and which parts of its [epilogue](crate::Conv2dEpilogue) there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FusedConv2dParams {
    /// How the kernel moves.
    pub conv: Conv2dParams,
    /// Whether there is a scale.
    pub scaled: bool,
    /// Whether there is a residual.
    pub added: bool,
    /// What follows.
    pub activation: Activation,
}
