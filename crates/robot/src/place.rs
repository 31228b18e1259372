//! Places for putting parts down: a single pose, the cells of a tray, a bin.

use nalgebra::{Isometry3, Point2, Point3, Translation3, UnitQuaternion, Vector3};

use crate::error::{Result, RobotError};

/// Radius of the area around the point of a pose, m.
const POSE_RADIUS_M: f64 = 0.03;

/// A place of a workcell, for one part or several.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// The name in the workcell file.
    pub name: String,
    /// x and y of the pose, of the bin's centre or of the centre of the tray's first cell, base frame, m.
    pub at_m: [f64; 2],
    /// Direction of the part's marked line, and of the x axis of a tray or bin: the angle about the vertical from the
    /// base's x axis, rad.
    pub yaw_rad: f64,
    /// z of the surface under the parts, base frame, m.
    pub surface_m: f64,
    /// The number and arrangement of its parts.
    pub kind: PlaceKind,
}

/// The number and arrangement of a place's parts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PlaceKind {
    /// One part in a pose.
    Pose,
    /// Cells in a grid, numbered along x first.
    Tray {
        /// Number of cells along the tray's x and y.
        cells: [u32; 2],
        /// Pitch of the cells along the tray's x and y, m.
        pitch_m: [f64; 2],
    },
    /// Any number of parts, in any pose.
    Bin {
        /// Inner size along the bin's x and y, m.
        size_m: [f64; 2],
    },
}

/// The goal for one part.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaceGoal {
    /// Name of the place, with the cell of a tray, for messages.
    pub name: String,
    /// x and y of the part's grasp in the base frame, m.
    pub at_m: [f64; 2],
    /// Direction of the part's marked line: the angle about the vertical from the base's x axis, rad.
    pub yaw_rad: f64,
    /// z of the surface under the part, base frame, m.
    pub surface_m: f64,
    /// Inner size of a bin along the goal's x and y, m: the part may lie there in any pose. `None` if the pose of the
    /// goal is required.
    pub bin_m: Option<[f64; 2]>,
    /// The neighbouring cells of a tray; `None` for a pose or a bin.
    pub tray: Option<TrayCell>,
}

/// The neighbourhood of a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct TrayCell {
    /// Pitch along the tray's x and y, m.
    pub pitch_m: [f64; 2],
    /// The neighbouring cells, up to eight, as steps along the tray's x and y.
    pub neighbours: Vec<[i32; 2]>,
}

/// Deviation of a part from its goal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaceOffset {
    /// Offset along the marked line and across it, m.
    pub beside_m: [f64; 2],
    /// Angle between part and goal, reduced by the part's symmetry, rad.
    pub angle_rad: f64,
}

impl PlaceOffset {
    /// Horizontal distance, m.
    pub fn distance_m(&self) -> f64 {
        self.beside_m[0].hypot(self.beside_m[1])
    }
}

impl Place {
    /// Number of cells; 1 for a pose and a bin.
    pub fn num_cells(&self) -> u32 {
        match self.kind {
            PlaceKind::Tray { cells: [columns, rows], .. } => columns * rows,
            PlaceKind::Pose | PlaceKind::Bin { .. } => 1,
        }
    }

    /// The goal of a part; cells are numbered from 1.
    ///
    /// # Errors
    /// [`RobotError::Configuration`] for a cell that does not exist.
    pub fn goal(&self, cell: u32) -> Result<PlaceGoal> {
        let num_cells = self.num_cells();
        if !(1..=num_cells).contains(&cell) {
            return Err(RobotError::Configuration {
                what: format!("cell of \"{}\"", self.name),
                expected: format!("1 to {num_cells}"),
                found: cell.to_string(),
            });
        }
        let Self { name, yaw_rad, surface_m, .. } = self.clone();
        let at_m = self.at([0.0; 2]).into();
        let goal = PlaceGoal { name, at_m, yaw_rad, surface_m, bin_m: None, tray: None };
        Ok(match self.kind {
            PlaceKind::Pose => goal,
            PlaceKind::Bin { size_m } => PlaceGoal { bin_m: Some(size_m), ..goal },
            PlaceKind::Tray { cells, pitch_m } => {
                let at = [(cell - 1) % cells[0], (cell - 1) / cells[0]];
                let at_m = self.at([0, 1].map(|axis| f64::from(at[axis]) * pitch_m[axis])).into();
                let name = format!("{}, cell {cell}", self.name);
                let tray = Some(TrayCell { pitch_m, neighbours: neighbours(at, cells) });
                PlaceGoal { name, at_m, tray, ..goal }
            }
        })
    }

