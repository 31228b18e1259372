//! The known shape of a part.

use nalgebra::{Isometry3, Point2, Point3};
use sdg_geometry::{Polygon, convex_hull};
use sdg_kinematics::FINGER_HALF_WIDTH_M;

use crate::error::{Result, RobotError};

/// Largest extent of an outline from its grasp, m.
const MAX_RADIUS_M: f64 = 1.0;
/// Minimum fraction of the surrounding circle that the outline of a disc fills: a square fills 0.64 of its circle.
const DISC_SHARE: f64 = 0.9;

/// A part as seen from above, in the frame of its grasp, and its height.
///
/// The grasp's frame is the tcp's frame while the part is held as marked: x along the marked line, y across it, z down.
#[derive(Debug, Clone, PartialEq)]
pub struct PartShape {
    /// The convex outline, m.
    outline: Polygon,
    jaw_width_m: f64,
    top_m: f64,
    grasp_height_m: f64,
}

impl PartShape {
    /// A part with the convex hull of outline points in the grasp's frame, the width between the fingers, and the
    /// heights of top and grasp above the surface under the part; all in m.
    ///
    /// # Errors
    /// [`RobotError::Configuration`] for a length outside (0, 1] m, for an outline without an area, and for an outline
    /// with a point that is not finite or more than 1 m from the grasp.
    pub fn new(
        outline: impl IntoIterator<Item = Point2<f64>>,
        jaw_width_m: f64,
        top_m: f64,
        grasp_height_m: f64,
    ) -> Result<Self> {
        let wrong = |what: &str, expected: &str, found: String| {
            let (what, expected) = (what.to_owned(), expected.to_owned());
            Err(RobotError::Configuration { what, expected, found })
        };
        let points: Vec<Point2<f64>> = outline.into_iter().collect();
        let is_point = |p: &Point2<f64>| p.coords.norm() <= MAX_RADIUS_M;
        if let Some(p) = points.iter().find(|p| !is_point(p)) {
            return wrong("outline of the part", "points within 1 m of the grasp", p.to_string());
        }
        for (what, found_m) in [
            ("width of the part between the fingers in m", jaw_width_m),
            ("height of the part in m", top_m),
            ("height of the part's grasp in m", grasp_height_m),
        ] {
            if !(found_m > 0.0 && found_m <= MAX_RADIUS_M) {
                return wrong(what, "above 0 and at most 1", found_m.to_string());
            }
        }
        let outline = convex_hull(points);
        if outline.len() < 3 {
            let found = format!("{} corners of its convex hull", outline.len());
            return wrong("outline of the part", "points that are not on one line", found);
        }
        Ok(Self { outline: Polygon { vertices: outline }, jaw_width_m, top_m, grasp_height_m })
    }

    /// The shape that is known from a grasp alone, with the width (m) between the fingers. The part is assumed to be as
    /// long as the fingers are wide, and to extend as far above the tcp as below.
    ///
    /// # Errors
    /// As for [`PartShape::new`].
    pub fn between_fingers(jaw_width_m: f64, grasp_height_m: f64) -> Result<Self> {
        let [x, y] = [FINGER_HALF_WIDTH_M, 0.5 * jaw_width_m];
        let corners = [[-x, -y], [x, -y], [x, y], [-x, y]].map(Point2::from);
        Self::new(corners, jaw_width_m, 2.0 * grasp_height_m, grasp_height_m)
    }

    /// Corners of the outline in the grasp's frame, m.
    pub fn outline(&self) -> &[Point2<f64>] {
        &self.outline.vertices
    }

    /// Centre and radius (m) of the circle around the outline, if the outline fills nearly all of it; otherwise `None`.
    pub(crate) fn disc(&self) -> Option<(Point2<f64>, f64)> {
        let center = self.outline.bounds().center();
        let radius_m = self.outline().iter().map(|p| (p - center).norm()).fold(0.0, f64::max);
        (self.outline.area() >= DISC_SHARE * std::f64::consts::PI * radius_m * radius_m).then_some((center, radius_m))
    }

    /// Centre of the rectangle around the outline, along the grasp's axes, and its half sides, m.
    pub(crate) fn bounds(&self) -> (Point2<f64>, [f64; 2]) {
        let bounds = self.outline.bounds();
        (bounds.center(), [0.5 * bounds.width(), 0.5 * bounds.height()])
    }

    /// Width between the fingers, m.
    pub fn jaw_width_m(&self) -> f64 {
        self.jaw_width_m
    }

    /// Height of the part's top above the surface under it, m.
    pub fn top_m(&self) -> f64 {
        self.top_m
    }

    /// Height of the grasp above the surface under the part, m.
    pub fn grasp_height_m(&self) -> f64 {
        self.grasp_height_m
    }

    /// Outline on the table of a part whose grasp is at a pose, base frame, m.
    pub(crate) fn outline_in_base(&self, base_from_part: &Isometry3<f64>) -> Polygon {
        let in_base = |p: &Point2<f64>| (base_from_part * Point3::new(p.x, p.y, 0.0)).xy();
        Polygon { vertices: self.outline().iter().map(in_base).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_convex_hull_of_the_outline_counts() {
        let corners = [[-0.02, -0.01], [0.02, -0.01], [0.0, 0.0], [0.02, 0.01], [-0.02, 0.01]].map(Point2::from);
        let shape = PartShape::new(corners, 0.02, 0.01, 0.005).unwrap();
        assert_eq!(shape.outline().len(), 4);
        // The grasp's y is the base's -y, because its z points down.
        let down = Isometry3::rotation(nalgebra::Vector3::x() * std::f64::consts::PI);
        let in_base = shape.outline_in_base(&(Isometry3::translation(0.5, 0.1, 0.0) * down));
        assert!(in_base.vertices.iter().all(|p| ((p.x - 0.5).abs() - 0.02).abs() < 1e-12));
        assert!(in_base.vertices.iter().all(|p| ((p.y - 0.1).abs() - 0.01).abs() < 1e-12));
    }

    #[test]
    fn what_makes_no_sense_is_refused() {
        let square = [[-0.01, -0.01], [0.01, -0.01], [0.01, 0.01]].map(Point2::from);
        for [jaw_width_m, top_m, grasp_m] in
            [[f64::NAN, 0.01, 0.005], [0.0, 0.01, 0.005], [0.02, -0.01, 0.005], [0.02, 0.01, f64::INFINITY]]
        {
            assert!(PartShape::new(square, jaw_width_m, top_m, grasp_m).is_err());
        }
        let found = PartShape::new([Point2::new(f64::NAN, 0.0)], 0.02, 0.01, 0.005).unwrap_err().to_string();
        assert!(found.starts_with("outline of the part: expected points within 1 m"), "{found}");
        let line = [[0.0, 0.0], [0.01, 0.0], [0.02, 0.0]].map(Point2::from);
        let found = PartShape::new(line, 0.02, 0.01, 0.005).unwrap_err().to_string();
        assert!(found.contains("not on one line, found 2 corners"), "{found}");
        assert!(PartShape::between_fingers(0.02, 0.01).unwrap().top_m() == 0.02);
    }
}
