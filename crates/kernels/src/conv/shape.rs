//! The sizes of a convolution, and the phases in which its transpose writes.

use crate::params::Conv2dParams;

/// The sizes of one convolution, for any method of computation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ConvShape {
    pub(crate) num_images: usize,
    pub(crate) in_channels: usize,
    pub(crate) in_size: [usize; 2],
    pub(crate) out_channels: usize,
    pub(crate) out_size: [usize; 2],
    pub(crate) kernel: [usize; 2],
    pub(crate) params: Conv2dParams,
}

impl ConvShape {
    /// Sizes of a convolution of `x` `[N, Ci, Hi, Wi]` with `weight` `[Co, Ci, Kh, Kw]`.
    pub(crate) fn forward(x: [usize; 4], weight: [usize; 4], params: Conv2dParams) -> Self {
        let [num_images, in_channels, in_height, in_width] = x;
        let [out_channels, _, kernel_height, kernel_width] = weight;
        let in_size = [in_height, in_width];
        let kernel = [kernel_height, kernel_width];
        Self {
            num_images,
            in_channels,
            in_size,
            out_channels,
            out_size: params
                .output_size(in_size, kernel)
                .expect("the kernel fits the padded input, checked by `conv2d`"),
            kernel,
            params,
        }
    }

    /// Sizes of the convolution whose transpose maps `x` `[N, Co, Ho, Wo]` with `weight` `[Co, Ci, Kh, Kw]`.
    pub(crate) fn transposed(x: [usize; 4], weight: [usize; 4], params: Conv2dParams) -> Self {
        let [num_images, out_channels, out_height, out_width] = x;
        let [_, in_channels, kernel_height, kernel_width] = weight;
        let out_size = [out_height, out_width];
        let kernel = [kernel_height, kernel_width];
        Self {
            num_images,
            in_channels,
            in_size: params
                .transposed_output_size(out_size, kernel)
                .expect("the padding leaves an output, checked by `conv_transpose2d`"),
            out_channels,
            out_size,
            kernel,
            params,
        }
    }

    /// Shape of the input, `[N, Ci, Hi, Wi]`.
    pub(crate) fn input(&self) -> [usize; 4] {
        let [height, width] = self.in_size;
        [self.num_images, self.in_channels, height, width]
    }

    /// Shape of the output, `[N, Co, Ho, Wo]`.
    pub(crate) fn output(&self) -> [usize; 4] {
        let [height, width] = self.out_size;
        [self.num_images, self.out_channels, height, width]
    }

    /// Shape of the weight, `[Co, Ci, Kh, Kw]`.
    pub(crate) fn weight(&self) -> [usize; 4] {
        let [height, width] = self.kernel;
        [self.out_channels, self.in_channels, height, width]
    }
}

/// Input pixels i with the same remainder of `i + padding` modulo the stride, which share the kernel cells that reach
/// them.
///
/// Input pixel i is reached by output pixel o through kernel cell k if `i + padding = o·stride + k`: each phase is a
/// convolution of stride 1 over the output's gradient, with those cells only.
pub(super) struct Phase {
    /// First pixel of the phase.
    pub(super) origin: [usize; 2],
    /// Number of pixels, down and across.
    pub(super) grid: [usize; 2],
    /// Output pixel that the first of the cells reads at the first pixel.
    pub(super) first: [isize; 2],
    /// Rows of the kernel, by ascending output pixel.
    pub(super) cells_y: Vec<usize>,
    /// Columns of the kernel, by ascending output pixel.
    pub(super) cells_x: Vec<usize>,
}

/// The phases that have pixels.
pub(super) fn phases(shape: &ConvShape) -> Vec<Phase> {
    let axis = |axis: usize| -> Vec<(usize, isize, Vec<usize>)> {
        let (stride, padding) = (shape.params.stride[axis], shape.params.padding[axis]);
        (0..stride.min(shape.in_size[axis]))
            .map(|phase| {
                let cells: Vec<usize> =
                    (0..shape.kernel[axis]).rev().filter(|cell| (phase + padding) % stride == cell % stride).collect();
                let from = |cell: usize| ((phase + padding) as isize - cell as isize) / stride as isize;
                let first = cells.first().map_or(0, |cell| from(*cell));
                (phase, first, cells)
            })
            .collect()
    };
    let columns = axis(1);
    let phases = axis(0).into_iter().flat_map(|(phase_y, first_y, cells_y)| {
        columns.iter().map(move |(phase_x, first_x, cells_x)| {
            let origin = [phase_y, *phase_x];
            let pixels = |axis: usize| (shape.in_size[axis] - origin[axis]).div_ceil(shape.params.stride[axis]);
            Phase {
                origin,
                grid: [pixels(0), pixels(1)],
                first: [first_y, *first_x],
                cells_y: cells_y.clone(),
                cells_x: cells_x.clone(),
            }
        })
    });
    phases.collect()
}
