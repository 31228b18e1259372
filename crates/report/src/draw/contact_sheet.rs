//! Arranges many small pictures in one picture.

use image::RgbImage;
use image::imageops::{self, FilterType};

/// Space between pictures and around the sheet, in pixels.
const GAP_PX: u32 = 6;
const GROUND: image::Rgb<u8> = image::Rgb([28, 30, 34]);

/// Arranges pictures in rows of cells. A cell is `cell_width` wide, has the proportions of the first picture that is
/// not empty, and is at most four times as high as wide.
///
/// Each picture is scaled to fit its cell, and centred in it. On a page, use a gallery of separate pictures, which
/// adapts to the screen's width; a sheet is a single file. Without pictures, it is one empty pixel.
///
/// # Panics
/// If `columns` or `cell_width` is zero.
#[must_use]
pub fn contact_sheet(images: &[RgbImage], columns: u32, cell_width: u32) -> RgbImage {
    assert!(columns > 0 && cell_width > 0, "a sheet has columns of some width");
    let Some(first) = images.iter().find(|image| image.width() > 0 && image.height() > 0) else {
        return RgbImage::from_pixel(1, 1, GROUND);
    };
    let ratio = f64::from(first.height()) / f64::from(first.width());
    let cell_height = ((f64::from(cell_width) * ratio).round() as u32).clamp(1, 4 * cell_width);
    let columns = columns.min(images.len() as u32);
    let rows = (images.len() as u32).div_ceil(columns);
    let mut sheet =
        RgbImage::from_pixel(GAP_PX + columns * (cell_width + GAP_PX), GAP_PX + rows * (cell_height + GAP_PX), GROUND);
    for (image, order) in images.iter().zip(0u32..) {
        if image.width() == 0 || image.height() == 0 {
            continue;
        }
        let scale =
            (f64::from(cell_width) / f64::from(image.width())).min(f64::from(cell_height) / f64::from(image.height()));
        let scaled = |side: u32, limit: u32| ((f64::from(side) * scale).round() as u32).clamp(1, limit);
        let (width, height) = (scaled(image.width(), cell_width), scaled(image.height(), cell_height));
        let small = imageops::resize(image, width, height, FilterType::Triangle);
        let left = GAP_PX + (order % columns) * (cell_width + GAP_PX) + (cell_width - width) / 2;
        let top = GAP_PX + (order / columns) * (cell_height + GAP_PX) + (cell_height - height) / 2;
        imageops::replace(&mut sheet, &small, i64::from(left), i64::from(top));
    }
    sheet
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    #[test]
    fn pictures_stand_in_reading_order() {
        let shade = |value| RgbImage::from_pixel(40, 20, Rgb([value; 3]));
        let sheet = contact_sheet(&[shade(100), shade(150), shade(200)], 2, 20);
        // Cells of 20 by 10 and gaps of 6: 6 + 26 + 26 wide, 6 + 16 + 16 high.
        assert_eq!(sheet.dimensions(), (58, 38));
        assert_eq!(sheet.get_pixel(16, 11).0, [100; 3]);
        assert_eq!(sheet.get_pixel(42, 11).0, [150; 3]);
        assert_eq!(sheet.get_pixel(16, 27).0, [200; 3]);
        assert_eq!(*sheet.get_pixel(42, 27), GROUND);
    }

    #[test]
    fn another_proportion_is_centred_and_nothing_is_an_empty_sheet() {
        let wide = RgbImage::from_pixel(40, 20, Rgb([90; 3]));
        let tall = RgbImage::from_pixel(10, 40, Rgb([180; 3]));
        let sheet = contact_sheet(&[wide, tall], 2, 20);
        assert_eq!(sheet.get_pixel(42, 11).0, [180; 3]);
        assert_eq!(*sheet.get_pixel(34, 11), GROUND);
        assert_eq!(contact_sheet(&[], 3, 20).dimensions(), (1, 1));
    }
}
