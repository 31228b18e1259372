//! A part whose outline was detected by a camera. It is shown in pictures of plans and has no collisions.

use nalgebra::{Isometry3, Point2};

use crate::fragment::MjcfFragment;
use crate::shapes::solids::extrude;

/// Minimum thickness, m, so that the part is visible.
const MIN_HEIGHT_M: f64 = 2e-3;
/// Minimum area of an outline that is rendered, m².
const MIN_AREA_M2: f64 = 1e-6;

/// A part as a camera detected it.
#[derive(Debug, Clone, PartialEq)]
pub struct SeenPart {
    /// The outline in the robot's base frame, m, clockwise or counter-clockwise.
    pub outline_in_base: Vec<Point2<f64>>,
    /// z of the surface under the part, and z of the part's outline, both in the base frame, m.
    pub z_m: [f64; 2],
}

impl SeenPart {
    /// The extruded outline, in orange.
    pub(crate) fn fragment(&self) -> MjcfFragment {
        let mut fragment = MjcfFragment::default();
        let [bottom_m, top_m] = self.z_m;
        let mut outline = self.outline_in_base.clone();
        let area_m2 = signed_area(&outline);
        if area_m2.is_nan() || area_m2.abs() < MIN_AREA_M2 {
            return fragment;
        }
        if area_m2 < 0.0 {
            outline.reverse();
        }
        let mesh = extrude(&outline, &[], (top_m - bottom_m).max(MIN_HEIGHT_M), 0.0)
            .transformed(&Isometry3::translation(0.0, 0.0, bottom_m));
        fragment.add_mesh("seen_part", &mesh);
        fragment.write(format_args!(
            "<worldbody><geom name=\"seen_part\" type=\"mesh\" mesh=\"seen_part\" contype=\"0\" conaffinity=\"0\" \
             rgba=\"0.95 0.45 0.1 1\"/></worldbody>"
        ));
        fragment
    }
}

/// Positive for vertices in counter-clockwise order.
fn signed_area(outline: &[Point2<f64>]) -> f64 {
    let following = outline.iter().cycle().skip(1);
    outline.iter().zip(following).map(|(a, b)| 0.5 * (a.x * b.y - a.y * b.x)).sum()
}
