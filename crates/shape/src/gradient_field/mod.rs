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
//!
//! A level of many pixels is computed where it is read alone, window by window ([`windows`]).

mod tensors;
mod windows;

use image::RgbImage;
use nalgebra::Point2;
use wide::f32x4;

use self::tensors::{BAND, Planes, structure_tensors, tensors_of_part};
use self::windows::Windows;

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
    levels: Vec<Level>,
}

#[derive(Debug, Clone)]
enum Level {
    Whole(GradientLevel),
    /// Of many pixels, of which a search reads few at the finest level.
    Windows(Box<Windows>),
}

/// Levels of more pixels are computed window by window. Chosen by hand, for time: three megapixels.
const MAX_WHOLE: usize = 3 << 20;

impl GradientField {
    /// Computes the field of `image`. Images of any size are accepted; an empty one has no gradients.
    pub fn new(image: &RgbImage) -> Self {
        Self::with_config(image, &GradientConfig::DEFAULT)
    }

    /// As [`new`](Self::new), with another sense of what is noise.
    pub fn with_config(image: &RgbImage, config: &GradientConfig) -> Self {
        Self::with_windows_from(image, config, MAX_WHOLE)
    }

    fn with_windows_from(image: &RgbImage, config: &GradientConfig, max_whole: usize) -> Self {
        let mut planes = Planes::from_image(image);
        let mut levels = Vec::new();
        loop {
            let is_last = levels.len() + 1 >= MAX_LEVELS || planes.width.min(planes.height) / 2 < SMALLEST_LEVEL_SIDE;
            let next = (!is_last).then(|| planes.halved());
            levels.push(if planes.width * planes.height > max_whole {
                Level::Windows(Box::new(Windows::new(planes, config)))
            } else {
                Level::Whole(GradientLevel::new(&planes, config))
            });
            match next {
                None => return Self { levels },
                Some(next) => planes = next,
            }
        }
    }

    /// Width of the image in pixels.
    pub fn width(&self) -> usize {
        self.levels[0].size()[0]
    }

    /// Height of the image in pixels.
    pub fn height(&self) -> usize {
        self.levels[0].size()[1]
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

    /// All of a level.
    pub(crate) fn level(&self, idx: usize) -> &GradientLevel {
        match &self.levels[idx] {
            Level::Whole(level) => level,
            Level::Windows(windows) => windows.whole(),
        }
    }

    /// A level that can be read within `reach` of `center`, both in pixels of the image.
    pub(crate) fn level_about(&self, idx: usize, center: &Point2<f64>, reach: f64) -> &GradientLevel {
        match &self.levels[idx] {
            Level::Whole(level) => level,
            Level::Windows(windows) => {
                let pixel_size = f64::from(1u32 << idx);
                windows.about([center.x, center.y].map(|at| at / pixel_size), reach / pixel_size)
            }
        }
    }
}

impl Level {
    fn size(&self) -> [usize; 2] {
        match self {
            Self::Whole(level) => [level.width, level.height],
            Self::Windows(windows) => windows.size(),
        }
    }
}

/// What one pixel keeps: `[d.x, d.y, tr]` (see the module's legend).
pub(crate) type DirectionSample = [f32; 3];

/// One level of a [`GradientField`], or a window of it: places are those of the level.
#[derive(Debug, Clone)]
pub(crate) struct GradientLevel {
    width: usize,
    height: usize,
    /// Each with a fourth number, so that it is read at once.
    samples: Vec<[f32; 4]>,
    /// Samples in a row, and the number that the level's first one would have: 0 or, in a window, below.
    stride: usize,
    before: usize,
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
    fn new(planes: &Planes, config: &GradientConfig) -> Self {
        let tensors = structure_tensors(planes);
        let floor = floor_of(quiet_energy(&tensors), config);
        Self::of(planes, tensors, floor)
    }

    /// All of a level, from its tensors.
    fn of(planes: &Planes, mut samples: Vec<[f32; 4]>, floor: f32) -> Self {
        let (width, height) = (planes.width, planes.height);
        parallel::for_each_stretch(&mut samples, BAND * width.max(1), |_, samples| directions(samples, floor));
        Self { width, height, samples, stride: width, before: 0, floor, reading: Reading::new(width, height, width) }
    }

