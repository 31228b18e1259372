//! The brightness of a picture: smoothing, halving and sampling.

use image::GrayImage;
use nalgebra::Point2;

/// Brightness from 0 to 255, row by row.
#[derive(Debug, Clone)]
pub(super) struct Luminance {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<f32>,
}

impl Luminance {
    pub(super) fn of(picture: &GrayImage) -> Self {
        let (width, height) = picture.dimensions();
        let values = picture.as_raw().iter().map(|value| f32::from(*value)).collect();
        Self { width: width as usize, height: height as usize, values }
    }

    pub(super) fn longer_side(&self) -> u32 {
        self.width.max(self.height) as u32
    }

    /// Whether a halved picture has a pixel.
    pub(super) fn can_be_halved(&self) -> bool {
        self.width.min(self.height) >= 2
    }

    /// The value of a pixel.
    pub(super) fn at(&self, x: usize, y: usize) -> f32 {
        self.values[y * self.width + x]
    }

    /// Bilinear interpolation; the first pixel's centre is at (0.5, 0.5). `None` outside the picture.
    pub(super) fn sample(&self, place: &Point2<f64>) -> Option<f64> {
        let (width, height) = (self.width as f64, self.height as f64);
        if !((0.0..width).contains(&place.x) && (0.0..height).contains(&place.y)) {
            return None;
        }
        let [x, y] = [(place.x - 0.5).clamp(0.0, width - 1.0), (place.y - 0.5).clamp(0.0, height - 1.0)];
        let [left, top] = [x as usize, y as usize];
        let [right, bottom] = [(left + 1).min(self.width - 1), (top + 1).min(self.height - 1)];
        let [u, v] = [x - left as f64, y - top as f64];
        let at = |x, y| f64::from(self.at(x, y));
        let upper = at(left, top) * (1.0 - u) + at(right, top) * u;
        let lower = at(left, bottom) * (1.0 - u) + at(right, bottom) * u;
        Some(upper * (1.0 - v) + lower * v)
    }

    /// The mean of each two by two pixels; positions in pixels are halved exactly.
    pub(super) fn halved(&self) -> Self {
        let [width, height] = [self.width / 2, self.height / 2];
        let mut values = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let [x, y] = [2 * x, 2 * y];
                values.push(0.25 * (self.at(x, y) + self.at(x + 1, y) + self.at(x, y + 1) + self.at(x + 1, y + 1)));
            }
        }
        Self { width, height, values }
    }

    /// Smoothed by a Gaussian; at the border the outermost pixel is repeated.
    pub(super) fn smoothed(&self, sigma: f64) -> Self {
        let radius = (3.0 * sigma).ceil() as isize;
        let weights: Vec<f64> = (-radius..=radius).map(|k| (-0.5 * (k as f64 / sigma).powi(2)).exp()).collect();
        let total: f64 = weights.iter().sum();
        let kernel: Vec<f32> = weights.iter().map(|weight| (weight / total) as f32).collect();
        let (width, height) = (self.width, self.height);
        let mut rows = vec![0.0; width * height];
        for (row, out) in self.values.chunks_exact(width).zip(rows.chunks_exact_mut(width)) {
            for (k, weight) in kernel.iter().enumerate() {
                let shift = k as isize - radius;
                for (x, out) in out.iter_mut().enumerate() {
                    let from = (x as isize + shift).clamp(0, width as isize - 1) as usize;
                    *out += weight * row[from];
                }
            }
        }
        let mut values = vec![0.0; width * height];
        for (y, out) in values.chunks_exact_mut(width).enumerate() {
            for (k, weight) in kernel.iter().enumerate() {
                let from = (y as isize + k as isize - radius).clamp(0, height as isize - 1) as usize;
                for (out, value) in out.iter_mut().zip(&rows[from * width..(from + 1) * width]) {
                    *out += weight * value;
                }
            }
        }
        Self { width, height, values }
    }
}
