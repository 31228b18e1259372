//! Parts lying in the cell, as obstacles.

use nalgebra::{Isometry3, Translation3};
use sdg_geometry::Polygon;
use sdg_kinematics::collision::{Obstacle, Shape};

use crate::part_shape::PartShape;
use crate::room::{MIN_FINGER_ROOM_M, gap_m};

/// Distance by which the capsules of the finger tips extend beyond the finger tips along their motion, m.
const CAPSULES_STAND_OUT_M: f64 = 0.0055;
/// Distance by which each side of a part is moved inwards on straight paths, m, so that fingers can move between parts.
/// It is [`CAPSULES_STAND_OUT_M`] plus the difference between the planner's margin (3 mm) and the room that fingers
/// must have in a tray (1 mm).
const THINNER_M: f64 = CAPSULES_STAND_OUT_M + 0.003 - MIN_FINGER_ROOM_M;
/// Minimum half width or radius of the solid that stands for a part, m.
const MIN_HALF_M: f64 = 0.0005;
/// Largest distance between two grasps of the same part, m.
const SAME_WITHIN_M: f64 = 0.015;

/// A part lying in the cell.
#[derive(Debug, Clone, PartialEq)]
pub struct LyingPart {
    /// The part's grasp as marked, base frame: x along the marked line, z down.
    pub base_from_part: Isometry3<f64>,
    /// The shape of the part, known or assumed.
    pub shape: PartShape,
}

impl LyingPart {
    /// Whether a grasp at this pose belongs to the part.
    pub(crate) fn is_at(&self, base_from_part: &Isometry3<f64>) -> bool {
        (self.base_from_part.translation.vector - base_from_part.translation.vector).xy().norm() < SAME_WITHIN_M
    }

    /// Outline of the part on the table, base frame, m.
    pub(crate) fn outline_in_base(&self) -> Polygon {
        self.shape.outline_in_base(&self.base_from_part)
    }

    /// z of the part's top, base frame, m.
    pub(crate) fn top_in_base_m(&self) -> f64 {
        self.base_from_part.translation.z + self.shape.top_m() - self.shape.grasp_height_m()
    }

    /// Whether the two parts overlap as seen from above.
    pub(crate) fn overlaps(&self, other: &Self) -> bool {
        gap_m(&self.outline_in_base(), &other.outline_in_base()) < 0.0
    }

    /// A solid that contains the part, from the surface under it to its top.
    pub(crate) fn obstacle(&self, number: usize) -> Obstacle {
        self.solid(number, 0.0)
    }

    /// The solid, made thinner, for fingers that move straight down or up beside the part.
    pub(crate) fn obstacle_beside_fingers(&self, number: usize) -> Obstacle {
        self.solid(number, THINNER_M)
    }

    fn solid(&self, number: usize, thinner_m: f64) -> Obstacle {
        let half_height_m = 0.5 * self.shape.top_m();
        // z of the grasp's frame points down: the solid's centre is this far below the grasp.
        let middle_z_m = self.shape.grasp_height_m() - half_height_m;
        let (center, shape) = match self.shape.disc() {
            Some((center, radius_m)) => {
                let radius_m = (radius_m - thinner_m).max(MIN_HALF_M);
                (center, Shape::Cylinder { radius_m, half_length_m: half_height_m })
            }
            None => {
                let (center, half_m) = self.shape.bounds();
                let [x, y] = half_m.map(|half| (half - thinner_m).max(MIN_HALF_M));
                (center, Shape::Box { half_m: [x, y, half_height_m] })
            }
        };
        let p = self.base_from_part.translation;
        Obstacle {
            name: format!("part {} at ({:.2}, {:.2}) m", number + 1, p.x, p.y),
            shape,
            base_from_obstacle: self.base_from_part * Translation3::new(center.x, center.y, middle_z_m),
        }
    }
}

/// Lying parts, at most one at each position.
#[derive(Debug, Clone, Default)]
pub(crate) struct LyingParts(Vec<LyingPart>);

impl LyingParts {
    /// Collects parts without duplicates.
    pub(crate) fn new(told: &[LyingPart]) -> Self {
        let mut parts = Self::default();
        told.iter().for_each(|part| parts.put(part.clone()));
        parts
    }

