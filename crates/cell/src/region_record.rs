//! The searched region in JSON.

use sdg_grasp::SearchRegion;
use serde::Serialize;

/// The searched region of a picture, in pixels.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct RegionRecord {
    /// Left edge.
    pub x: u32,
    /// Upper edge.
    pub y: u32,
    /// Width.
    pub width: u32,
    /// Height.
    pub height: u32,
}

impl RegionRecord {
    /// The record of a region.
    pub fn of(region: &SearchRegion) -> Self {
        let SearchRegion { x, y, width, height, .. } = *region;
        Self { x, y, width, height }
    }
}
