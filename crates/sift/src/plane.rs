//! One channel of an image in floating point.

use image::{GrayImage, RgbImage};
use sdg_geometry::Mask;

use crate::SiftError;

/// Intensities from 0 (black) to 1 (white), rows from the top.
///
/// Values outside [0, 1] are allowed; the contrast threshold is in the same unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Plane {
    width: usize,
    height: usize,
    data: Vec<f32>,
}

impl Plane {
    /// Makes a plane from intensities, row by row.
    ///
    /// # Errors
    /// A number of intensities other than `width` × `height`, or an intensity that is not
    /// finite.
    pub fn new(width: u32, height: u32, data: Vec<f32>) -> Result<Self, SiftError> {
        let (expected, found) = (u64::from(width) * u64::from(height), data.len() as u64);
        if expected != found {
            return Err(SiftError::WrongLength { width, height, expected, found });
        }
        if let Some(at) = data.iter().position(|value| !value.is_finite()) {
            let (x, y) = ((at % width as usize) as u32, (at / width as usize) as u32);
            return Err(SiftError::NotFinite { x, y, value: data[at] });
        }
        Ok(Self { width: width as usize, height: height as usize, data })
    }

    /// Makes a plane whose pixel (x, y) is `intensity(x, y)`, which must be finite.
    pub fn from_fn(width: u32, height: u32, mut intensity: impl FnMut(u32, u32) -> f32) -> Self {
        let mut data = Vec::with_capacity(width as usize * height as usize);
        for y in 0..height {
            data.extend((0..width).map(|x| intensity(x, y)));
        }
        assert!(data.iter().all(|value| value.is_finite()), "expected finite intensities");
        Self { width: width as usize, height: height as usize, data }
    }

    /// Converts grey levels, divided by 255.
    pub fn from_gray(image: &GrayImage) -> Self {
        let data = image.as_raw().iter().map(|&level| f32::from(level) / 255.0).collect();
        Self { width: image.width() as usize, height: image.height() as usize, data }
    }

    /// Converts a colour image to its luma, rounded to 8 bits, as in most libraries.
    ///
    /// # Source
    /// ITU-R BT.601: 0.299 R + 0.587 G + 0.114 B.
    pub fn from_rgb(image: &RgbImage) -> Self {
        let luma =
            |p: &image::Rgb<u8>| (299 * u32::from(p[0]) + 587 * u32::from(p[1]) + 114 * u32::from(p[2]) + 500) / 1000;
        let data = image.pixels().map(|p| luma(p) as f32 / 255.0).collect();
        Self { width: image.width() as usize, height: image.height() as usize, data }
    }

    /// Converts a mask to a binary image: white inside, black outside.
    pub fn from_mask(mask: &Mask) -> Self {
        Self::from_fn(mask.width(), mask.height(), |x, y| f32::from(u8::from(mask.get(x, y))))
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The intensities, row by row.
    pub fn data(&self) -> &[f32] {
        &self.data
    }

    /// Row `y`. Panics below the image.
    pub fn row(&self, y: usize) -> &[f32] {
        &self.data[y * self.width..(y + 1) * self.width]
    }

    /// The pixel (x, y). Panics outside the image.
    #[inline(always)]
    pub(crate) fn at(&self, x: usize, y: usize) -> f32 {
        self.data[y * self.width + x]
    }

    /// A plane in the memory of an earlier one, because new pages take as much time as a blur. The earlier values
    /// remain until they are overwritten.
    pub(crate) fn recycled(width: usize, height: usize, mut data: Vec<f32>) -> Self {
        data.resize(width * height, 0.0);
        Self { width, height, data }
    }

    pub(crate) fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }

    pub(crate) fn into_data(self) -> Vec<f32> {
        self.data
    }
}

impl From<&GrayImage> for Plane {
    fn from(image: &GrayImage) -> Self {
        Self::from_gray(image)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_data_is_named() {
        let short = Plane::new(2, 2, vec![0.0; 3]).unwrap_err();
        assert_eq!(short.to_string(), "expected 4 intensities for 2 × 2 pixels, found 3");
        let nan = Plane::new(2, 2, vec![0.0, 0.0, f32::NAN, 0.0]).unwrap_err();
        assert_eq!(nan.to_string(), "expected finite intensities, found NaN at pixel (0, 1)");
    }

    #[test]
    fn luma_of_pure_colors() {
        let image = RgbImage::from_raw(3, 1, vec![255, 0, 0, 0, 255, 0, 0, 0, 255]).unwrap();
        let levels: Vec<u8> = Plane::from_rgb(&image).data().iter().map(|v| (v * 255.0).round() as u8).collect();
        assert_eq!(levels, [76, 150, 29]);
    }
}
