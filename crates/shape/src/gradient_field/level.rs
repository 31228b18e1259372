//! One level of a [`GradientField`](super::GradientField), and interpolation between its pixels.

use wide::f32x4;

use super::tensors::{BAND, Planes, structure_tensors, tensors_of_part};
use crate::config::GradientConfig;
use crate::lanes::{larger, smaller};
use crate::parallel;

/// The value of one pixel: `[d.x, d.y, tr]` (see the module's legend).
pub(crate) type DirectionSample = [f32; 3];

/// One level of a [`GradientField`], or a window of it; positions are those of the level.
#[derive(Debug, Clone)]
pub(crate) struct GradientLevel {
    width: usize,
    height: usize,
    /// Each with a fourth number, so that it is read in one load.
    samples: Vec<[f32; 4]>,
    /// Samples per row.
    stride: usize,
    /// Index of the corner, as row * `stride` + column; 0 for a whole level.
    before: usize,
    floor: f32,
    reading: Reading,
}

/// Values needed for every interpolation.
#[derive(Debug, Clone, Copy)]
struct Reading {
    /// Width and height.
    size: [f32; 2],
    /// Indices of the last column and row.
    last: [f32; 2],
    /// The last pixel that has a neighbour.
    last_pair: [i32; 2],
    /// The index distance of that neighbour.
    step: [usize; 2],
}

impl Reading {
    fn new(width: usize, height: usize, stride: usize) -> Self {
        let sides = [width, height];
        Self {
            size: sides.map(|side| side as f32),
            last: sides.map(|side| side.saturating_sub(1) as f32),
            last_pair: sides.map(|side| side.saturating_sub(2) as i32),
            step: [usize::from(width > 1), if height > 1 { stride } else { 0 }],
        }
    }
}

impl GradientLevel {
    pub(super) fn new(planes: &Planes, config: &GradientConfig) -> Self {
        let tensors = structure_tensors(planes);
        let floor = floor_of(quiet_energy(&tensors), config);
        Self::of(planes, tensors, floor)
    }

    /// A whole level, from its tensors.
    pub(super) fn of(planes: &Planes, mut samples: Vec<[f32; 4]>, floor: f32) -> Self {
        let (width, height) = (planes.width, planes.height);
        parallel::for_each_stretch(&mut samples, BAND * width.max(1), |_, samples| directions(samples, floor));
        Self { width, height, samples, stride: width, before: 0, floor, reading: Reading::new(width, height, width) }
    }

    /// The part of a level of `size` pixels from `corner` on. Computed without the thread pool, because other threads
    /// may wait for it.
    pub(super) fn window(planes: &Planes, corner: [usize; 2], size: [usize; 2], floor: f32) -> Self {
        let (width, height) = (planes.width, planes.height);
        let mut samples = tensors_of_part(planes, corner, size);
        directions(&mut samples, floor);
        let stride = size[0];
        let before = corner[1] * stride + corner[0];
        Self { width, height, samples, stride, before, floor, reading: Reading::new(width, height, stride) }
    }

    pub(crate) fn width(&self) -> usize {
        self.width
    }

    pub(crate) fn height(&self) -> usize {
        self.height
    }

    /// The samples of a row of a whole level, from left to right.
    pub(crate) fn row(&self, row: usize) -> &[[f32; 4]] {
        &self.samples[row * self.width..][..self.width]
    }

    /// Energy that an edge must exceed to be trusted, in (grey levels / level pixel)².
    pub(crate) fn floor(&self) -> f32 {
        self.floor
    }

    /// The index of the sample of a level pixel.
    #[inline(always)]
    fn idx_of(&self, row: usize, col: usize) -> usize {
        (row * self.stride + col).wrapping_sub(self.before)
    }

    /// Sample of the pixel that holds `(x, y)` in level pixels, `None` outside.
    #[inline(always)]
    pub(crate) fn nearest(&self, x: f32, y: f32) -> Option<DirectionSample> {
        let [width, height] = self.reading.size;
        if !(x >= 0.0 && y >= 0.0 && x < width && y < height) {
            return None;
        }
        // The conversion to 32 bits suffices for any image and is several times faster than that to 64.
        let [dx, dy, energy, _] = *self.samples.get(self.idx_of(y as i32 as usize, x as i32 as usize))?;
        Some([dx, dy, energy])
    }

