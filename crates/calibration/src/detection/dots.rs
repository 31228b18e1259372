//! The dots in a grid's squares, and the grid's placement on the board.

use std::collections::BTreeMap;

use nalgebra::Point2;

use super::grid::{Grid, Place};
use super::luminance::Luminance;
use crate::board::{Board, PATTERN_SIDE};
use crate::error::CalibrationError;

/// A grid's placement on the board: the board's corner `[i, j]` for each position of the grid.
pub(super) type Placed = BTreeMap<Place, [u32; 2]>;

/// The dot of the square between `[i, j]` and `[i + 1, j + 1]`: from 0 (absent) to 1 (present).
type Dots = BTreeMap<Place, f64>;

/// Largest fraction of the squares that may contradict the board, because of shadows or glare.
const MAX_CONTRADICTION: f64 = 0.2;
/// Number of contradicting squares by which the second best placement must exceed the best. Windows of four by four
/// squares differ in at least four.
const MIN_MARGIN: f64 = 1.5;
/// Number of found corners that may lie outside the board.
const MAX_OUTSIDE: usize = 2;
/// Largest number of dots that may be detected on a board without dots, as a fraction of the dots of an equally large
/// board with dots. On such a board, half of the squares have a dot.
const MAX_PLAIN: f64 = 0.3;
/// Distance from a square's centre of the points at which the square's own colour is sampled, in sides: outside a dot
/// and inside the edges.
const RING: f64 = 0.32;

/// Finds the grid's placement on the board.
///
/// # Errors
/// [`CalibrationError::BoardUnclear`] if no placement or several fit, [`CalibrationError::OtherBoard`] if a larger
/// board fits, [`CalibrationError::OtherCheckerboard`] if a grid without dots has a different number of squares.
pub(super) fn identify(picture: &Luminance, grid: &Grid, board: &Board) -> Result<Placed, CalibrationError> {
    let dots = read(picture, grid);
    if let Some(placed) = place(grid, &dots, [board.columns(), board.rows()]) {
        return Ok(placed);
    }
    if let Some(placed) = place(grid, &dots, [PATTERN_SIDE; 2]) {
        let most = |axis: usize| placed.values().map(|corner| corner[axis]).max().unwrap_or_default() + 1;
        return Err(CalibrationError::OtherBoard {
            columns: board.columns(),
            rows: board.rows(),
            found_columns: most(0),
            found_rows: most(1),
        });
    }
    let is_plain = dots.values().sum::<f64>() < MAX_PLAIN * 0.5 * dots.len() as f64;
    match plain(grid, board) {
        Some(placed) if is_plain => Ok(placed),
        _ if is_plain => Err(other_checkerboard(grid, board)),
        _ => Err(CalibrationError::BoardUnclear { corners: grid.len() }),
    }
}

/// The reason why a grid without dots is not the whole board.
fn other_checkerboard(grid: &Grid, board: &Board) -> CalibrationError {
    let [columns, rows] = [board.columns(), board.rows()];
    // The longer side is compared with the board's longer side.
    let mut found = grid.extent().map(|corners| corners as u32 + 1);
    found.sort_unstable();
    if columns >= rows {
        found.reverse();
    }
    if found == [columns, rows] {
        return CalibrationError::BoardUnclear { corners: grid.len() };
    }
    let [found_columns, found_rows] = found;
    CalibrationError::OtherCheckerboard { columns, rows, found_columns, found_rows }
}

fn read(picture: &Luminance, grid: &Grid) -> Dots {
    let mut seen = BTreeMap::new();
    for place in grid.corners.keys() {
        let Some(square) = grid.square(*place) else { continue };
        let sample = |places: &[[f64; 2]]| {
            let values: Option<Vec<f64>> =
                places.iter().map(|place| picture.sample(&within(&square, *place))).collect();
            values.map(|values| values.iter().sum::<f64>() / values.len() as f64)
        };
        const NEAR: f64 = 0.05;
        let middle = sample(&[[0.5, 0.5], [0.5 - NEAR, 0.5], [0.5 + NEAR, 0.5], [0.5, 0.5 - NEAR], [0.5, 0.5 + NEAR]]);
        let diagonal = RING * std::f64::consts::FRAC_1_SQRT_2;
        let [near, far] = [0.5 - diagonal, 0.5 + diagonal];
        let [low, high] = [0.5 - RING, 0.5 + RING];
        let ring = sample(&[
            [near, near],
            [far, near],
            [near, far],
            [far, far],
            [low, 0.5],
            [high, 0.5],
            [0.5, low],
            [0.5, high],
        ]);
        if let (Some(middle), Some(ring)) = (middle, ring) {
            seen.insert(*place, (middle, ring));
        }
    }
    let others = |[i, j]: Place| {
        let rings: Vec<f64> = [[i + 1, j], [i - 1, j], [i, j + 1], [i, j - 1]]
            .iter()
            .filter_map(|place| seen.get(place).map(|(_, ring)| *ring))
            .collect();
        (!rings.is_empty()).then(|| rings.iter().sum::<f64>() / rings.len() as f64)
    };
    seen.iter()
        .filter_map(|(place, (middle, ring))| {
            let other = others(*place)?;
            Some((*place, ((middle - ring) / (other - ring)).clamp(0.0, 1.0)))
        })
        .filter(|(_, dot)| dot.is_finite())
        .collect()
}