    /// The corners of the place's area on the table, counter-clockwise, base frame, m; for a pose only its point.
    pub fn corners(&self) -> Vec<Point2<f64>> {
        let [low, high] = match self.kind {
            PlaceKind::Pose => return vec![self.at([0.0; 2])],
            PlaceKind::Tray { cells, pitch_m } => [
                pitch_m.map(|pitch| -0.5 * pitch),
                std::array::from_fn(|axis| (f64::from(cells[axis]) - 0.5) * pitch_m[axis]),
            ],
            PlaceKind::Bin { size_m } => [size_m.map(|size| -0.5 * size), size_m.map(|size| 0.5 * size)],
        };
        [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]].map(|p| self.at(p)).to_vec()
    }

    /// A convex area of the table, counter-clockwise, base frame, m, that contains every point that [`Self::covers`].
    pub fn covered_area(&self) -> Vec<Point2<f64>> {
        match self.kind {
            PlaceKind::Pose => [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
                .map(|corner| self.at(corner.map(|side| side * POSE_RADIUS_M)))
                .to_vec(),
            PlaceKind::Tray { .. } | PlaceKind::Bin { .. } => self.corners(),
        }
    }

    /// Whether a part at x and y of the base frame (m) belongs to this place.
    pub fn covers(&self, at_m: [f64; 2]) -> bool {
        let apart = Point2::from(at_m) - Point2::from(self.at_m);
        let (sin, cos) = self.yaw_rad.sin_cos();
        let [along, across] = [apart.x * cos + apart.y * sin, apart.y * cos - apart.x * sin];
        let within = |value: f64, low: f64, high: f64| value >= low && value <= high;
        match self.kind {
            PlaceKind::Pose => apart.norm() <= POSE_RADIUS_M,
            PlaceKind::Bin { size_m: [length, width] } => {
                within(along, -0.5 * length, 0.5 * length) && within(across, -0.5 * width, 0.5 * width)
            }
            PlaceKind::Tray { cells: [columns, rows], pitch_m: [a, b] } => {
                within(along, -0.5 * a, (f64::from(columns) - 0.5) * a)
                    && within(across, -0.5 * b, (f64::from(rows) - 0.5) * b)
            }
        }
    }

    fn at(&self, [along, across]: [f64; 2]) -> Point2<f64> {
        let (sin, cos) = self.yaw_rad.sin_cos();
        Point2::new(self.at_m[0] + along * cos - across * sin, self.at_m[1] + along * sin + across * cos)
    }
}

impl PlaceGoal {
    /// The pose of the part's grasp at the goal, at z `height_m` and rotated by `turn_rad`: `base_from_tcp` of a hand
    /// that holds the part as marked, with x along the marked line and z down.
    pub fn base_from_part(&self, height_m: f64, turn_rad: f64) -> Isometry3<f64> {
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.yaw_rad + turn_rad);
        Isometry3::from_parts(Translation3::new(self.at_m[0], self.at_m[1], height_m), turn * down)
    }

    /// Distance of a part at x and y of the base frame (m) from the inside of the bin, as seen from above, m: 0 inside.
    /// `None` for other places.
    pub fn outside_bin_m(&self, at_m: [f64; 2]) -> Option<f64> {
        let half_m = self.bin_m?.map(|size_m| 0.5 * size_m);
        let p = self.base_from_part(0.0, 0.0).inverse() * Point3::new(at_m[0], at_m[1], 0.0);
        let [x, y] = [0, 1].map(|axis| (p[axis].abs() - half_m[axis]).max(0.0));
        Some(x.hypot(y))
    }

    /// As [`PlaceGoal::base_from_part`], for parts in the neighbouring cells.
    pub(crate) fn neighbours_in_base(&self, height_m: f64) -> impl Iterator<Item = Isometry3<f64>> {
        let base_from_part = self.base_from_part(height_m, 0.0);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.yaw_rad);
        self.tray.iter().flat_map(move |TrayCell { pitch_m, neighbours }| {
            neighbours.iter().map(move |steps| {
                let [x, y] = [0, 1].map(|axis| f64::from(steps[axis]) * pitch_m[axis]);
                Translation3::from(turn * Vector3::new(x, y, 0.0)) * base_from_part
            })
        })
    }
}

