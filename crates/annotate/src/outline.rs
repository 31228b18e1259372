//! An outline proposed from a box, or corrected, with strokes.

use image::RgbImage;
use sdg_demonstration::{OutlineStroke, correct_outline, propose_outline_with};
use sdg_geometry::{BoundingBox, Polygon};

/// Proposes the outline of the object in the box, or corrects the `known` one; `None` if nothing in the box differs
/// from its surroundings.
pub fn propose(
    image: &RgbImage,
    bbox: &BoundingBox,
    known: Option<&Polygon>,
    strokes: &[OutlineStroke],
) -> Option<Polygon> {
    let outline = match known {
        Some(known) => correct_outline(image, bbox, known, strokes),
        None => propose_outline_with(image, bbox, strokes),
    };
    let whole_box = Polygon::from_box(&bbox.clip(f64::from(image.width()), f64::from(image.height())));
    // An outline equal to the box means that nothing was found.
    (outline != whole_box).then_some(outline)
}
