//! The part of a picture that is searched.
//!
//! ```text
//! picture ─ region ─ region and a margin, cut out ─ searched ─ detections in pixels of the picture ─ those that lie in the region
//! ```
//! A part lies in the region where its grasp point does and at least half of its area. It is judged with everything about it,
//! though it reaches out of the region: the margin is half the part's length. What lies further out is not read.

use std::fmt;

use image::{RgbImage, imageops};
use nalgebra::Point2;
use sdg_geometry::{BoundingBox, PlanarSimilarity, Polygon, convex_hull};
use serde::{Deserialize, Serialize};

use crate::detection::{Found, GraspDetection};
use crate::error::{GraspError, Result};
use crate::resampled::PixelRect;
use crate::sizes::SizeRange;
use crate::taught::TaughtDemonstration;
use crate::verification::Shot;

#[cfg(all(test, feature = "teach"))]
mod tests;

/// A part counts with at least this share of its area in the region: with less, most of it lies elsewhere. Chosen by hand.
const MIN_SHARE: f64 = 0.5;
/// What is cut out about the region, in lengths of the part: how far a part reaches out of which half lies in the region.
const MARGIN: f64 = 0.5;
/// Pixels beyond that, for the gradients' smoothing. Chosen by hand.
const BORDER_PX: f64 = 4.0;
/// Corners of what is cut out lie at multiples of so many pixels of the halved picture, so that all levels of its pyramid have the pixels
/// that the whole picture's have.
const GRID_PX: u32 = 8;

/// A rectangle of a picture, of whole pixels: only parts in it are looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct SearchRegion {
    /// Left edge.
    pub x: u32,
    /// Upper edge.
    pub y: u32,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Width and height of the pictures for which it was given; `None` for pictures of any size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub picture: Option<[u32; 2]>,
}

/// Why a region cannot be searched.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum RegionError {
    /// No pixel.
    #[error("expected a region of at least 1 × 1 pixels, found {region}")]
    Empty { region: SearchRegion },
    /// It reaches out of the picture.
    #[error("expected a region within the picture of {width} × {height} pixels, found {region}")]
    Outside { region: SearchRegion, width: u32, height: u32 },
    /// A picture of another size.
    #[error(
        "expected a picture of {expected_width} × {expected_height} pixels, for which the region was given, found {width} × {height}"
    )]
    OtherPicture { expected_width: u32, expected_height: u32, width: u32, height: u32 },
    /// It shows nothing of the plane of the marks.
    #[error("expected a region that shows the table where parts may lie, found {region}, which does not")]
    OffTable { region: SearchRegion },
    /// The part does not fit in.
    #[error(
        "expected a region that the part fits in, which is at least {length:.0} × {across:.0} pixels there, found {region}: \
         make it larger"
    )]
    SmallerThanPart { region: SearchRegion, length: f64, across: f64 },
}

impl fmt::Display for SearchRegion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} × {} pixels from ({}, {})", self.width, self.height, self.x, self.y)
    }
}

impl SearchRegion {
    /// For pictures of any size.
    pub fn new([x, y, width, height]: [u32; 4]) -> Self {
        Self { x, y, width, height, picture: None }
    }

    /// The same for pictures of that width and height alone.
    pub fn of_picture(self, size: [u32; 2]) -> Self {
        Self { picture: Some(size), ..self }
    }

    /// Its left, upper, right and lower edge.
    pub fn bounds(&self) -> BoundingBox {
        let [x1, y1, width, height] = [self.x, self.y, self.width, self.height].map(f64::from);
        BoundingBox { x1, y1, x2: x1 + width, y2: y1 + height }
    }

    /// Whether it lies in a picture of this width and height, and is for it.
    ///
    /// # Errors
    /// A region without pixels, one that reaches out of the picture, one that was given for pictures of another size.
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

    fn check_pixels(&self) -> std::result::Result<(), RegionError> {
        if self.width == 0 || self.height == 0 { Err(RegionError::Empty { region: *self }) } else { Ok(()) }
    }

    /// Whether a part lies in it: its grasp point, and at least half of its outline's area.
    pub fn has(&self, detection: &GraspDetection) -> bool {
        let center = detection.grasp.center();
        let BoundingBox { x1, y1, x2, y2 } = self.bounds();
        // The lower and right edges belong to the next region.
        if !((x1..x2).contains(&center.x) && (y1..y2).contains(&center.y)) {
            return false;
        }
        let outline = detection.outline.clone().unwrap_or_else(|| Polygon::from_box(&detection.bbox));
        let from_region = PlanarSimilarity { tx: -x1, ty: -y1, ..PlanarSimilarity::IDENTITY };
        let inside = outline.transformed(&from_region).clip(x2 - x1, y2 - y1);
        inside.area() >= MIN_SHARE * outline.area()
    }
}

/// Whether a region can be searched, as far as that is known without a picture: for pixels, and where it says what pictures it is for,
/// whether it lies in them and the part of demonstrations fits in.
///
/// # Errors
/// As [`SearchRegion::check`], and a region that the part does not fit in.
pub(crate) fn check_region(region: &SearchRegion, demonstrations: Option<&Vec<TaughtDemonstration>>) -> Result<()> {
    let Some(picture) = region.picture else { return Ok(region.check_pixels()?) };
    region.check(picture)?;
    if let Some(demonstrations) = demonstrations {
        SearchWindow::about(&region.bounds(), region, picture, demonstrations)?;
    }
    Ok(())
}

