//! Whether two boxes or outlines in one picture belong to the same part.

use sdg_geometry::Polygon;

/// Minimum overlap of two boxes of the same part. Chosen by hand, not measured.
pub(crate) const SAME_PART_IOU: f64 = 0.5;
/// Minimum fraction of an outline inside another outline of the same part; outlines of different parts do not overlap.
/// Chosen by hand.
const SAME_PART_SHARE: f64 = 0.3;

/// Whether one outline lies far enough inside the other to belong to the same part.
pub(crate) fn are_outlines_of_same_part(one: &Polygon, other: &Polygon) -> bool {
    one.bounds().intersection(&other.bounds()) > 0.0
        && one.share_inside(other).max(other.share_inside(one)) > SAME_PART_SHARE
}