    /// Adds a part that may lie at its place, unless one is known there already.
    pub(crate) fn suppose(&mut self, part: LyingPart) {
        if !self.0.iter().any(|other| other.is_at(&part.base_from_part)) {
            self.0.push(part);
        }
    }

    /// Adds a part, which replaces the one known at its place.
    pub(crate) fn put(&mut self, part: LyingPart) {
        self.take(&part.base_from_part);
        self.0.push(part);
    }

    /// Removes the part at a place: it was taken, or contact with it is intended.
    pub(crate) fn take(&mut self, base_from_part: &Isometry3<f64>) {
        self.0.retain(|part| !part.is_at(base_from_part));
    }

    /// Sets the height of the grasp of the part known at a place to that of `base_from_part`.
    pub(crate) fn set_height(&mut self, base_from_part: &Isometry3<f64>) {
        for part in self.0.iter_mut().filter(|part| part.is_at(base_from_part)) {
            part.base_from_part.translation.z = base_from_part.translation.z;
        }
    }

    /// All known parts.
    pub(crate) fn all(&self) -> &[LyingPart] {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point2, Point3, UnitQuaternion, Vector3};

    fn at(x: f64, y: f64) -> Isometry3<f64> {
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        Isometry3::from_parts(Translation3::new(x, y, 0.010), down)
    }

    fn bar() -> PartShape {
        let corners = [[-0.02, -0.01], [0.06, -0.01], [0.06, 0.01], [-0.02, 0.01]].map(Point2::from);
        PartShape::new(corners, 0.02, 0.030, 0.010).unwrap()
    }

    #[test]
    fn a_solid_holds_the_part_from_what_it_lies_on_to_its_top() {
        let obstacle = LyingPart { base_from_part: at(0.5, 0.1), shape: bar() }.obstacle(0);
        assert_eq!(obstacle.name, "part 1 at (0.50, 0.10) m");
        let distance_m = |x: f64, y: f64, z: f64| {
            let p = obstacle.base_from_obstacle.inverse() * Point3::new(x, y, z);
            obstacle.shape.signed_distance_m(&p)
        };
        for corner in [[0.48, 0.09, 0.0], [0.56, 0.11, 0.030], [0.48, 0.11, 0.030]] {
            let [x, y, z] = corner;
            assert!(distance_m(x, y, z).abs() < 1e-9, "{corner:?}: {}", distance_m(x, y, z));
        }
        assert!((distance_m(0.5, 0.1, 0.040) - 0.010).abs() < 1e-9);
    }

    #[test]
    fn parts_side_by_side_do_not_overlap() {
        let part = |y: f64| LyingPart { base_from_part: at(0.5, y), shape: bar() };
        assert!(part(0.1).overlaps(&part(0.119)) && !part(0.1).overlaps(&part(0.121)));
    }

    #[test]
    fn round_parts_are_cylinders() {
        let corner = |index: u32| {
            let (sin, cos) = (f64::from(index) * 0.1).sin_cos();
            Point2::new(0.026 * cos, 0.026 * sin)
        };
        let shape = PartShape::new((0..63).map(corner), 0.052, 0.015, 0.008).unwrap();
        let part = LyingPart { base_from_part: at(0.5, 0.1), shape };
        let Shape::Cylinder { radius_m, .. } = part.obstacle(0).shape else { panic!("{:?}", part.obstacle(0)) };
        let Shape::Cylinder { radius_m: thinner_m, .. } = part.obstacle_beside_fingers(0).shape else { panic!() };
        assert!((radius_m - 0.026).abs() < 1e-4 && (radius_m - thinner_m - THINNER_M).abs() < 1e-12);
    }

    #[test]
    fn at_one_place_lies_one_part() {
        let mut parts = LyingParts::default();
        parts.put(LyingPart { base_from_part: at(0.5, 0.1), shape: bar() });
        parts.put(LyingPart { base_from_part: at(0.505, 0.1), shape: bar() });
        parts.put(LyingPart { base_from_part: at(0.6, 0.1), shape: bar() });
        assert_eq!(parts.all().len(), 2);
        assert_eq!(parts.all()[0].base_from_part, at(0.505, 0.1));
        parts.take(&at(0.5, 0.1));
        assert_eq!(parts.all().len(), 1);
    }
}
