//! The gradients of one image, as every template reads them: directions without sign, on a pyramid.
//!
//! Per level `m` (its pixel is `2^m` image pixels), at each pixel:
//! - `tr`: energy of the gradient, `gx² + gy²` averaged over the three channels and over a 3×3
//!   binomial window, in (grey levels / level pixel)²;
//! - `v = (gx² − gy², 2 gx gy)`, averaged alike: the gradient's direction at twice its angle, so
//!   that a gradient and its negative are the same and neighbours of one direction add up;
//! - `d = v / (tr + floor)`, the direction that is kept: length near 1 on a clean edge, near 0 where
//!   directions are mixed (corners, clutter) or where there is nothing above the noise.
//!
//! Averaging the structure tensor over channels (Di Zenzo, 1986) sees edges that have the same
//! brightness on both sides but another colour.

use image::RgbImage;
use wide::f32x4;

use crate::config::GradientConfig;
use crate::parallel;

/// Levels are added while both sides keep this many pixels. Chosen by hand, not measured.
const SMALLEST_LEVEL_SIDE: usize = 24;
/// Level 6 makes one pixel of 64: no part needs more. Derived from the coarsest extent of a template, 32 level pixels: a
/// part of 2048 image pixels.
const MAX_LEVELS: usize = 7;

/// Gradient directions of one image on a pyramid, computed once and read by any number of templates.
///
/// # Shapes
/// Level `m` has `width >> m` by `height >> m` pixels; a point `p` of the image stands at
/// `p / 2^m` there.
#[derive(Debug, Clone)]
pub struct GradientField {
    levels: Vec<GradientLevel>,
}

impl GradientField {
    /// Computes the field of `image`. Images of any size are accepted; an empty one has no gradients.
    pub fn new(image: &RgbImage) -> Self {
        Self::with_config(image, &GradientConfig::DEFAULT)
    }

    /// As [`new`](Self::new), with another sense of what is noise.
    pub fn with_config(image: &RgbImage, config: &GradientConfig) -> Self {
        let mut planes = Planes::from_image(image);
        let mut levels = vec![GradientLevel::new(&planes, config)];
        while levels.len() < MAX_LEVELS && planes.width.min(planes.height) / 2 >= SMALLEST_LEVEL_SIDE {
            planes = planes.halved();
            levels.push(GradientLevel::new(&planes, config));
        }
        Self { levels }
    }

    /// Width of the image in pixels.
    pub fn width(&self) -> usize {
        self.levels[0].width
    }

    /// Height of the image in pixels.
    pub fn height(&self) -> usize {
        self.levels[0].height
    }

    /// Number of pyramid levels, at least one.
    pub fn num_levels(&self) -> usize {
        self.levels.len()
    }

    /// The level whose pixel is nearest to `pixel_size` image pixels.
    pub(crate) fn level_idx_for(&self, pixel_size: f64) -> usize {
        let idx = pixel_size.max(1.0).log2().round() as usize;
        idx.min(self.levels.len() - 1)
    }

    pub(crate) fn level(&self, idx: usize) -> &GradientLevel {
        &self.levels[idx]
    }
}

/// What one pixel keeps: `[d.x, d.y, tr]` (see the module's legend).
pub(crate) type DirectionSample = [f32; 3];

/// One level of a [`GradientField`].
#[derive(Debug, Clone)]
pub(crate) struct GradientLevel {
    width: usize,
    height: usize,
    /// Each with a fourth number, so that it is read at once.
    samples: Vec<[f32; 4]>,
    floor: f32,
    reading: Reading,
}

/// What every reading between pixels needs.
#[derive(Debug, Clone, Copy)]
struct Reading {
    /// Width and height, and the last pixel of each.
    size: [f32; 2],
    last: [f32; 2],
    /// The last pixel that has a neighbour, and how far away that is.
    last_pair: [i32; 2],
    step: [usize; 2],
}

impl Reading {
    fn new(width: usize, height: usize) -> Self {
        let sides = [width, height];
        Self {
            size: sides.map(|side| side as f32),
            last: sides.map(|side| side.saturating_sub(1) as f32),
            last_pair: sides.map(|side| side.saturating_sub(2) as i32),
            step: [usize::from(width > 1), if height > 1 { width } else { 0 }],
        }
    }
}

