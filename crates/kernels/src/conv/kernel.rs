//! A convolution forwards, and the gradient of its input, on `f32` slices.
//!
//! Maps are channels last, `[N, H, W, C]`.

use super::direct::{DirectConv, Maps, Target};
use super::filters::Filters;
use super::panels::{Direction, Panels};
use super::shape::{ConvShape, phases};
use super::winograd;
use crate::parallel::{Output, Raw};
use crate::product::Epilogue;
use crate::simd::Isa;

/// Runs a convolution in either direction: `[N, Ho, Wo, Co]` from the input forwards, `[N, Hi, Wi, Ci]` from the
/// output's gradient backwards. `filters` returns the packed weight, for Winograd's method (`true`) or for direct
/// products (`false`).
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
        // SAFETY: nothing else accesses the output.
        if unsafe { winograd::run(isa, source, padding, [to[2], to[3]], &panels, epilogue, output.raw()) } {
            // SAFETY: the tiles together are the whole output.
            return unsafe { output.into_vec() };
        }
    }
    if let Filters::Direct(products) = filters(false) {
        // SAFETY: nothing else accesses the output.
        unsafe { run_direct(isa, direction, source, &products, epilogue, shape, output.raw()) };
    }
    // SAFETY: the grid, or the phases together, are the whole output.
    unsafe { output.into_vec() }
}

/// Computes the convolution, or the transposed one, directly from the input.
///
/// # Safety
/// Nothing else accesses `output`.
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
        // SAFETY: the caller promises that nothing else accesses the output; the target is the whole output.
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

/// Writes pixels that no kernel cell reaches.
///
/// # Safety
/// Nothing else accesses the phase's pixels of `output`.
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
