//! An outline proposed from a box and strokes.

use image::RgbImage;
use sdg_demonstration::{OutlineStroke, propose_outline_with};
use sdg_geometry::{BoundingBox, Polygon};

/// Proposes the outline of the object in the box; `None` if nothing in it differs from its surroundings.
pub fn propose(image: &RgbImage, bbox: &BoundingBox, strokes: &[OutlineStroke]) -> Option<Polygon> {
    let outline = propose_outline_with(image, bbox, strokes);
    let whole_box = Polygon::from_box(&bbox.clip(f64::from(image.width()), f64::from(image.height())));
    // An outline equal to the box means that nothing was found.
    (outline != whole_box).then_some(outline)
}
