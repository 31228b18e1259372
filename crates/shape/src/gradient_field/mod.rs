//! The gradients of one image, as every template reads them: unsigned directions, on a pyramid.
//!
//! Per level `m` (its pixel is `2^m` image pixels), at each pixel:
//! - `tr`: energy of the gradient, `gx² + gy²` averaged over the three channels and over a 3×3
//!   binomial window, in (grey levels / level pixel)²;
//! - `v = (gx² − gy², 2 gx gy)`, averaged in the same way: the gradient's direction at twice its
//!   angle, so that a gradient equals its negative and neighbours of one direction add up;
//! - `d = v / (tr + floor)`, the stored direction: its length is near 1 on a clean edge, and near 0
//!   where directions are mixed (corners, clutter) or nothing exceeds the noise.
//!
//! Averaging the structure tensor over channels (Di Zenzo, 1986) detects edges between two colours
//! of the same brightness.
//!
//! A level of many pixels is computed only where it is read, window by window ([`windows`]).

mod level;
mod tensors;
mod windows;

use image::RgbImage;
use nalgebra::Point2;

pub(crate) use self::level::{GradientLevel, whole};
use self::tensors::Planes;
use self::windows::Windows;

use crate::config::GradientConfig;

/// Levels are added while both sides have at least this many pixels. Chosen by hand, not measured.
const SMALLEST_LEVEL_SIDE: usize = 24;
/// A pixel of level 6 is 64 image pixels wide; no part needs a coarser level. Derived from the coarsest extent of a
/// template, 32 level pixels: a part of 2048 image pixels.
const MAX_LEVELS: usize = 7;

/// Gradient directions of one image on a pyramid, computed once and read by any number of templates.
///
/// # Shapes
/// Level `m` has `width >> m` by `height >> m` pixels; a point `p` of the image is at `p / 2^m`
/// there.
#[derive(Debug, Clone)]
pub struct GradientField {
    levels: Vec<Level>,
}

#[derive(Debug, Clone)]
enum Level {
    Whole(GradientLevel),
    /// For an image of many pixels, of which a search reads few at the finest level.
    Windows(Box<Windows>),
}

/// Levels of more pixels are computed window by window. Chosen by hand to save time: three megapixels.
const MAX_WHOLE: usize = 3 << 20;

impl GradientField {
    /// Computes the field of `image`. Images of any size are accepted; an empty one has no gradients.
    pub fn new(image: &RgbImage) -> Self {
        Self::with_config(image, &GradientConfig::DEFAULT)
    }

    /// As [`new`](Self::new), with other noise settings.
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

    /// A whole level.
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
            Self::Whole(level) => [level.width(), level.height()],
            Self::Windows(windows) => windows.size(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;
    use wide::f32x4;

    /// Values read from a window equal those of the whole level bit for bit, also at borders.
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

    /// A level of many pixels estimates its noise from some of its rows, other levels from pixels everywhere.
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
