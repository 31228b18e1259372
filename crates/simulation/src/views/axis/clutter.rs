//! Distractors pushed from all sides against the part, or against each other.

use std::f64::consts::{PI, TAU};

use nalgebra::{Isometry2, Point2, Point3, Vector2};
use rand::Rng;

use super::request::{AxisParameter, Drawn, Request};
use crate::error::{Result, SimulationError};
use crate::objects::HeightMap;
use crate::scene::{Distractor, DistractorKind, SceneVariation, VariationConfig};
use crate::views::base_from_look_camera;
use crate::workcell::{Workcell, WorkcellConfig};

/// Number of distractors.
const NUM_THINGS: std::ops::RangeInclusive<usize> = 10..=15;

/// Number of distractors that touch the part, if there is room; further ones touch any object.
const NUM_TOUCHING: usize = 7;

/// Number of directions tried for a distractor to touch the part.
const MAX_TRIES: usize = 8;

/// Side of a cell of the views from above, in metres: two objects touch if their cells are neighbours.
const CELL_M: f64 = 0.001;

/// Distance at which a distractor starts, from its aim on the part, in metres.
const START_M: f64 = 0.32;

/// Corner, with the smallest coordinates, of the table area that the raster covers, in metres.
const CORNER: Point2<f64> = Point2::new(-0.1, -0.7);
/// Width and height of the raster, in cells.
const WIDTH: usize = 1200;
const HEIGHT: usize = 1400;

/// The content of a cell of the table.
#[derive(Clone, Copy, PartialEq)]
enum Cell {
    Free,
    Part,
    Thing,
}

/// The table from above.
struct Ground {
    cells: Vec<Cell>,
}

impl Ground {
    fn index(at: &Point2<f64>) -> Option<usize> {
        let cell = (at - CORNER) / CELL_M;
        let inside = cell.x >= 0.0 && cell.y >= 0.0 && cell.x < WIDTH as f64 && cell.y < HEIGHT as f64;
        inside.then(|| cell.y as usize * WIDTH + cell.x as usize)
    }

    /// The object that a distractor at a pose would overlap; if there are several, the part has priority.
    fn under(&self, points: &[Point2<f64>], table_from_thing: &Isometry2<f64>) -> Cell {
        let mut found = Cell::Free;
        for point in points {
            match Self::index(&(table_from_thing * point)).map_or(Cell::Free, |idx| self.cells[idx]) {
                Cell::Part => return Cell::Part,
                Cell::Thing => found = Cell::Thing,
                Cell::Free => {}
            }
        }
        found
    }

    fn mark(&mut self, points: &[Point2<f64>], table_from_thing: &Isometry2<f64>, as_cell: Cell) {
        // A rotated raster has gaps between its points, so that each point also marks its neighbours.
        for point in points {
            for (dx, dy) in [(0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)] {
                let at = table_from_thing * (point + Vector2::new(dx - 0.25, dy - 0.25) * CELL_M);
                if let Some(idx) = Self::index(&at) {
                    self.cells[idx] = as_cell;
                }
            }
        }
    }
}

/// A scene with the part between many distractors.
pub(super) fn draw_cluttered(request: &mut Request<'_>) -> Result<Drawn> {
    let config = VariationConfig { distractors: 0..=0, ..VariationConfig::default() };
    let mut scene = SceneVariation::sample(Some(request.spec), &config, request.scene_seed);
    let part = scene.object.clone().ok_or_else(|| SimulationError::Configuration {
        field: "scene.object",
        expected: "a part".into(),
        found: "none".into(),
    })?;
    let points: Vec<Point2<f64>> = request.spec.height_map(CELL_M)?.filled().map(|(at, ..)| at).collect();
    let table_from_part = part.table_from_object();
    let mut ground = Ground { cells: vec![Cell::Free; WIDTH * HEIGHT] };
    ground.mark(&points, &table_from_part, Cell::Part);

    let num_kinds = (NUM_THINGS.end() - NUM_THINGS.start() + 1) as f64;
    let wanted = NUM_THINGS.start() + (request.level * num_kinds) as usize;
    let first_rad = request.rng.random_range(-PI..PI);
    let mut num_touching = 0;
    for number in 0..wanted {
        let tries = if num_touching < NUM_TOUCHING { MAX_TRIES } else { 1 };
        let mut placed = None;
        for attempt in 0..tries {
            let rng = &mut request.rng;
            let kind = DistractorKind::ALL[rng.random_range(0..DistractorKind::ALL.len())];
            let thing = Distractor::new(kind, &Isometry2::identity(), rng.random());
            let triangles: Vec<([Point3<f64>; 3], u32)> = thing.triangles().map(|corners| (corners, 0)).collect();
            let cells: Vec<Point2<f64>> = HeightMap::new(&triangles, CELL_M).filled().map(|(at, ..)| at).collect();
            let turn = first_rad + TAU * (number as f64 / NUM_TOUCHING as f64 + attempt as f64 / MAX_TRIES as f64);
            let direction = Vector2::new(turn.cos(), turn.sin());
            let aim = table_from_part * points[rng.random_range(0..points.len())];
            let yaw_rad = rng.random_range(-PI..PI);
            let Some((table_from_thing, touched)) = pushed(&ground, &cells, &aim, &direction, yaw_rad) else {
                continue;
            };
            let is_last = attempt + 1 == tries;
            if touched == Cell::Part || is_last {
                placed = Some((thing.moved_to(&table_from_thing), cells, table_from_thing, touched));
                break;
            }
        }
        if let Some((thing, cells, table_from_thing, touched)) = placed {
            ground.mark(&cells, &table_from_thing, Cell::Thing);
            num_touching += usize::from(touched == Cell::Part);
            scene.distractors.push(thing);
        }
    }
    let num_things = scene.distractors.len();
    let mut cell = Workcell::new(&WorkcellConfig::new(scene.clone()))?;
    let view = cell.view_from(&base_from_look_camera())?;
    let description = format!("{num_things} other things, {num_touching} of them against the part");
    let parameter = AxisParameter { value: num_things as f64, unit: "other things", description };
    Ok(Drawn { cell, scene, view, parameter })
}

/// Pushes a distractor from a distance towards a point until it touches an object; returns the distractor's pose and
/// the touched object.
fn pushed(
    ground: &Ground,
    points: &[Point2<f64>],
    aim: &Point2<f64>,
    direction: &Vector2<f64>,
    yaw_rad: f64,
) -> Option<(Isometry2<f64>, Cell)> {
    let at = |distance_m: f64| Isometry2::new(aim.coords + direction * distance_m, yaw_rad);
    let mut free = None;
    for step in 0..(START_M / CELL_M) as usize {
        let place = at(START_M - step as f64 * CELL_M);
        match ground.under(points, &place) {
            Cell::Free => free = Some(place),
            touched => return free.map(|place| (place, touched)),
        }
    }
    None
}
