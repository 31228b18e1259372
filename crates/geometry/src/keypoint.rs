//! Keypoints and the line along which a grasp is taught.

use nalgebra::{Point2, Vector2};
use serde::{Deserialize, Serialize};

use crate::{Angle, PlanarSimilarity, Polygon};

/// The visibility of a keypoint; COCO's `v`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Visibility {
    /// Not labelled, or outside the image: the position is meaningless (COCO 0).
    Unlabelled,
    /// Labelled, but hidden (COCO 1).
    Occluded,
    /// Labelled and visible (COCO 2).
    Visible,
}

/// A labelled or detected point, in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Keypoint {
    /// Pixels to the right.
    pub x: f64,
    /// Pixels down.
    pub y: f64,
    /// Whether the point is labelled and visible.
    pub visibility: Visibility,
}

impl Keypoint {
    /// A visible keypoint.
    pub fn visible(point: Point2<f64>) -> Self {
        Self { x: point.x, y: point.y, visibility: Visibility::Visible }
    }

    /// The position, in pixels.
    pub fn point(&self) -> Point2<f64> {
        Point2::new(self.x, self.y)
    }

    /// Whether the position was labelled at all.
    pub fn is_labelled(&self) -> bool {
        self.visibility != Visibility::Unlabelled
    }
}

/// The two points with which a person marks a grasp: the gripper's centre moves to their midpoint, and its jaws close
/// across the line. The direction from start to end is the grasp's angle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GraspLine {
    /// The first point.
    pub start: Point2<f64>,
    /// The second point.
    pub end: Point2<f64>,
}

impl GraspLine {
    /// The line from `start` to `end`, in pixels.
    pub fn new(start: Point2<f64>, end: Point2<f64>) -> Self {
        Self { start, end }
    }

    /// The midpoint.
    pub fn center(&self) -> Point2<f64> {
        nalgebra::center(&self.start, &self.end)
    }

    /// The direction from start to end.
    pub fn angle(&self) -> Angle {
        let direction = self.end - self.start;
        Angle::from_direction(direction.x, direction.y)
    }

    /// Length in pixels.
    pub fn length(&self) -> f64 {
        (self.end - self.start).norm()
    }

    /// `count` keypoints, at least two, evenly spaced from start to end, both included.
    ///
    /// # Source
    /// OpenDR single_demo_grasp: the two clicked points and ten between them.
    pub fn keypoints(&self, count: usize) -> Vec<Keypoint> {
        assert!(count >= 2, "a line needs at least two keypoints, found {count}");
        (0..count)
            .map(|k| {
                let t = k as f64 / (count - 1) as f64;
                Keypoint::visible(self.start + (self.end - self.start) * t)
            })
            .collect()
    }

    /// The jaw opening, in pixels, to grasp `part` across the midpoint of the line. The gripper closes symmetrically
    /// about the midpoint, along the perpendicular through it. The opening is twice the largest distance from the
    /// midpoint at which this perpendicular crosses the outline.
    ///
    /// Used for marks without an opening, such as those of other tools, in teaching and on the annotation page.
    pub fn opening_across(&self, part: &Polygon) -> f64 {
        let center = self.center();
        let along = (self.end - self.start).normalize();
        let across = Vector2::new(-along.y, along.x);
        let (mut least, mut most) = (0.0f64, 0.0f64);
        for (a, b) in part.edges() {
            let (side_a, side_b) = (along.dot(&(a - center)), along.dot(&(b - center)));
            if (side_a > 0.0) != (side_b > 0.0) {
                let crossing = a + (b - a) * (side_a / (side_a - side_b));
                let offset = across.dot(&(crossing - center));
                least = least.min(offset);
                most = most.max(offset);
            }
        }
        2.0 * most.max(-least)
    }

    /// The line, transformed with its part.
    pub fn transformed(&self, image_from_demonstration: &PlanarSimilarity) -> Self {
        Self { start: image_from_demonstration.apply(&self.start), end: image_from_demonstration.apply(&self.end) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BoundingBox;

    #[test]
    fn twelve_keypoints_are_eleven_equal_steps() {
        let line = GraspLine::new(Point2::new(0.0, 0.0), Point2::new(11.0, 22.0));
        let keypoints = line.keypoints(12);
        assert_eq!(keypoints.len(), 12);
        for (k, keypoint) in keypoints.iter().enumerate() {
            assert!((keypoint.x - k as f64).abs() < 1e-12 && (keypoint.y - 2.0 * k as f64).abs() < 1e-12);
        }
    }

    #[test]
    fn jaws_open_as_far_as_the_part_is_wide_across_the_middle() {
        let bar = Polygon::from_box(&BoundingBox { x1: 10.0, y1: 20.0, x2: 110.0, y2: 40.0 });
        let opening = |start: [f64; 2], end: [f64; 2]| GraspLine::new(start.into(), end.into()).opening_across(&bar);
        assert!((opening([40.0, 30.0], [60.0, 30.0]) - 20.0).abs() < 1e-12);
        assert!((opening([60.0, 25.0], [60.0, 35.0]) - 100.0).abs() < 1e-12, "along the bar");
        assert!((opening([40.0, 25.0], [60.0, 25.0]) - 30.0).abs() < 1e-12, "5 to one side, 15 to the other");
    }

    #[test]
    fn angle_points_from_start_to_end_with_y_down() {
        let down = GraspLine::new(Point2::new(5.0, 5.0), Point2::new(5.0, 9.0));
        assert!((down.angle().degrees() - 90.0).abs() < 1e-12);
    }
}