/// The point at `[u, v]` of a square, 0 to 1 along each side.
fn within(&[a, b, c, d]: &[Point2<f64>; 4], [u, v]: [f64; 2]) -> Point2<f64> {
    let lower = a.coords * (1.0 - u) + b.coords * u;
    let upper = c.coords * (1.0 - u) + d.coords * u;
    Point2::from(lower * (1.0 - v) + upper * v)
}

/// The placement on a board of this many squares, if only one agrees with the dots.
fn place(grid: &Grid, dots: &Dots, sides: [u32; 2]) -> Option<Placed> {
    let mut placements: Vec<(f64, Turned)> = Turned::all(grid, sides)
        .filter(|turned| turned.agrees_in_color(grid))
        .filter_map(|turned| Some((turned.contradiction(grid, dots, sides)?, turned)))
        .collect();
    placements.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (best, turned) = placements.first()?;
    let second = placements.get(1).map_or(f64::INFINITY, |(second, _)| *second);
    let is_clear = *best <= MAX_CONTRADICTION * dots.len() as f64 && second - best >= MIN_MARGIN;
    is_clear.then(|| turned.corners(grid, sides))
}

/// The placement of a board without dots. The board must be completely visible. The colours of its squares distinguish
/// it from the same board rotated by 180 degrees if one side has an odd and the other an even number of squares;
/// otherwise `None`.
fn plain(grid: &Grid, board: &Board) -> Option<Placed> {
    let sides = [board.columns(), board.rows()];
    if grid.len() != board.num_corners() {
        return None;
    }
    let mut whole = Turned::all(grid, sides)
        .filter(|turned| turned.agrees_in_color(grid) && turned.corners(grid, sides).len() == grid.len());
    let first = whole.next()?;
    whole.next().is_none().then(|| first.corners(grid, sides))
}

/// A rotation by quarters and a shift: from a grid's positions to the board's corners.
#[derive(Debug, Clone, Copy)]
struct Turned {
    quarters: i32,
    shift: Place,
}

impl Turned {
    /// All placements with at most one row or column of corners beyond each side of the board.
    fn all(grid: &Grid, [columns, rows]: [u32; 2]) -> impl Iterator<Item = Self> {
        (0..4).flat_map(move |quarters| {
            let turned = Self { quarters, shift: [0, 0] };
            let places: Vec<Place> = grid.corners.keys().map(|place| turned.corner(*place)).collect();
            let ranges = [(0, columns), (1, rows)].map(|(axis, side)| {
                let along = || places.iter().map(|place| place[axis]);
                let (low, high) = (along().min().unwrap_or_default(), along().max().unwrap_or_default());
                // Corners are numbered from 1 to side - 1.
                -low..=side as i32 - high
            });
            let [across, along] = ranges;
            along.flat_map(move |y| across.clone().map(move |x| Self { quarters, shift: [x, y] }))
        })
    }

    fn corner(&self, [i, j]: Place) -> Place {
        let [x, y] = match self.quarters {
            0 => [i, j],
            1 => [-j, i],
            2 => [-i, -j],
            _ => [j, -i],
        };
        [x + self.shift[0], y + self.shift[1]]
    }

    /// The board's square at the grid's square `[i, j]`.
    fn square(&self, [i, j]: Place) -> Place {
        let (a, b) = (self.corner([i, j]), self.corner([i + 1, j + 1]));
        [a[0].min(b[0]), a[1].min(b[1])]
    }

    fn agrees_in_color(&self, grid: &Grid) -> bool {
        let [column, row] = self.square([0, 0]);
        ((column + row).rem_euclid(2) == 0) == grid.first_is_dark
    }

    /// Number of squares whose dots contradict the board, plus the number of corners outside the board; `None` for more
    /// than [`MAX_OUTSIDE`] such corners.
    fn contradiction(&self, grid: &Grid, dots: &Dots, sides: [u32; 2]) -> Option<f64> {
        let outside = grid.len() - self.corners(grid, sides).len();
        if outside > MAX_OUTSIDE {
            return None;
        }
        let of_dots: f64 = dots
            .iter()
            .map(|(place, dot)| {
                let [column, row] = self.square(*place).map(|k| u32::try_from(k).unwrap_or(PATTERN_SIDE));
                (f64::from(Board::has_dot(column, row)) - dot).abs()
            })
            .sum();
        Some(of_dots + outside as f64)
    }

    fn corners(&self, grid: &Grid, [columns, rows]: [u32; 2]) -> Placed {
        let inside = |value: i32, side: u32| u32::try_from(value).ok().filter(|value| (1..side).contains(value));
        let placed = grid.corners.keys().filter_map(|place| {
            let [i, j] = self.corner(*place);
            Some((*place, [inside(i, columns)?, inside(j, rows)?]))
        });
        placed.collect()
    }
}
