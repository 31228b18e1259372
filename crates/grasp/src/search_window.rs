//! The window of an image that is cut out to search a region of it.
//!
//! ```text
//! picture ─ region ─ region and a margin, cut out ─ searched ─ detections in pixels of the picture ─ those that lie in the region
//! ```
//! The margin is half the part's length, so that parts with half of their area in the region are usually complete in
//! the window. Pixels outside the window are not read.

use image::RgbImage;
use nalgebra::Point2;
use sdg_geometry::{BoundingBox, PlanarSimilarity, Polygon, convex_hull};

use crate::detection::Found;
use crate::error::{GraspError, Result};
use crate::region::{RegionError, SearchRegion};
use crate::sizes::SizeRange;
use crate::taught::TaughtDemonstration;
use crate::verification::Shot;
use sdg_shape::PixelRect;

/// Margin of the window around the region, in lengths of the part. A part of constant width with half of its area in
/// the region extends no farther beyond the region.
const MARGIN: f64 = 0.5;
/// Additional margin in pixels, for the smoothing of the gradients. Chosen by hand.
const BORDER_PX: f64 = 4.0;
/// Window corners are at multiples of this many pixels of the halved picture. The pyramid levels that are read then
/// have the same pixels as those of the whole picture.
const GRID_PX: u32 = 8;

/// Whether a region can be searched, as far as is known without a picture: it has pixels and, if the size of its
/// pictures is given, lies within them and is large enough for the demonstrations' part.
///
/// # Errors
/// As for [`SearchRegion::check`], and a region that is too small for the part.
pub(crate) fn check_region(region: &SearchRegion, demonstrations: Option<&Vec<TaughtDemonstration>>) -> Result<()> {
    let Some(picture) = region.picture else { return Ok(region.check_pixels()?) };
    region.check(picture)?;
    if let Some(demonstrations) = demonstrations {
        SearchWindow::about(&region.bounds(), region, picture, demonstrations)?;
    }
    Ok(())
}

/// The window of an image, and the size of the whole image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SearchWindow {
    pub(crate) rect: PixelRect,
    whole: [u32; 2],
}

impl SearchWindow {
    /// The whole image as a window.
    pub(crate) fn whole([width, height]: [u32; 2]) -> Self {
        Self { rect: PixelRect { left: 0, top: 0, width, height }, whole: [width, height] }
    }

    /// The window of this width and height in the middle of an image of size `whole`.
    pub(crate) fn middle_of(whole: [u32; 2], [width, height]: [u32; 2]) -> Self {
        let from = |whole: u32, side: u32| whole.saturating_sub(side) / 2;
        let rect = PixelRect { left: from(whole[0], width), top: from(whole[1], height), width, height };
        Self { rect, whole }
    }

    /// The window of an image of size `whole` that contains everything needed to evaluate parts in `bounds`, in pixels
    /// of the image; `region` is the region given by the user.
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

    /// The pixels of the window.
    pub(crate) fn cut(&self, image: &RgbImage) -> RgbImage {
        let PixelRect { left, top, width, height } = self.rect;
        let [left, width, stride] = [left, width, image.width()].map(|columns| 3 * columns as usize);
        let rows = image.as_raw().chunks_exact(stride.max(1)).skip(top as usize).take(height as usize);
        let mut pixels = Vec::with_capacity(width * height as usize);
        rows.for_each(|row| pixels.extend_from_slice(&row[left..left + width]));
        RgbImage::from_raw(self.rect.width, height, pixels).unwrap_or_default()
    }

    /// The shot of the window by a level camera.
    pub(crate) fn shot(&self) -> Shot {
        let middle = |whole: u32, from: u32| 0.5 * f64::from(whole) - f64::from(from);
        let [width, height] = self.whole;
        Shot::level_at(self.whole, Point2::new(middle(width, self.rect.left), middle(height, self.rect.top)))
    }

    /// Maps pixels of the window to those of the whole image.
    pub(crate) fn whole_from_window(&self) -> PlanarSimilarity {
        PlanarSimilarity::translation(f64::from(self.rect.left), f64::from(self.rect.top))
    }

    /// Whether a point of the whole image lies in the window.
    pub(crate) fn contains(&self, point: &Point2<f64>) -> bool {
        let PixelRect { left, top, width, height } = self.rect;
        let is_in = |at: f64, from: u32, side: u32| (0.0..f64::from(side)).contains(&(at - f64::from(from)));
        is_in(point.x, left, width) && is_in(point.y, top, height)
    }

    /// Moves a detection of the window to pixels of the whole image.
    pub(crate) fn in_whole(&self, found: &mut Found) {
        moved(found, &self.whole_from_window(), self.whole);
    }

    /// Moves a detection back to pixels of the window.
    pub(crate) fn in_window(&self, found: &mut Found) {
        let PlanarSimilarity { tx, ty, .. } = self.whole_from_window();
        moved(found, &PlanarSimilarity::translation(-tx, -ty), [self.rect.width, self.rect.height]);
    }
}

/// Shifts a detection into an image of this width and height.
fn moved(found: &mut Found, shift: &PlanarSimilarity, size: [u32; 2]) {
    let &PlanarSimilarity { tx, ty, .. } = shift;
    let Found { detection, placement } = found;
    if (tx, ty) != (0.0, 0.0) {
        let BoundingBox { x1, y1, x2, y2 } = detection.bbox;
        detection.bbox = BoundingBox { x1: x1 + tx, y1: y1 + ty, x2: x2 + tx, y2: y2 + ty };
        detection.keypoints.iter_mut().for_each(|(point, _)| *point = shift.apply(point));
        detection.outline = detection.outline.as_ref().map(|outline| outline.transformed(shift));
        detection.grasp.x += tx;
        detection.grasp.y += ty;
        if let Some(placement) = placement {
            placement.image_from_cutout = shift.compose(&placement.image_from_cutout);
            placement.image_from_marks = shift.compose(&placement.image_from_marks);
        }
    }
    let [width, height] = size.map(f64::from);
    detection.bbox = detection.bbox.clip(width, height);
}

/// Length and width of a polygon: the largest distance between two points, and the smallest distance between two
/// parallel lines that enclose the polygon.
pub(crate) fn extents(polygon: &Polygon) -> [f64; 2] {
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

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_geometry::Angle;

    #[test]
    fn extents_by_hand() {
        // 3 × 4 rotated by 30°: the diagonal, and the shorter side.
        let turn = PlanarSimilarity { angle: Angle::from_degrees(30.0), ..PlanarSimilarity::IDENTITY };
        let rectangle = Polygon::from_box(&BoundingBox { x1: 0.0, y1: 0.0, x2: 3.0, y2: 4.0 }).transformed(&turn);
        let [length, across] = extents(&rectangle);
        assert!((length - 5.0).abs() < 1e-9 && (across - 3.0).abs() < 1e-9, "{length} {across}");
    }
}
