//! Pictures as four floats per pixel, for reading warps and painting scenes.

use image::RgbImage;

/// Red, green, blue in `[0, 1]` as displayed (not linear light); the meaning of the fourth float depends on the caller.
///
/// Four floats are one SIMD register, so that a bilinear look-up is four loads.
#[derive(Debug, Clone)]
pub(crate) struct Raster {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<[f32; 4]>,
    /// Width of the whole frame of which this may be a window: the reference for sizes in pixels.
    pub frame_width: usize,
}

impl Raster {
    pub fn filled(width: usize, height: usize, pixel: [f32; 4]) -> Self {
        Self { width, height, pixels: vec![pixel; width * height], frame_width: width }
    }

    pub fn from_image(image: &RgbImage) -> Self {
        let pixels = image.pixels().map(|p| [p[0], p[1], p[2]].map(|v| f32::from(v) / 255.0));
        Self {
            width: image.width() as usize,
            height: image.height() as usize,
            pixels: pixels.map(|[r, g, b]| [r, g, b, 0.0]).collect(),
            frame_width: image.width() as usize,
        }
    }

    /// Bilinear at (x, y) with the first pixel's centre at (0.5, 0.5); outside, border pixels are repeated.
    ///
    /// Reads four floats at once, without a branch. The sampling of `sdg-shape` reads bytes of an image instead.
    #[inline(always)]
    pub fn bilinear(&self, x: f32, y: f32) -> [f32; 4] {
        let u = (x - 0.5).clamp(0.0, (self.width - 1) as f32);
        let v = (y - 0.5).clamp(0.0, (self.height - 1) as f32);
        // Through i32, which a processor converts in one step.
        let (column, row) = (u as i32, v as i32);
        let (fx, fy) = (u - column as f32, v - row as f32);
        let (column, row) = (column as usize, row as usize);
        let right = usize::from(column + 1 < self.width);
        let below = if row + 1 < self.height { self.width } else { 0 };
        let at = row * self.width + column;
        let upper = &self.pixels[at..at + right + 1];
        let lower = &self.pixels[at + below..at + below + right + 1];
        let (a, b, c, d) = (&upper[0], &upper[right], &lower[0], &lower[right]);
        let mut out = [0.0; 4];
        for k in 0..4 {
            let top = a[k] + (b[k] - a[k]) * fx;
            let bottom = c[k] + (d[k] - c[k]) * fx;
            out[k] = top + (bottom - top) * fy;
        }
        out
    }

    /// The pixel that contains (x, y); outside, border pixels are repeated.
    #[inline(always)]
    pub fn nearest(&self, x: f32, y: f32) -> [f32; 4] {
        let column = (x.max(0.0) as i32 as usize).min(self.width - 1);
        let row = (y.max(0.0) as i32 as usize).min(self.height - 1);
        self.pixels[row * self.width + column]
    }

    /// Bilinear with the picture mirrored repeatedly at its borders.
    #[inline(always)]
    pub fn reflected(&self, x: f32, y: f32) -> [f32; 4] {
        self.bilinear(reflect(x, self.width as f32), reflect(y, self.height as f32))
    }
}

/// Folds `x` into `[0, length]`.
#[inline(always)]
fn reflect(x: f32, length: f32) -> f32 {
    if (0.0..=length).contains(&x) {
        return x;
    }
    let folded = x.rem_euclid(2.0 * length);
    if folded > length { 2.0 * length - folded } else { folded }
}

/// The largest whole number not above `x`, for positions on a picture: without the library call of `f32::floor` on
/// processors whose newer instructions cannot be assumed.
#[inline(always)]
pub(crate) fn floor(x: f32) -> i32 {
    let towards_zero = x as i32;
    towards_zero - i32::from(towards_zero as f32 > x)
}

/// Whole pixels `[x1, x2) × [y1, y2)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PixelRect {
    pub x1: usize,
    pub y1: usize,
    pub x2: usize,
    pub y2: usize,
}

impl PixelRect {
    /// The pixels of a `width` × `height` canvas touched by a box that is enlarged by `margin`.
    pub fn covering(bounds: [f32; 4], margin: f32, width: usize, height: usize) -> Self {
        let [x1, y1, x2, y2] = bounds;
        let low = |v: f32, end: usize| ((v - margin).floor().max(0.0) as usize).min(end);
        let high = |v: f32, end: usize| ((v + margin).ceil().max(0.0) as usize).min(end);
        Self { x1: low(x1, width), y1: low(y1, height), x2: high(x2, width), y2: high(y2, height) }
    }
}

/// 0 below `low`, 1 above `high`, smooth between.
#[inline(always)]
pub(crate) fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Moves the pixel's colour towards `color` by the fraction `alpha`; the fourth float is kept.
#[inline(always)]
pub(crate) fn blend(pixel: &mut [f32; 4], color: [f32; 3], alpha: f32) {
    for k in 0..3 {
        pixel[k] += (color[k] - pixel[k]) * alpha;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bilinear_is_exact_at_centres_and_halfway() {
        let image = RgbImage::from_fn(3, 2, |x, y| image::Rgb([(x * 100) as u8, (y * 50) as u8, 0]));
        let raster = Raster::from_image(&image);
        assert_eq!(raster.bilinear(1.5, 0.5)[0], 100.0 / 255.0);
        let halfway = raster.bilinear(1.0, 1.0);
        assert!((halfway[0] * 255.0 - 50.0).abs() < 1e-4 && (halfway[1] * 255.0 - 25.0).abs() < 1e-4);
        assert_eq!(raster.bilinear(-9.0, 0.5)[0], 0.0);
        assert!((raster.reflected(-0.5, 0.5)[0] - raster.bilinear(0.5, 0.5)[0]).abs() < 1e-6);
        assert!((raster.reflected(4.5, 0.5)[0] - raster.bilinear(1.5, 0.5)[0]).abs() < 1e-6);
    }

    #[test]
    fn floor_goes_down_on_both_sides_of_zero() {
        for x in [-3.0f32, -2.5, -1e-9, -0.0, 0.0, 0.99, 7.0, 12_345.6] {
            assert_eq!(floor(x) as f32, x.floor(), "{x}");
        }
    }

    #[test]
    fn covering_stays_on_the_canvas() {
        let rect = PixelRect::covering([-3.0, 2.5, 4.2, 99.0], 1.0, 10, 8);
        assert_eq!(rect, PixelRect { x1: 0, y1: 1, x2: 6, y2: 8 });
        let away = PixelRect::covering([50.0, 2.0, 60.0, 3.0], 0.0, 10, 8);
        assert_eq!(away.x1, away.x2);
    }
}
