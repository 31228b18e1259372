//! The searched region in JSON.

use sdg_grasp::SearchRegion;
use serde::Serialize;

/// The searched region of the picture, in pixels.
#[derive(Serialize)]
pub struct RegionRecord {
    x: u32,
    y: u32,
    width: u32,
    height: u32,
}

impl RegionRecord {
    pub fn of(region: &SearchRegion) -> Self {
        let SearchRegion { x, y, width, height, .. } = *region;
        Self { x, y, width, height }
    }
}
