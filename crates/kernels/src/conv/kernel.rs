//! Convolution forwards, its input's gradient, and its bias's gradient, on `f32` slices.
//!
//! Maps stand channels last, `[N, H, W, C]`.

use super::Conv2dParams;
use super::direct::{DirectConv, Maps, Target};
use super::filters::{Direction, Filters, Panels};
use super::winograd;
use crate::parallel::{Output, Raw};
use crate::product::Epilogue;
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

/// Runs a convolution in either direction: `[N, Ho, Wo, Co]` from `x` going forwards, `[N, Hi, Wi, Ci]` from the
/// output's gradient going back. `filters` packs the weight, for Winograd's way or directly.
pub(crate) fn convolve(
    isa: Isa,
    direction: Direction,
    source: &[f32],
    filters: &dyn Fn(bool) -> Filters,
    epilogue: Epilogue<'_>,
    shape: &ConvShape,
) -> Vec<f32> {
    let [from, to] = match direction {
        Direction::Forward => [shape.input(), shape.output()],
        Direction::Backward => [shape.output(), shape.input()],
    };
    let source = Maps { values: source, num_images: from[0], size: [from[2], from[3]], channels: from[1] };
    let output = Output::new(to.iter().product());
    if winograd::suits(shape)
        && let Filters::Winograd(panels) = filters(true)
    {
        let padding = match direction {
            Direction::Forward => shape.params.padding,
            Direction::Backward => shape.params.padding.map(|padding| 2 - padding),
        };
        // SAFETY: nothing else has the output.
        if unsafe { winograd::run(isa, source, padding, [to[2], to[3]], &panels, epilogue, output.raw()) } {
            // SAFETY: the tiles together are the whole output.
            return unsafe { output.into_vec() };
        }
    }
    if let Filters::Direct(products) = filters(false) {
        // SAFETY: nothing else has the output.
        unsafe { run_direct(isa, direction, source, &products, epilogue, shape, output.raw()) };
    }
    // SAFETY: the grid, or the phases together, are the whole output.
    unsafe { output.into_vec() }
}

/// # Safety
/// Nothing else touches `output`.
unsafe fn run_direct(
    isa: Isa,
    direction: Direction,
    source: Maps<'_>,
    products: &[Panels],
    epilogue: Epilogue<'_>,
    shape: &ConvShape,
    output: Raw,
) {
    if direction == Direction::Forward {
        let conv = DirectConv {
            source,
            first: shape.params.padding.map(|padding| -(padding as isize)),
            window: shape.kernel,
            stride: shape.params.stride,
            grid: shape.out_size,
            filters: &products[0],
            epilogue,
            target: Target { size: shape.out_size, origin: [0, 0], step: [1, 1] },
        };
        // SAFETY: the caller's promise.
        unsafe { conv.run(isa, output) };
        return;
    }
    for (phase, filters) in phases(shape).iter().zip(products) {
        let target = Target { size: shape.in_size, origin: phase.origin, step: shape.params.stride };
        let window = [phase.cells_y.len(), phase.cells_x.len()];
        if window.contains(&0) {
            // SAFETY: the caller's promise; the phase has its own pixels.
            unsafe { fill_phase(shape, target, phase.grid, epilogue, output) };
            continue;
        }
        let conv = DirectConv {
            source,
            first: phase.first,
            window,
            stride: [1, 1],
            grid: phase.grid,
            filters,
            epilogue,
            target,
        };
        // SAFETY: the caller's promise; the phase has its own pixels.
        unsafe { conv.run(isa, output) };
    }
}

/// Input pixels with the same remainder of `i + padding`, which share the kernel cells that reach them.
///
/// Input pixel i is reached by output pixel o through kernel cell k where `i + padding = o·stride + k`: each phase is
/// a convolution of stride 1 over the output's gradient, with those cells only.
pub(super) struct Phase {
    /// First pixel.
    pub(super) origin: [usize; 2],
    /// Pixels.
    pub(super) grid: [usize; 2],
    /// Output pixel that the first of the cells comes from, at the first pixel.
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

/// Writes pixels that no kernel cell reaches.
///
/// # Safety
/// Nothing else touches the phase's pixels of `output`.
unsafe fn fill_phase(shape: &ConvShape, target: Target, grid: [usize; 2], epilogue: Epilogue<'_>, output: Raw) {
    let channels = shape.in_channels;
    for image in 0..shape.num_images {
        for y in 0..grid[0] {
            for x in 0..grid[1] {
                let y = target.origin[0] + y * target.step[0];
                let x = target.origin[1] + x * target.step[1];
                let at = ((image * target.size[0] + y) * target.size[1] + x) * channels;
                assert!(at + channels <= output.len);
                // SAFETY: inside the output, and the phase's own pixel.
                let pixel = unsafe { std::slice::from_raw_parts_mut(output.at(at), channels) };
                match epilogue.bias {
                    Some(bias) => pixel.copy_from_slice(&bias[..channels]),
                    None => pixel.fill(0.0),
                }
                if let Some(residual) = epilogue.residual {
                    let residual = &residual[at..at + channels];
                    pixel.iter_mut().zip(residual).for_each(|(value, residual)| *value += residual);
                }
                if epilogue.relu {
                    pixel.iter_mut().filter(|value| **value <= 0.0).for_each(|value| *value = 0.0);
                }
            }
        }
    }
}