impl GradientLevel {
    fn new(planes: &Planes, config: &GradientConfig) -> Self {
        let (width, height) = (planes.width, planes.height);
        let mut samples = structure_tensors(planes);
        let floor = config.min_gradient.powi(2) + config.noise_factor * quiet_energy(&samples);
        parallel::for_each_stretch(&mut samples, BAND * width.max(1), |samples| {
            for sample in samples {
                let [tr, vx, vy, _] = *sample;
                let scale = 1.0 / (tr + floor);
                *sample = [vx * scale, vy * scale, tr, 0.0];
            }
        });
        Self { width, height, samples, floor, reading: Reading::new(width, height) }
    }

    pub(crate) fn width(&self) -> usize {
        self.width
    }

    pub(crate) fn height(&self) -> usize {
        self.height
    }

    /// The samples of a row, from left to right.
    pub(crate) fn row(&self, row: usize) -> &[[f32; 4]] {
        &self.samples[row * self.width..][..self.width]
    }

    /// Energy that an edge must exceed to be trusted, in (grey levels / level pixel)².
    pub(crate) fn floor(&self) -> f32 {
        self.floor
    }

    /// Sample of the pixel that holds `(x, y)` in level pixels, `None` outside.
    #[inline(always)]
    pub(crate) fn nearest(&self, x: f32, y: f32) -> Option<DirectionSample> {
        let [width, height] = self.reading.size;
        if !(x >= 0.0 && y >= 0.0 && x < width && y < height) {
            return None;
        }
        // No image has so many pixels a side that 32 bits would not hold them; 64 take several times as long.
        let [dx, dy, energy, _] = self.samples[y as i32 as usize * self.width + x as i32 as usize];
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
        let u = (x - 0.5).max(0.0).min(last[0]);
        let v = (y - 0.5).max(0.0).min(last[1]);
        let (col, row) = ((u as i32).min(last_pair[0]), (v as i32).min(last_pair[1]));
        let (fx, fy) = (u - col as f32, v - row as f32);
        let at = row as usize * self.width + col as usize;
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
    /// The bilinear samples `[d.x, d.y, tr, 0]` at the first `out.len()` places, with the bits of [`Self::bilinear`]; zeros outside the
    /// image. Which of the places lie inside, as 1 or 0.
    #[inline(always)]
    pub(crate) fn bilinear_all<const N: usize>(&self, x: &[f32; N], y: &[f32; N], out: &mut [f32x4]) -> [f32; N] {
        let Reading { size, last, last_pair, .. } = self.reading;
        let last_pair = last_pair.map(|last| last as f32);
        let (mut fx, mut fy, mut inside, mut idxs) = ([0.0; N], [0.0; N], [0.0; N], [0u32; N]);
        for k in 0..N {
            let is_inside = (x[k] >= 0.0) & (y[k] >= 0.0) & (x[k] <= size[0]) & (y[k] <= size[1]);
            inside[k] = if is_inside { 1.0 } else { 0.0 };
            let u = (x[k] - 0.5).max(0.0).min(last[0]);
            let v = (y[k] - 0.5).max(0.0).min(last[1]);
            let (col, row) = (u.floor().min(last_pair[0]), v.floor().min(last_pair[1]));
            fx[k] = u - col;
            fy[k] = v - row;
            idxs[k] = whole(row).wrapping_mul(self.width as u32).wrapping_add(whole(col));
        }
        for (k, out) in out.iter_mut().enumerate().take(N) {
            let at = idxs[k] as usize;
            let Some(window) = self.samples.get(at..at + self.width + 2) else { continue };
            let (Some([a, b]), Some([c, d])) = (window.first_chunk(), window.last_chunk()) else { continue };
            let [a, b, c, d] = [a, b, c, d].map(|sample| f32x4::new(*sample));
            let top = a + f32x4::splat(fx[k]) * (b - a);
            let bottom = c + f32x4::splat(fx[k]) * (d - c);
            *out = (top + f32x4::splat(fy[k]) * (bottom - top)) * f32x4::splat(inside[k]);
        }
        inside
    }
}

/// A whole number from 0 to 2²³ − 1 as an integer: added to 2²³, its bits are the last of the sum's. A conversion that must answer for
/// every float is not made in lanes.
#[inline(always)]
pub(crate) fn whole(value: f32) -> u32 {
    const TWO_TO_23: f32 = 8_388_608.0;
    (value + TWO_TO_23).to_bits() & 0x007f_ffff
}

/// Energy of the pixels of the quiet quarter, read from at most a few thousand of them.
fn quiet_energy(samples: &[[f32; 4]]) -> f32 {
    // A prime stride does not fall in step with rows or with a periodic texture.
    let stride = (samples.len() / 4096).max(1) | 1;
    let mut energies: Vec<f32> = samples.iter().step_by(stride).map(|s| s[0]).collect();
    if energies.is_empty() {
        return 0.0;
    }
    let quarter = energies.len() / 4;
    *energies.select_nth_unstable_by(quarter, f32::total_cmp).1
}

/// The three channels of an image, one after the other.
struct Planes {
    width: usize,
    height: usize,
    channels: [Vec<u8>; 3],
}

impl Planes {
    fn from_image(image: &RgbImage) -> Self {
        let (width, height) = (image.width() as usize, image.height() as usize);
        let mut channels = [(); 3].map(|()| vec![0; width * height]);
        for (idx, pixel) in image.as_raw().chunks_exact(3).enumerate() {
            for (channel, &value) in channels.iter_mut().zip(pixel) {
                channel[idx] = value;
            }
        }
        Self { width, height, channels }
    }