/// Steps from a cell to its existing neighbours.
fn neighbours(at: [u32; 2], cells: [u32; 2]) -> Vec<[i32; 2]> {
    let is_there = |axis: usize, step: i32| at[axis].checked_add_signed(step).is_some_and(|to| to < cells[axis]);
    (-1..=1)
        .flat_map(|y| (-1..=1).map(move |x| [x, y]))
        .filter(|steps| *steps != [0, 0] && is_there(0, steps[0]) && is_there(1, steps[1]))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn tray() -> Place {
        let kind = PlaceKind::Tray { cells: [3, 2], pitch_m: [0.1, 0.05] };
        Place { name: "tray".to_owned(), at_m: [0.4, 0.2], yaw_rad: FRAC_PI_2, surface_m: 0.003, kind }
    }

    #[test]
    fn cells_count_along_the_trays_x_first() {
        // The tray's x is the base's y; the tray's y is the base's -x.
        for (cell, expected) in [(1, [0.4, 0.2]), (3, [0.4, 0.4]), (4, [0.35, 0.2]), (6, [0.35, 0.4])] {
            let goal = tray().goal(cell).unwrap();
            let apart = Point2::from(goal.at_m) - Point2::from(expected);
            assert!(apart.norm() < 1e-12, "{cell}: {goal:?}");
            assert_eq!(goal.name, format!("tray, cell {cell}"));
        }
        for cell in [0, 7] {
            let error = tray().goal(cell).unwrap_err().to_string();
            assert_eq!(error, format!("cell of \"tray\": expected 1 to 6, found {cell}"));
        }
    }

    #[test]
    fn a_cell_knows_those_around_it() {
        let steps = |cell| tray().goal(cell).unwrap().tray.unwrap().neighbours;
        assert_eq!(steps(1), [[1, 0], [0, 1], [1, 1]]);
        assert_eq!(steps(5), [[-1, -1], [0, -1], [1, -1], [-1, 0], [1, 0]]);
        let beside: Vec<_> =
            tray().goal(5).unwrap().neighbours_in_base(0.0).map(|pose| pose.translation.vector.xy()).collect();
        for (cell, found) in [1, 2, 3, 4, 6].into_iter().zip(beside) {
            let expected = Point2::from(tray().goal(cell).unwrap().at_m);
            assert!((found - expected.coords).norm() < 1e-12, "{cell}: {found}");
        }
    }

    #[test]
    fn a_tray_covers_half_a_pitch_around_its_cells() {
        let corners = tray().corners();
        let expected = [[0.425, 0.15], [0.425, 0.45], [0.325, 0.45], [0.325, 0.15]];
        for (corner, expected) in corners.iter().zip(expected) {
            assert!((corner - Point2::from(expected)).norm() < 1e-12, "{corners:?}");
        }
        assert!(tray().covers([0.42, 0.44]) && tray().covers([0.33, 0.16]));
        assert!(!tray().covers([0.43, 0.3]) && !tray().covers([0.4, 0.14]));
    }

    #[test]
    fn a_part_outside_a_bin_has_a_distance_from_it() {
        let bin = Place { kind: PlaceKind::Bin { size_m: [0.1, 0.05] }, ..tray() }.goal(1).unwrap();
        // The bin's x is the base's y.
        for (at_m, expected_m) in
            [([0.4, 0.24], 0.0), ([0.42, 0.16], 0.0), ([0.4, 0.28], 0.03), ([0.435, 0.2], 0.01), ([0.465, 0.28], 0.05)]
        {
            let outside_m = bin.outside_bin_m(at_m).unwrap();
            assert!((outside_m - expected_m).abs() < 1e-12, "{at_m:?}: {outside_m}");
        }
        assert_eq!(tray().goal(1).unwrap().outside_bin_m([0.4, 0.2]), None);
    }

    #[test]
    fn a_part_at_its_goal_has_its_line_along_the_yaw_and_z_down() {
        let goal = tray().goal(1).unwrap();
        let pose = goal.base_from_part(0.02, 0.0);
        assert!((pose.rotation * Vector3::x() - Vector3::y()).norm() < 1e-12);
        assert!((pose.rotation * Vector3::z() + Vector3::z()).norm() < 1e-12);
    }
}
