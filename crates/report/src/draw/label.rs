//! Draws small tags with text.

use image::RgbImage;
use nalgebra::Point2;
use sdg_geometry::BoundingBox;

use tiny_skia::FillRule;

use super::Color;
use super::font::{DESCENT, text_path, text_width};
use super::paint::{fill, inside_of};

/// Draws a tag with one line of text; `height_px` is the height of its capitals.
///
/// `at` is the tag's lower left corner. A tag that would extend beyond the picture is moved inside as far as it fits,
/// so that a label above a box at the upper edge is readable. The text is dark on light colours and light on dark ones.
pub fn draw_label(image: &mut RgbImage, at: Point2<f64>, text: &str, color: Color, height_px: f64) {
    if !(at.x.is_finite() && at.y.is_finite() && height_px.is_finite() && height_px > 0.0) || text.is_empty() {
        return;
    }
    let padding = padding(height_px);
    let BoundingBox { x1: left, y1: top, x2: right, y2: bottom } = label_bounds(image, at, text, height_px);
    let p = Point2::new;
    let corners = [p(left, top), p(right, top), p(right, bottom), p(left, bottom)];
    if let Some(tag) = inside_of(image, &corners) {
        fill(image, tag, FillRule::Winding, color, 1.0);
    }
    let ink = if color.lightness() > 0.45 { Color([16, 18, 22]) } else { Color([255, 255, 255]) };
    if let Some(letters) = text_path(text, left + padding, top + padding + height_px, height_px) {
        fill(image, letters, FillRule::Winding, ink, 1.0);
    }
}

fn padding(height_px: f64) -> f64 {
    (0.45 * height_px).max(2.0)
}

/// The area of the tag that [`draw_label`] draws; used to keep tags apart.
pub fn label_bounds(image: &RgbImage, at: Point2<f64>, text: &str, height_px: f64) -> BoundingBox {
    let padding = padding(height_px);
    let width = text_width(text, height_px) + 2.0 * padding;
    let height = (1.0 + 0.4 * DESCENT) * height_px + 2.0 * padding;
    let left = at.x.min(f64::from(image.width()) - width).max(0.0);
    let top = (at.y - height).min(f64::from(image.height()) - height).max(0.0);
    BoundingBox { x1: left, y1: top, x2: left + width, y2: top + height }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAPER: Color = Color([255, 255, 255]);

    fn dark_pixels(image: &RgbImage) -> usize {
        image.pixels().filter(|p| p.0.iter().all(|&c| c < 90)).count()
    }

    #[test]
    fn ink_stands_on_the_tag_and_nowhere_else() {
        let mut image = RgbImage::from_pixel(120, 40, image::Rgb([200, 0, 0]));
        draw_label(&mut image, Point2::new(10.0, 30.0), "0.97", PAPER, 10.0);
        let dark = dark_pixels(&image);
        assert!((40..400).contains(&dark), "{dark} dark pixels for four characters");
        assert_eq!(image.get_pixel(11, 29).0, [255, 255, 255], "lower left corner of the tag");
        assert_eq!(image.get_pixel(8, 29).0, [200, 0, 0]);
        assert_eq!(image.get_pixel(11, 31).0, [200, 0, 0]);
    }

    #[test]
    fn a_tag_beyond_an_edge_is_moved_inside() {
        for at in [Point2::new(-50.0, -50.0), Point2::new(500.0, 500.0)] {
            let mut image = RgbImage::from_pixel(120, 40, image::Rgb([200, 0, 0]));
            draw_label(&mut image, at, "0.97", PAPER, 10.0);
            assert!(dark_pixels(&image) > 40, "at {at}");
        }
    }

    #[test]
    fn text_is_light_on_a_dark_tag() {
        let mut image = RgbImage::from_pixel(120, 40, image::Rgb([200, 0, 0]));
        draw_label(&mut image, Point2::new(10.0, 30.0), "0.97", Color([10, 20, 60]), 10.0);
        assert!(image.pixels().any(|p| p.0 == [255, 255, 255]));
    }

    #[test]
    fn a_tag_wider_than_the_picture_is_cut() {
        let mut image = RgbImage::from_pixel(20, 20, image::Rgb([200, 0, 0]));
        draw_label(&mut image, Point2::new(0.0, 20.0), "much too long a text for this", PAPER, 10.0);
        assert!(dark_pixels(&image) > 0);
    }
}
