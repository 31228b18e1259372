//! Whether two boxes or outlines in one picture are the same part's.

use sdg_geometry::Polygon;

/// Boxes that overlap so much are taken for the same part's. Chosen by hand, not measured.
pub(crate) const SAME_PART_IOU: f64 = 0.5;
/// Outlines of which one lies so far in the other are the same part's: parts do not lie in each other. Chosen by hand.
const SAME_PART_SHARE: f64 = 0.3;

/// Whether one outline lies in the other so far that both are the same part's.
pub(crate) fn are_outlines_of_same_part(one: &Polygon, other: &Polygon) -> bool {
    one.bounds().intersection(&other.bounds()) > 0.0
        && one.share_inside(other).max(other.share_inside(one)) > SAME_PART_SHARE
}
