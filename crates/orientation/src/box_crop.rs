//! The network's input: the crop of a detected box.

use image::RgbImage;
use sdg_geometry::BoundingBox;
use sdg_picture::CropWindow;

use crate::error::{OrientationError, Result};

/// The crop of a detected box, as [`OrientationCnn::predict`](crate::OrientationCnn::predict) expects it: `size_px` ×
/// `size_px` pixels of the square around the box's centre.
///
/// # Units and frames
/// `bbox` in pixels of `image`, x right, y down, the centre of the first pixel at (0.5, 0.5); it may extend beyond the
/// image, where the colour is [`OUTSIDE`](sdg_picture::OUTSIDE).
///
/// # Errors
/// An image without pixels, a box without area or not finite, a size of zero.
pub fn crop_for(image: &RgbImage, bbox: &BoundingBox, size_px: u32) -> Result<RgbImage> {
    let (width, height) = image.dimensions();
    if width == 0 || height == 0 {
        return Err(OrientationError::EmptyImage { width, height });
    }
    if size_px == 0 {
        let expected = "at least 1".to_owned();
        return Err(OrientationError::Config { field: "size of the crop", expected, found: "0".to_owned() });
    }
    let &BoundingBox { x1, y1, x2, y2 } = bbox;
    let window = CropWindow::around(bbox).ok_or(OrientationError::BadBox { x1, y1, x2, y2 })?;
    Ok(window.read(image, size_px))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxed(x1: f64, y1: f64, x2: f64, y2: f64) -> BoundingBox {
        BoundingBox { x1, y1, x2, y2 }
    }

    #[test]
    fn boxes_without_sense_are_errors() {
        let image = RgbImage::new(20, 20);
        for bad in [boxed(5.0, 5.0, 5.0, 9.0), boxed(5.0, 5.0, 3.0, 9.0), boxed(f64::NAN, 0.0, 9.0, 9.0)] {
            assert!(matches!(crop_for(&image, &bad, 8), Err(OrientationError::BadBox { .. })), "{bad:?}");
        }
        let good = boxed(1.0, 1.0, 9.0, 9.0);
        assert!(crop_for(&RgbImage::new(0, 5), &good, 8).is_err());
        let error = crop_for(&image, &good, 0).unwrap_err().to_string();
        assert_eq!(error, "orientation CNN: size of the crop must be at least 1, found 0");
    }
}