    /// Bilinear sample at `(x, y)` in level pixels, `None` outside the image.
    #[inline(always)]
    pub(crate) fn bilinear(&self, x: f32, y: f32) -> Option<DirectionSample> {
        let Reading { size, last, last_pair, step } = self.reading;
        if !(x >= 0.0 && y >= 0.0 && x <= size[0] && y <= size[1]) {
            return None;
        }
        // Within half a pixel of the border the border pixel's value is repeated.
        let u = smaller(larger(x - 0.5, 0.0), last[0]);
        let v = smaller(larger(y - 0.5, 0.0), last[1]);
        let (col, row) = ((u as i32).min(last_pair[0]), (v as i32).min(last_pair[1]));
        let (fx, fy) = (u - col as f32, v - row as f32);
        let at = self.idx_of(row as usize, col as usize);
        let upper = self.samples.get(at..=at + step[0])?;
        let lower = self.samples.get(at + step[1]..=at + step[1] + step[0])?;
        let (a, b, c, d) = (upper[0], upper[upper.len() - 1], lower[0], lower[lower.len() - 1]);
        let mut out = [0.0; 4];
        for k in 0..4 {
            let top = a[k] + fx * (b[k] - a[k]);
            let bottom = c[k] + fx * (d[k] - c[k]);
            out[k] = top + fy * (bottom - top);
        }
        let [dx, dy, energy, _] = out;
        Some([dx, dy, energy])
    }
}

impl GradientLevel {
    /// The bilinear samples `[d.x, d.y, tr, 0]` at the first `out.len()` places, bit for bit as [`Self::bilinear`];
    /// zeros outside the image. Also returns 1 for the places inside and 0 for the others.
    #[inline(always)]
    pub(crate) fn bilinear_all<const N: usize>(&self, x: &[f32; N], y: &[f32; N], out: &mut [f32x4]) -> [f32; N] {
        let Reading { size, last, last_pair, .. } = self.reading;
        let last_pair = last_pair.map(|last| last as f32);
        let (stride, before) = (self.stride as u32, self.before as u32);
        let (mut fx, mut fy, mut inside, mut idxs) = ([0.0; N], [0.0; N], [0.0; N], [0u32; N]);
        for k in 0..N {
            let is_inside = (x[k] >= 0.0) & (y[k] >= 0.0) & (x[k] <= size[0]) & (y[k] <= size[1]);
            inside[k] = if is_inside { 1.0 } else { 0.0 };
            let u = smaller(larger(x[k] - 0.5, 0.0), last[0]);
            let v = smaller(larger(y[k] - 0.5, 0.0), last[1]);
            let (col, row) = (smaller(u.floor(), last_pair[0]), smaller(v.floor(), last_pair[1]));
            fx[k] = u - col;
            fy[k] = v - row;
            idxs[k] = whole(row).wrapping_mul(stride).wrapping_add(whole(col)).wrapping_sub(before);
        }
        for (k, out) in out.iter_mut().enumerate().take(N) {
            let at = idxs[k] as usize;
            let Some(window) = self.samples.get(at..at + self.stride + 2) else { continue };
            let (Some([a, b]), Some([c, d])) = (window.first_chunk(), window.last_chunk()) else { continue };
            let [a, b, c, d] = [a, b, c, d].map(|sample| f32x4::new(*sample));
            let top = a + f32x4::splat(fx[k]) * (b - a);
            let bottom = c + f32x4::splat(fx[k]) * (d - c);
            *out = (top + f32x4::splat(fy[k]) * (bottom - top)) * f32x4::splat(inside[k]);
        }
        inside
    }
}

/// Converts a whole number from 0 to 2²³ − 1 to an integer: after adding 2²³ its bits are the lowest of the sum. A
/// conversion that handles every float is not vectorised.
#[inline(always)]
pub(crate) fn whole(value: f32) -> u32 {
    const TWO_TO_23: f32 = 8_388_608.0;
    (value + TWO_TO_23).to_bits() & 0x007f_ffff
}

/// Minimum energy of an edge, given the lower quartile of the energies.
pub(super) fn floor_of(quiet: f32, config: &GradientConfig) -> f32 {
    config.min_gradient.powi(2) + config.noise_factor * quiet
}

/// Tensors to directions.
fn directions(samples: &mut [[f32; 4]], floor: f32) {
    for sample in samples {
        let [tr, vx, vy, _] = *sample;
        let scale = 1.0 / (tr + floor);
        *sample = [vx * scale, vy * scale, tr, 0.0];
    }
}

/// Lower quartile of the pixels' energies, estimated from at most a few thousand pixels.
pub(super) fn quiet_energy(samples: &[[f32; 4]]) -> f32 {
    // An odd stride rarely coincides with rows or with a periodic texture.
    let stride = (samples.len() / 4096).max(1) | 1;
    let mut energies: Vec<f32> = samples.iter().step_by(stride).map(|s| s[0]).collect();
    if energies.is_empty() {
        return 0.0;
    }
    let quarter = energies.len() / 4;
    *energies.select_nth_unstable_by(quarter, f32::total_cmp).1
}
