//! Convolution forwards, its input's gradient, and its bias's gradient, on `f32` slices.

use super::Conv2dParams;
use super::gather::{GatherConv, PackedFilters, Source, Tap, Target};
use crate::parallel::{Output, for_each_unit};
use crate::simd::Isa;

/// The sizes of one convolution, however it is computed.
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

    /// Sizes of the convolution whose transpose takes `x` `[N, Co, Ho, Wo]` with `weight` `[Co, Ci, Kh, Kw]`.
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

    /// `[N, Ci, Hi, Wi]`
    pub(crate) fn input(&self) -> [usize; 4] {
        let [height, width] = self.in_size;
        [self.num_images, self.in_channels, height, width]
    }

    /// `[N, Co, Ho, Wo]`
    pub(crate) fn output(&self) -> [usize; 4] {
        let [height, width] = self.out_size;
        [self.num_images, self.out_channels, height, width]
    }

    /// `[Co, Ci, Kh, Kw]`
    pub(crate) fn weight(&self) -> [usize; 4] {
        let [height, width] = self.kernel;
        [self.out_channels, self.in_channels, height, width]
    }
}

/// The convolution of `x` with `weight`, plus `bias`: `[N, Co, Ho, Wo]`.
pub(crate) fn forward(isa: Isa, x: &[f32], weight: &[f32], bias: Option<&[f32]>, shape: &ConvShape) -> Vec<f32> {
    let [kernel_height, kernel_width] = shape.kernel;
    let [padding_y, padding_x] = shape.params.padding;
    let taps: Vec<Tap> = (0..kernel_height)
        .flat_map(|y| (0..kernel_width).map(move |x| (y, x)))
        .map(|(y, x)| Tap { dy: y as isize - padding_y as isize, dx: x as isize - padding_x as isize })
        .collect();
    let depth = shape.in_channels * taps.len();
    let offsets: Vec<usize> = (0..depth).collect();
    let filters = PackedFilters::new(weight, shape.out_channels, depth, &offsets);
    let output = Output::new(shape.output().iter().product());
    let conv = GatherConv {
        source: Source {
            values: x,
            num_images: shape.num_images,
            channels: shape.in_channels,
            height: shape.in_size[0],
            width: shape.in_size[1],
        },
        taps: &taps,
        stride: shape.params.stride,
        grid: shape.out_size,
        filters: &filters,
        bias,
        target: Target { size: shape.out_size, origin: [0, 0], step: [1, 1] },
    };
    conv.run(isa, &output);
    // SAFETY: the grid is the whole output.
    unsafe { output.into_vec() }
}

/// The gradient with respect to the input, `[N, Ci, Hi, Wi]`, from that of the output; `bias` is added to it.
///
/// Input pixel i is reached by output pixel o through kernel cell k where `i + padding = o·stride + k`. Pixels
/// with the same remainder of `i + padding` share the cells that reach them: each such *phase* is a
/// convolution of stride 1 over the output gradient, with those cells only.
pub(crate) fn input_gradient(
    isa: Isa,
    output_grad: &[f32],
    weight: &[f32],
    bias: Option<&[f32]>,
    shape: &ConvShape,
) -> Vec<f32> {
    let [step_y, step_x] = shape.params.stride;
    let [kernel_height, kernel_width] = shape.kernel;
    let output = Output::new(shape.input().iter().product());
    let source = Source {
        values: output_grad,
        num_images: shape.num_images,
        channels: shape.out_channels,
        height: shape.out_size[0],
        width: shape.out_size[1],
    };
    for phase_y in 0..step_y.min(shape.in_size[0]) {
        for phase_x in 0..step_x.min(shape.in_size[1]) {
            let cells_y = cells_of_phase(phase_y, kernel_height, step_y, shape.params.padding[0]);
            let cells_x = cells_of_phase(phase_x, kernel_width, step_x, shape.params.padding[1]);
            let mut taps = Vec::new();
            let mut cells = Vec::new();
            for &(cell_y, dy) in &cells_y {
                for &(cell_x, dx) in &cells_x {
                    taps.push(Tap { dy, dx });
                    cells.push(cell_y * kernel_width + cell_x);
                }
            }
            let target = Target { size: shape.in_size, origin: [phase_y, phase_x], step: [step_y, step_x] };
            let grid = [(shape.in_size[0] - phase_y).div_ceil(step_y), (shape.in_size[1] - phase_x).div_ceil(step_x)];
            if taps.is_empty() {
                fill_phase(&output, shape, target, grid, bias);
                continue;
            }
            // Weight [Co, Ci, Kh·Kw]: filters are input channels, K runs over output channels and cells.
            let num_cells = kernel_height * kernel_width;
            let offsets: Vec<usize> = (0..shape.out_channels)
                .flat_map(|channel| {
                    let base = channel * shape.in_channels * num_cells;
                    cells.iter().map(move |cell| base + cell)
                })
                .collect();
            let filters = PackedFilters::new(weight, shape.in_channels, num_cells, &offsets);
            let conv = GatherConv { source, taps: &taps, stride: [1, 1], grid, filters: &filters, bias, target };
            conv.run(isa, &output);
        }
    }
    // SAFETY: the phases together are the whole input.
    unsafe { output.into_vec() }
}

/// Kernel cells that reach input pixels `phase + q·stride`, each with its output pixel relative to q.
fn cells_of_phase(phase: usize, kernel: usize, stride: usize, padding: usize) -> Vec<(usize, isize)> {
    (0..kernel)
        .filter(|cell| (phase + padding) % stride == cell % stride)
        .map(|cell| {
            let distance = (phase + padding) as isize - cell as isize;
            (cell, distance / stride as isize)
        })
        .collect()
}

/// Writes pixels that no kernel cell reaches.
fn fill_phase(output: &Output, shape: &ConvShape, target: Target, grid: [usize; 2], bias: Option<&[f32]>) {
    let [height, width] = target.size;
    for plane in 0..shape.num_images * shape.in_channels {
        let value = bias.map_or(0.0, |bias| bias[plane % shape.in_channels]);
        let row = vec![value; grid[1]];
        for y in 0..grid[0] {
            let y = target.origin[0] + y * target.step[0];
            let at = (plane * height + y) * width + target.origin[1];
            // SAFETY: one thread, and no other phase has these pixels.
            unsafe { output.write(at, target.step[1], &row) };
        }
    }
}

/// Sums over images and pixels, the gradient with respect to a bias: `[C]` from `[N, C, P]`.
pub(crate) fn channel_sums(values: &[f32], num_images: usize, channels: usize) -> Vec<f32> {
    const LANES: usize = 16;
    let pixels = values.len() / (num_images * channels).max(1);
    let output = Output::new(channels);
    for_each_unit(channels, |channel| {
        let mut lanes = [0.0_f32; LANES];
        let mut rest = 0.0;
        for image in 0..num_images {
            let plane = &values[(image * channels + channel) * pixels..][..pixels];
            let blocks = plane.chunks_exact(LANES);
            rest += blocks.remainder().iter().sum::<f32>();
            for block in blocks {
                for (lane, value) in lanes.iter_mut().zip(block) {
                    *lane += value;
                }
            }
        }
        // SAFETY: every unit has its own channel.
        unsafe { output.write(channel, 1, &[lanes.iter().sum::<f32>() + rest]) };
    });
    // SAFETY: one unit for each channel.
    unsafe { output.into_vec() }
}
