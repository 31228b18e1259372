//! An outline proposed from a box and strokes.

use image::RgbImage;
use sdg_demonstration::{OutlineStroke, propose_outline_with};
use sdg_geometry::{BoundingBox, Polygon};

/// Proposes the outline of what the box holds; `None` where nothing in it stands out from what is around.
pub fn propose(image: &RgbImage, bbox: &BoundingBox, strokes: &[OutlineStroke]) -> Option<Polygon> {
    let outline = propose_outline_with(image, bbox, strokes);
    let whole_box = Polygon::from_box(&bbox.clip(f64::from(image.width()), f64::from(image.height())));
    // The box itself is the proposal of one who has found nothing.
    (outline != whole_box).then_some(outline)
}
