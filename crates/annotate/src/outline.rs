//! An outline proposed from a box.

use image::RgbImage;
use sdg_geometry::{BoundingBox, Polygon};

/// Proposes the outline of what the box holds; `None` where nothing in it stands out from what is around.
pub fn propose(_image: &RgbImage, _bbox: &BoundingBox) -> Option<Polygon> {
    None
}