    /// Mean of 2×2 pixels; an odd last row or column is left out.
    fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let channels = [0, 1, 2].map(|c| {
            let mut out = Vec::with_capacity(width * height);
            for row in 0..height {
                let top = &self.channels[c][2 * row * self.width..][..2 * width];
                let bottom = &self.channels[c][(2 * row + 1) * self.width..][..2 * width];
                out.extend(top.chunks_exact(2).zip(bottom.chunks_exact(2)).map(|(a, b)| {
                    let sum = u16::from(a[0]) + u16::from(a[1]) + u16::from(b[0]) + u16::from(b[1]);
                    ((sum + 2) / 4) as u8
                }));
            }
            out
        });
        Self { width, height, channels }
    }
}

/// Pixels repeated at each end of a row, so that the filters need no case for the border. Derived: the radius of the 5-tap
/// filter.
const PAD: usize = 2;
/// The 5-tap binomial filter in both directions multiplies by this much. Derived: 16 × 16.
const BLUR_GAIN: f32 = 256.0;

/// Rows that one thread takes at a time. Chosen for time; results do not depend on it.
const BAND: usize = 64;

/// `[tr, v.x, v.y, 0]` of every pixel, row by row.
fn structure_tensors(planes: &Planes) -> Vec<[f32; 4]> {
    if planes.width == 0 {
        return Vec::new();
    }
    let bands: Vec<usize> = (0..planes.height).step_by(BAND).collect();
    parallel::map(&bands, |&start| tensors_of_band(planes, start, (start + BAND).min(planes.height))).concat()
}

/// The same of the rows from `start` to before `end`, through rings of three rows that stay in the cache.
fn tensors_of_band(planes: &Planes, start: usize, end: usize) -> Vec<[f32; 4]> {
    let width = planes.width;
    let mut samples = Vec::with_capacity(width * (end - start));
    let mut blurred = BlurredRows::new(width);
    let mut tensors = [(); 3].map(|()| TensorRow::new(width));
    let mut vertical = TensorRow::new(width);
    let (rows, start, end) = (planes.height as isize, start as isize, end as isize);
    let first = (start - 1).max(0);
    for row in [first - 1, first] {
        blurred.compute(planes, row.max(0));
    }
    for row in first..(end + 1).min(rows) {
        blurred.compute(planes, (row + 1).min(rows - 1));
        tensors[(row % 3) as usize].compute(&blurred, row, rows);
        if row > start {
            emit_smoothed(&tensors, row - 1, rows, &mut vertical, &mut samples);
        }
    }
    if end == rows {
        emit_smoothed(&tensors, rows - 1, rows, &mut vertical, &mut samples);
    }
    samples
}

/// Ring of rows smoothed with the binomial 1-4-6-4-1 in both directions, per channel.
struct BlurredRows {
    width: usize,
    rows: [[Vec<u16>; 3]; 3],
    vertical: Vec<u16>,
}

impl BlurredRows {
    fn new(width: usize) -> Self {
        Self {
            width,
            rows: [(); 3].map(|()| [(); 3].map(|()| vec![0; width + 2 * PAD])),
            vertical: vec![0; width + 2 * PAD],
        }
    }

