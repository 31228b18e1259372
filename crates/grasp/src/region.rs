//! The region of a picture that is searched.
//!
//! A part lies in the region if its grasp point and at least half of its area do. Its surroundings are evaluated even
//! beyond the region (search_window.rs).

use std::fmt;

use nalgebra::Point2;
use sdg_geometry::{BoundingBox, PlanarSimilarity, Polygon};
use serde::{Deserialize, Serialize};

/// Minimum fraction of a part's area in the region. Chosen by hand.
const MIN_SHARE: f64 = 0.5;

/// A rectangle of whole pixels in a picture, to which the search is restricted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct SearchRegion {
    /// Left edge.
    pub x: u32,
    /// Upper edge.
    pub y: u32,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Width and height of the pictures for which the region was given; `None` for pictures of any size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub picture: Option<[u32; 2]>,
}

/// The reason why a region cannot be searched.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages explain the fields")]
pub enum RegionError {
    /// The region has no pixels.
    #[error("expected a region of at least 1 × 1 pixels, found {region}")]
    Empty { region: SearchRegion },
    /// The region extends beyond the picture.
    #[error("expected a region within the picture of {width} × {height} pixels, found {region}")]
    Outside { region: SearchRegion, width: u32, height: u32 },
    /// A picture of another size.
    #[error(
        "expected a picture of {expected_width} × {expected_height} pixels, for which the region was given, found {width} × {height}"
    )]
    OtherPicture { expected_width: u32, expected_height: u32, width: u32, height: u32 },
    /// The region shows nothing of the plane of the marks.
    #[error("expected a region that shows the table where parts may lie, found {region}, which does not")]
    OffTable { region: SearchRegion },
    /// The region is too small for the part.
    #[error(
        "expected a region that the part fits in, which is {} pixels long and {} wide there, found {region}: make it larger",
        length.ceil(),
        across.ceil()
    )]
    SmallerThanPart { region: SearchRegion, length: f64, across: f64 },
}

impl fmt::Display for SearchRegion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} × {} pixels from ({}, {})", self.width, self.height, self.x, self.y)
    }
}

impl SearchRegion {
    /// A region for pictures of any size.
    pub fn new([x, y, width, height]: [u32; 4]) -> Self {
        Self { x, y, width, height, picture: None }
    }

    /// The region for pictures of this width and height only.
    pub fn of_picture(self, size: [u32; 2]) -> Self {
        Self { picture: Some(size), ..self }
    }

    /// The left, upper, right and lower edge.
    pub fn bounds(&self) -> BoundingBox {
        let [x1, y1, width, height] = [self.x, self.y, self.width, self.height].map(f64::from);
        BoundingBox { x1, y1, x2: x1 + width, y2: y1 + height }
    }

    /// Whether the region lies in a picture of this width and height, and is given for such pictures.
    ///
    /// # Errors
    /// A region without pixels, one that extends beyond the picture, one that was given for pictures of another size.
    pub fn check(&self, [width, height]: [u32; 2]) -> std::result::Result<(), RegionError> {
        self.check_pixels()?;
        if let Some([expected_width, expected_height]) = self.picture.filter(|expected| *expected != [width, height]) {
            return Err(RegionError::OtherPicture { expected_width, expected_height, width, height });
        }
        let ends_within = |from: u32, length: u32, side: u32| u64::from(from) + u64::from(length) <= u64::from(side);
        if !ends_within(self.x, self.width, width) || !ends_within(self.y, self.height, height) {
            return Err(RegionError::Outside { region: *self, width, height });
        }
        Ok(())
    }

    pub(crate) fn check_pixels(&self) -> std::result::Result<(), RegionError> {
        if self.width == 0 || self.height == 0 { Err(RegionError::Empty { region: *self }) } else { Ok(()) }
    }

    /// Whether a part lies in the region: its `grasp_point` and at least half of its outline's area do. Both are in
    /// pixels of the picture.
    pub(crate) fn has(&self, grasp_point: &Point2<f64>, outline: &Polygon) -> bool {
        let BoundingBox { x1, y1, x2, y2 } = self.bounds();
        // The lower and right edges belong to the next region.
        if !((x1..x2).contains(&grasp_point.x) && (y1..y2).contains(&grasp_point.y)) {
            return false;
        }
        let from_region = PlanarSimilarity::translation(-x1, -y1);
        let inside = outline.transformed(&from_region).clip(x2 - x1, y2 - y1);
        inside.area() >= MIN_SHARE * outline.area()
    }
}