/// The part of an image that is cut out, and the size of the whole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SearchWindow {
    pub(crate) rect: PixelRect,
    whole: [u32; 2],
}

impl SearchWindow {
    /// The image itself.
    pub(crate) fn whole([width, height]: [u32; 2]) -> Self {
        Self { rect: PixelRect { left: 0, top: 0, width, height }, whole: [width, height] }
    }

    /// What is to be seen of an image of size `whole` so that parts in `bounds`, in its pixels, are judged with all that is about them;
    /// `region` is what the user gave.
    ///
    /// # Errors
    /// [`RegionError::SmallerThanPart`].
    pub(crate) fn about(
        bounds: &BoundingBox,
        region: &SearchRegion,
        whole: [u32; 2],
        demonstrations: &[TaughtDemonstration],
    ) -> Result<Self> {
        let (mut margin, mut shrink) = (0.0f64, 1.0f64);
        let mut least = [f64::INFINITY; 2];
        for demonstration in demonstrations {
            let own = extents(&demonstration.marks.region());
            for range in SizeRange::all(demonstration.marks.photo_size, whole, &demonstration.check().search.scales) {
                margin = margin.max(MARGIN * own[0] * range.scales.end());
                shrink = shrink.max(demonstration.working(&range).shrink());
                (0..2).for_each(|k| least[k] = least[k].min(own[k] * range.scales.start()));
            }
        }
        let (width, height) = (bounds.width(), bounds.height());
        if width.hypot(height) < least[0] || width.min(height) < least[1] {
            let [length, across] = least;
            return Err(GraspError::Region(RegionError::SmallerThanPart { region: *region, length, across }));
        }
        let margin = margin + BORDER_PX * shrink;
        let grid = GRID_PX * shrink as u32;
        let span = |low: f64, high: f64, side: u32| {
            let from = ((low - margin).max(0.0) as u32).min(side - 1) / grid * grid;
            let to = ((high + margin).max(0.0).ceil() as u32).div_ceil(grid).saturating_mul(grid).min(side);
            (from, to.max(from + 1) - from)
        };
        let (left, width) = span(bounds.x1, bounds.x2, whole[0]);
        let (top, height) = span(bounds.y1, bounds.y2, whole[1]);
        Ok(Self { rect: PixelRect { left, top, width, height }, whole })
    }

    /// These pixels of an image.
    pub(crate) fn cut(&self, image: &RgbImage) -> RgbImage {
        let PixelRect { left, top, width, height } = self.rect;
        imageops::crop_imm(image, left, top, width, height).to_image()
    }

    /// How what is cut out was taken by a level camera.
    pub(crate) fn shot(&self) -> Shot {
        let middle = |whole: u32, from: u32| 0.5 * f64::from(whole) - f64::from(from);
        let [width, height] = self.whole;
        Shot {
            size: self.whole,
            below_camera: Point2::new(middle(width, self.rect.left), middle(height, self.rect.top)),
        }
    }

    /// Moves from its pixels to those of the whole.
    pub(crate) fn whole_from_window(&self) -> PlanarSimilarity {
        let (tx, ty) = (f64::from(self.rect.left), f64::from(self.rect.top));
        PlanarSimilarity { tx, ty, ..PlanarSimilarity::IDENTITY }
    }

    /// What was found in it, in pixels of the whole.
    pub(crate) fn in_whole(&self, found: &mut Found) {
        let shift = self.whole_from_window();
        let PlanarSimilarity { tx, ty, .. } = shift;
        let Found { detection, placement } = found;
        if (tx, ty) != (0.0, 0.0) {
            let BoundingBox { x1, y1, x2, y2 } = detection.bbox;
            detection.bbox = BoundingBox { x1: x1 + tx, y1: y1 + ty, x2: x2 + tx, y2: y2 + ty };
            detection.keypoints.iter_mut().for_each(|(point, _)| *point = shift.apply(point));
            detection.outline = detection.outline.as_ref().map(|outline| outline.transformed(&shift));
            detection.grasp.x += tx;
            detection.grasp.y += ty;
            if let Some(placement) = placement {
                placement.image_from_cutout = shift.compose(&placement.image_from_cutout);
                placement.image_from_marks = shift.compose(&placement.image_from_marks);
            }
        }
        let [width, height] = self.whole.map(f64::from);
        detection.bbox = detection.bbox.clip(width, height);
    }
}

/// Length and width of a polygon: its longest distance, and that between the two parallel lines nearest to each other that it fits between.
fn extents(polygon: &Polygon) -> [f64; 2] {
    let hull = convex_hull(polygon.vertices.iter().copied());
    let distances = hull.iter().flat_map(|a| hull.iter().map(move |b| (b - a).norm()));
    let length = distances.fold(0.0, f64::max);
    let between = (0..hull.len()).filter_map(|i| {
        let (from, to) = (hull[i], hull[(i + 1) % hull.len()]);
        let along = (to - from).try_normalize(f64::EPSILON)?;
        Some(hull.iter().map(|point| along.perp(&(point - from)).abs()).fold(0.0, f64::max))
    });
    [length, between.fold(length, f64::min)]
}
