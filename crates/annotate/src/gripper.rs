//! The gripper over the part, and the section of the part between its jaws.

use std::f64::consts::PI;

use nalgebra::{Rotation2, Vector2};
use sdg_geometry::{GraspLine, Polygon};

/// A two-finger gripper seen from above. Its jaws are as wide as `line` is long, are on both sides of the line, and
/// close across it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gripper {
    /// From `grasp_start` to `grasp_end`, in pixels.
    pub line: GraspLine,
    /// Distance between the jaws, in pixels.
    pub jaw_width: f64,
}

/// Extent of the part between the jaws, in pixels from the line: to its left (start to end, y down) and right.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// Towards the jaw at negative offsets.
    pub left: f64,
    /// Towards the jaw at positive offsets.
    pub right: f64,
}

impl Gripper {
    /// The extent of the part in the strip that the jaws sweep when closing; `None` if the strip contains no part.
    pub fn reach(&self, part: &Polygon) -> Option<Reach> {
        let length = self.line.length();
        if length == 0.0 {
            return None;
        }
        let along = (self.line.end - self.line.start) / length;
        let across = Vector2::new(-along.y, along.x);
        let farthest = part.vertices.iter().map(|v| (v - self.line.start).norm()).fold(0.0, f64::max) + 1.0;
        // In the strip's frame, the swept strip is a rectangle at the origin, to which `clip` clips the polygon.
        let in_strip = Polygon {
            vertices: part
                .vertices
                .iter()
                .map(|v| {
                    let from_start = v - self.line.start;
                    [along.dot(&from_start), across.dot(&from_start) + farthest].into()
                })
                .collect(),
        };
        let swept = in_strip.clip(length, 2.0 * farthest);
        let offsets = || swept.vertices.iter().map(|v| v.y - farthest);
        let (least, most) = (offsets().fold(f64::INFINITY, f64::min), offsets().fold(f64::NEG_INFINITY, f64::max));
        (least <= most).then_some(Reach { left: -least, right: most })
    }

    /// The minimum, over angles in steps of 5 degrees, of the opening that these jaws need about their middle;
    /// infinite if the jaws close on nothing at every angle.
    pub fn narrowest(&self, part: &Polygon) -> f64 {
        const NUM_TURNS: u32 = 36;
        let center = self.line.center();
        let half = 0.5 * (self.line.end - self.line.start);
        let turned = |turn: u32| {
            let half = Rotation2::new(f64::from(turn) * PI / f64::from(NUM_TURNS)) * half;
            let gripper = Self { line: GraspLine::new(center - half, center + half), ..*self };
            Some(gripper.min_jaw_width(part)).filter(|width| *width > 0.0)
        };
        (0..NUM_TURNS).filter_map(turned).fold(f64::INFINITY, f64::min)
    }

    /// The minimum opening at which the jaws do not touch the part when lowered; zero if they would close on nothing.
    /// The hand closes about the line, so twice the larger extent counts.
    pub fn min_jaw_width(&self, part: &Polygon) -> f64 {
        self.reach(part).map_or(0.0, |reach| 2.0 * reach.left.max(reach.right).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;
    use sdg_geometry::BoundingBox;

    fn bar() -> Polygon {
        Polygon::from_box(&BoundingBox { x1: 10.0, y1: 20.0, x2: 110.0, y2: 40.0 })
    }

    fn along(x1: f64, y1: f64, x2: f64, y2: f64) -> Gripper {
        Gripper { line: GraspLine::new(Point2::new(x1, y1), Point2::new(x2, y2)), jaw_width: 30.0 }
    }

    #[test]
    fn a_bar_is_as_wide_as_it_is() {
        assert!((along(40.0, 30.0, 60.0, 30.0).min_jaw_width(&bar()) - 20.0).abs() < 1e-9);
        assert!((along(60.0, 25.0, 60.0, 35.0).min_jaw_width(&bar()) - 100.0).abs() < 1e-9);
    }

    #[test]
    fn off_the_middle_the_farther_side_counts_twice() {
        let reach = along(40.0, 25.0, 60.0, 25.0).reach(&bar()).unwrap();
        assert!((reach.left - 5.0).abs() < 1e-9 && (reach.right - 15.0).abs() < 1e-9, "{reach:?}");
        assert!((along(40.0, 25.0, 60.0, 25.0).min_jaw_width(&bar()) - 30.0).abs() < 1e-9);
    }

    #[test]
    fn what_the_jaws_do_not_sweep_does_not_count() {
        // A lug protrudes from the bar beyond the jaws.
        let lugged = Polygon {
            vertices: [
                [10.0, 20.0],
                [80.0, 20.0],
                [80.0, 0.0],
                [90.0, 0.0],
                [90.0, 20.0],
                [110.0, 20.0],
                [110.0, 40.0],
                [10.0, 40.0],
            ]
            .map(Point2::from)
            .to_vec(),
        };
        assert!((along(40.0, 30.0, 60.0, 30.0).min_jaw_width(&lugged) - 20.0).abs() < 1e-9);
        assert!((along(70.0, 30.0, 85.0, 30.0).min_jaw_width(&lugged) - 60.0).abs() < 1e-9);
    }

    #[test]
    fn beside_the_part_there_is_nothing() {
        assert_eq!(along(140.0, 30.0, 160.0, 30.0).reach(&bar()), None);
    }
}
