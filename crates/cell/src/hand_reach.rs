//! The area of the table that the hand reaches.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Point2, Translation3, UnitQuaternion, Vector3};
use sdg_kinematics::IkOptions;
use sdg_kinematics::collision::{Body, Checker, CollisionError};
use sdg_robot::workcell::Workcell;

/// Number of hand angles that are tried over 180 degrees. With the fingers exchanged, the other angles are equivalent.
const NUM_TURNS: usize = 4;
/// Minimum distance from obstacles, in metres.
const MARGIN_M: f64 = 0.003;

/// Squares of the table, each with the number of hand angles at which it is reached.
pub struct Reach {
    /// All squares of the area whose centre is on the table.
    pub squares: Vec<Square>,
    /// Width of a square, in metres.
    pub grid_m: f64,
    height_m: f64,
}

/// A square of the table.
pub struct Square {
    /// The centre in the base frame, in metres.
    pub at_m: Point2<f64>,
    /// Number of hand angles at which it is reached.
    pub num_turns: usize,
}

impl Reach {
    /// Computes the reach in an area (x and y in the base frame, in metres) as far as the table extends, with the tcp at
    /// `height_m` above the table, among the workcell's obstacles and inside its workspace.
    ///
    /// # Errors
    /// None for a workcell that was read from a file.
    pub fn of(workcell: &Workcell, [x, y]: [[f64; 2]; 2], grid_m: f64, height_m: f64) -> Result<Self, CollisionError> {
        let mut model = workcell.collision_model(workcell.robot.geometry().hand.opening_max_m)?;
        model.allow(Body::HAND, "table")?;
        let mut checker = Checker::new(&model, MARGIN_M);
        let count = |[low, high]: [f64; 2]| ((high - low) / grid_m).floor().max(1.0) as usize;
        let is_on_table = |p: &Point2<f64>| {
            workcell.table_m.is_none_or(|[x, y]| (x[0]..=x[1]).contains(&p.x) && (y[0]..=y[1]).contains(&p.y))
        };
        let mut squares = Vec::new();
        for column in 0..count(x) {
            for row in 0..count(y) {
                let at_m = Point2::new(x[0] + (column as f64 + 0.5) * grid_m, y[0] + (row as f64 + 0.5) * grid_m);
                if is_on_table(&at_m) {
                    let num_turns = num_turns(workcell, &mut checker, at_m, workcell.table_height_m + height_m);
                    squares.push(Square { at_m, num_turns });
                }
            }
        }
        Ok(Self { squares, grid_m, height_m })
    }

    /// A summary in lines of text.
    pub fn lines(&self, workcell: &Workcell) -> Vec<String> {
        let square_m2 = self.grid_m * self.grid_m;
        let area_m2 =
            |least: usize| self.squares.iter().filter(|square| square.num_turns >= least).count() as f64 * square_m2;
        let mut lines = vec![format!(
            "with the tcp {:.0} mm above the table and the hand straight down, {:.2} m² of the table are reached, \
             {:.2} m² at every tested angle of the hand",
            self.height_m * 1e3,
            area_m2(1),
            area_m2(NUM_TURNS)
        )];
        let Ok(mut model) = workcell.collision_model(workcell.robot.geometry().hand.opening_max_m) else {
            return lines;
        };
        if model.allow(Body::HAND, "table").is_err() {
            return lines;
        }
        let mut checker = Checker::new(&model, MARGIN_M);
        for place in &workcell.places {
            let num_cells = place.num_cells();
            let height_m = place.surface_m + self.height_m;
            let unreached: Vec<String> = (1..=num_cells)
                .filter(|&cell| {
                    place.goal(cell).is_ok_and(|goal| {
                        let pose = goal.base_from_part(height_m, 0.0);
                        !is_reached(workcell, &mut checker, &pose)
                    })
                })
                .map(|cell| cell.to_string())
                .collect();
            lines.push(match (unreached.len(), num_cells) {
                (0, 1) => format!("\"{}\" is reached", place.name),
                (0, num) => format!("\"{}\": all {num} cells are reached", place.name),
                (_, 1) => format!("\"{}\" is not reached", place.name),
                (_, num) => {
                    format!("\"{}\": of {num} cells these are not reached: {}", place.name, unreached.join(", "))
                }
            });
        }
        lines
    }
}

fn num_turns(workcell: &Workcell, checker: &mut Checker<'_>, at_m: Point2<f64>, z_m: f64) -> usize {
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI);
    (0..NUM_TURNS)
        .filter(|&turn| {
            let yaw = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), PI * turn as f64 / NUM_TURNS as f64);
            is_reached(workcell, checker, &Isometry3::from_parts(Translation3::new(at_m.x, at_m.y, z_m), yaw * down))
        })
        .count()
}

/// Whether a configuration reaches a pose, at either of the two equivalent hand angles, without collision and inside
/// the workspace.
fn is_reached(workcell: &Workcell, checker: &mut Checker<'_>, pose: &Isometry3<f64>) -> bool {
    let arm = workcell.robot.geometry();
    let within = |p: Vector3<f64>| {
        let (min, max) = (workcell.workspace.min_m, workcell.workspace.max_m);
        (0..3).all(|axis| (min[axis]..=max[axis]).contains(&p[axis]))
    };
    if !within(pose.translation.vector) {
        return false;
    }
    [*pose, sdg_kinematics::with_fingers_exchanged(pose)].iter().any(|pose| {
        arm.inverse_all(pose, &arm.ready, &IkOptions::default()).is_ok_and(|solutions| {
            solutions.iter().any(|solution| {
                within(arm.base_from_flange(&solution.q).translation.vector) && checker.is_free(&solution.q)
            })
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_reached_beside_the_table_does_not_count() {
        let shipped = include_str!("../../../datasets/workcell/workcell.toml");
        let reached = |table: &str| {
            let text = shipped.replace("height_mm = 0.0", &format!("{table}height_mm = 0.0"));
            let workcell = Workcell::from_toml(&text).unwrap();
            let reach = Reach::of(&workcell, [[0.3, 0.71], [-0.4, 0.41]], 0.1, 0.02).unwrap();
            reach.squares.iter().filter(|square| square.num_turns > 0).map(|square| square.at_m).collect::<Vec<_>>()
        };
        let whole = reached("");
        assert_eq!(reached("x_mm = [0, 1000]\ny_mm = [-600, 600]\n"), whole);
        let left: Vec<_> = whole.iter().copied().filter(|at_m| at_m.y > 0.0).collect();
        assert!(!left.is_empty() && left.len() < whole.len(), "{whole:?}");
        assert_eq!(reached("x_mm = [0, 1000]\ny_mm = [0, 600]\n"), left);
    }
}