    /// Part of a level from its corner on. Computed on the thread that needs it: others may wait for it.
    fn window(planes: &Planes, corner: [usize; 2], size: [usize; 2], floor: f32) -> Self {
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

    /// Where the sample of a pixel of the level stands.
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
        // No image has so many pixels a side that 32 bits would not hold them; 64 take several times as long.
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
        let u = (x - 0.5).max(0.0).min(last[0]);
        let v = (y - 0.5).max(0.0).min(last[1]);
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
    /// The bilinear samples `[d.x, d.y, tr, 0]` at the first `out.len()` places, with the bits of [`Self::bilinear`]; zeros outside the
    /// image. Which of the places lie inside, as 1 or 0.
    #[inline(always)]
    pub(crate) fn bilinear_all<const N: usize>(&self, x: &[f32; N], y: &[f32; N], out: &mut [f32x4]) -> [f32; N] {
        let Reading { size, last, last_pair, .. } = self.reading;
        let last_pair = last_pair.map(|last| last as f32);
        let (stride, before) = (self.stride as u32, self.before as u32);
        let (mut fx, mut fy, mut inside, mut idxs) = ([0.0; N], [0.0; N], [0.0; N], [0u32; N]);
        for k in 0..N {
            let is_inside = (x[k] >= 0.0) & (y[k] >= 0.0) & (x[k] <= size[0]) & (y[k] <= size[1]);
            inside[k] = if is_inside { 1.0 } else { 0.0 };
            let u = (x[k] - 0.5).max(0.0).min(last[0]);
            let v = (y[k] - 0.5).max(0.0).min(last[1]);
            let (col, row) = (u.floor().min(last_pair[0]), v.floor().min(last_pair[1]));
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

/// A whole number from 0 to 2²³ − 1 as an integer: added to 2²³, its bits are the last of the sum's. A conversion that must answer for
/// every float is not made in lanes.
#[inline(always)]
pub(crate) fn whole(value: f32) -> u32 {
    const TWO_TO_23: f32 = 8_388_608.0;
    (value + TWO_TO_23).to_bits() & 0x007f_ffff
}

/// Energy that an edge must exceed, where the quiet quarter has this much.
fn floor_of(quiet: f32, config: &GradientConfig) -> f32 {
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

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    /// Whatever is read of a window has the bits of the whole level, at borders too.
    #[test]
    fn windows_read_what_the_whole_level_reads() {
        let noise = |x: u32, y: u32| {
            let mut bits = (x + 700 * y).wrapping_mul(2_654_435_761);
            bits ^= bits >> 15;
            (bits.wrapping_mul(2_246_822_519) >> 24) as u8
        };
        let image = RgbImage::from_fn(691, 503, |x, y| {
            let plate = if x % 97 > 30 && y % 71 > 20 { 90 } else { 0 };
            Rgb([noise(x, y) / 4 + plate, noise(y, x) / 3, plate])
        });
        let windowed = GradientField::with_windows_from(&image, &GradientConfig::DEFAULT, 1000);
        assert!(windowed.levels.iter().all(|level| matches!(level, Level::Windows(_)) || level.size()[0] < 40));
        let (mut num_windows, mut read) = (0, 0);
        for (idx, reach) in [(0, 60.0), (0, 130.0), (1, 90.0), (2, 200.0)] {
            let whole = windowed.level(idx);
            let pixel = f64::from(1u32 << idx);
            for k in 0..60u32 {
                let center = Point2::new(f64::from(k * 211 % 700), f64::from(k * 97 % 510));
                let window = windowed.level_about(idx, &center, reach);
                num_windows += usize::from(!std::ptr::eq(window, whole));
                for i in 0..400u32 {
                    let angle = f64::from(i) * 2.399_963;
                    let far = reach * (f64::from(i) / 399.0).sqrt();
                    let at = center + nalgebra::Vector2::new(angle.cos(), angle.sin()) * far;
                    let [x, y] = [at.x, at.y].map(|at| (at / pixel) as f32);
                    assert_eq!(window.bilinear(x, y), whole.bilinear(x, y), "level {idx}, {at}");
                    assert_eq!(window.nearest(x, y), whole.nearest(x, y), "level {idx}, {at}");
                    let (mut ours, mut theirs) = ([f32x4::ZERO; 8], [f32x4::ZERO; 8]);
                    let (xs, ys) = ([x; 8], [y; 8]);
                    assert_eq!(window.bilinear_all(&xs, &ys, &mut ours), whole.bilinear_all(&xs, &ys, &mut theirs));
                    assert_eq!(ours, theirs, "level {idx}, {at}");
                    read += usize::from(whole.bilinear(x, y).is_some());
                }
            }
        }
        assert!(num_windows > 150 && read > 50_000, "{num_windows} {read}");
    }

    /// A level of many pixels takes its noise from some of its rows, another from pixels all over.
    #[test]
    fn the_noise_of_a_level_is_the_same_either_way() {
        let image = RgbImage::from_fn(900, 700, |x, y| {
            let bits = (x + 1000 * y).wrapping_mul(2_654_435_761) ^ 0x5bd1_e995;
            Rgb([(bits.wrapping_mul(2_246_822_519) >> 26) as u8 + if (300..500).contains(&x) { 100 } else { 0 }; 3])
        });
        let [whole, windowed] = [usize::MAX, 1000]
            .map(|max| GradientField::with_windows_from(&image, &GradientConfig::DEFAULT, max).level(0).floor());
        assert!((windowed / whole - 1.0).abs() < 0.05, "{windowed} and {whole}");
    }
}