    fn compute(&mut self, planes: &Planes, row: isize) {
        let (width, last) = (self.width, planes.height as isize - 1);
        for channel in 0..3 {
            let line = |offset: isize| {
                let y = (row + offset).clamp(0, last) as usize;
                &planes.channels[channel][y * width..][..width]
            };
            let (a, b, c, d, e) = (line(-2), line(-1), line(0), line(1), line(2));
            let inner = &mut self.vertical[PAD..PAD + width];
            for x in 0..width {
                inner[x] =
                    u16::from(a[x]) + u16::from(e[x]) + 4 * (u16::from(b[x]) + u16::from(d[x])) + 6 * u16::from(c[x]);
            }
            pad(&mut self.vertical, width);
            let out = &mut self.rows[row as usize % 3][channel];
            let source = &self.vertical;
            let (a, b, c) = (&source[..width], &source[1..][..width], &source[2..][..width]);
            let (d, e) = (&source[3..][..width], &source[4..][..width]);
            // 255 · 16 · 16 = 65280 still fits in 16 bits.
            for (x, out) in out[PAD..PAD + width].iter_mut().enumerate() {
                *out = a[x] + e[x] + 4 * (b[x] + d[x]) + 6 * c[x];
            }
            pad(out, width);
        }
    }
}

fn pad<T: Copy>(row: &mut [T], width: usize) {
    for k in 0..PAD {
        row[k] = row[PAD];
        row[PAD + width + k] = row[PAD + width - 1];
    }
}

/// One row of structure tensors, padded.
struct TensorRow {
    tr: Vec<f32>,
    vx: Vec<f32>,
    vy: Vec<f32>,
}

impl TensorRow {
    fn new(width: usize) -> Self {
        let zeros = vec![0.0; width + 2 * PAD];
        Self { tr: zeros.clone(), vx: zeros.clone(), vy: zeros }
    }

    /// Sums the three channels' tensors; one-sided differences at the upper and lower border count
    /// half, which only weakens gradients there.
    fn compute(&mut self, blurred: &BlurredRows, row: isize, rows: isize) {
        let width = blurred.width;
        // Central difference, the blur's gain, and the mean over three channels.
        let gain = (0.5 / BLUR_GAIN).powi(2) / 3.0;
        let ring = |y: isize| &blurred.rows[y.clamp(0, rows - 1) as usize % 3];
        let (above, here, below) = (ring(row - 1), ring(row), ring(row + 1));
        for channel in 0..3 {
            let left = &here[channel][PAD - 1..][..width];
            let right = &here[channel][PAD + 1..][..width];
            let up = &above[channel][PAD..][..width];
            let down = &below[channel][PAD..][..width];
            let tr = &mut self.tr[PAD..][..width];
            let vx = &mut self.vx[PAD..][..width];
            let vy = &mut self.vy[PAD..][..width];
            let keep = if channel == 0 { 0.0 } else { 1.0 };
            for x in 0..width {
                let gx = (i32::from(right[x]) - i32::from(left[x])) as f32;
                let gy = (i32::from(down[x]) - i32::from(up[x])) as f32;
                let (xx, yy) = (gx * gx * gain, gy * gy * gain);
                tr[x] = keep * tr[x] + (xx + yy);
                vx[x] = keep * vx[x] + (xx - yy);
                vy[x] = keep * vy[x] + 2.0 * gain * gx * gy;
            }
        }
    }
}

/// Smooths the tensors of `row` with the binomial 1-2-1 in both directions and appends them.
fn emit_smoothed(
    ring: &[TensorRow; 3],
    row: isize,
    rows: isize,
    vertical: &mut TensorRow,
    samples: &mut Vec<[f32; 4]>,
) {
    let line = |y: isize| &ring[(y.clamp(0, rows - 1) % 3) as usize];
    let (above, here, below) = (line(row - 1), line(row), line(row + 1));
    let width = here.tr.len() - 2 * PAD;
    let smooth = |out: &mut Vec<f32>, a: &[f32], b: &[f32], c: &[f32]| {
        for x in PAD..PAD + width {
            out[x] = 0.25 * (a[x] + c[x]) + 0.5 * b[x];
        }
        pad(out, width);
    };
    smooth(&mut vertical.tr, &above.tr, &here.tr, &below.tr);
    smooth(&mut vertical.vx, &above.vx, &here.vx, &below.vx);
    smooth(&mut vertical.vy, &above.vy, &here.vy, &below.vy);
    let across = |v: &[f32], x: usize| 0.25 * (v[x - 1] + v[x + 1]) + 0.5 * v[x];
    samples.extend(
        (PAD..PAD + width).map(|x| [across(&vertical.tr, x), across(&vertical.vx, x), across(&vertical.vy, x), 0.0]),
    );
}
