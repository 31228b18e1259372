//! The squares, their dots, and the positions of corners.

use nalgebra::{Point2, Point3};

use crate::error::CalibrationError;

/// Number of squares of the dot pattern along each side, more than any board has.
pub(crate) const PATTERN_SIDE: u32 = 32;
/// The dots: one bit for each square, `1 << column` of `PATTERN[row]`. The dots are pseudo-random. The seed is the
/// first one, of 100 tried, with these properties on 9 × 6 squares (tested below): any two windows of 3 × 3 squares
/// differ at every rotation, and any two of 4 × 4 differ in at least four squares.
const PATTERN: [u32; PATTERN_SIDE as usize] = pattern(13);

const fn pattern(seed: u64) -> [u32; PATTERN_SIDE as usize] {
    let mut rows = [0; PATTERN_SIDE as usize];
    let mut state = seed;
    let mut row = 0;
    while row < rows.len() {
        // SplitMix64 (Steele, Lea, Flood 2014); the upper half of its output.
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut bits = state;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        rows[row] = ((bits ^ (bits >> 31)) >> 32) as u32;
        row += 1;
    }
    rows
}

/// A checkerboard with dots.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Board {
    columns: u32,
    rows: u32,
    square_m: f64,
}

impl Board {
    /// Minimum and maximum number of squares along a side. With the minimum, three corners lie between the squares.
    pub const SIDES: [u32; 2] = [4, 30];
    /// Radius of a dot, in sides of a square. A dot stays outside circles with a radius of 0.45 sides around the
    /// corners.
    pub const DOT_RADIUS: f64 = 0.17;
    /// Minimum and maximum side of a square, in metres: from a board under a microscope to one on a wall.
    const SQUARES_M: [f64; 2] = [0.0005, 0.5];

    /// A board of `columns` × `rows` squares with sides of `square_m` metres.
    ///
    /// # Errors
    /// [`CalibrationError::BoardSize`], [`CalibrationError::SquareSize`].
    pub fn new(columns: u32, rows: u32, square_m: f64) -> Result<Self, CalibrationError> {
        let [least, most] = Self::SIDES;
        if ![columns, rows].iter().all(|side| (least..=most).contains(side)) {
            return Err(CalibrationError::BoardSize { columns, rows, least, most });
        }
        if !(Self::SQUARES_M[0]..=Self::SQUARES_M[1]).contains(&square_m) {
            return Err(CalibrationError::SquareSize { found_m: square_m });
        }
        Ok(Self { columns, rows, square_m })
    }

    /// Number of squares along x.
    pub fn columns(&self) -> u32 {
        self.columns
    }

    /// Number of squares along y.
    pub fn rows(&self) -> u32 {
        self.rows
    }

    /// Side of a square, in metres.
    pub fn square_m(&self) -> f64 {
        self.square_m
    }

    /// The board as printed by a printer that prints 100 mm as `measured_mm`.
    ///
    /// # Errors
    /// [`CalibrationError::Ruler`] for a deviation of more than a tenth: it is attributed to the measurement, not to
    /// the printer.
    pub fn as_printed(&self, measured_mm: f64) -> Result<Self, CalibrationError> {
        if !(90.0..=110.0).contains(&measured_mm) {
            return Err(CalibrationError::Ruler { measured_mm });
        }
        Ok(Self { square_m: self.square_m * measured_mm / 100.0, ..*self })
    }

    /// The position of a corner in the board's frame, in metres.
    pub fn corner(&self, [i, j]: [u32; 2]) -> Point3<f64> {
        Point3::new(f64::from(i) * self.square_m, f64::from(j) * self.square_m, 0.0)
    }

    /// All corners between squares, row by row.
    pub fn corners(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let columns = self.columns;
        (1..self.rows).flat_map(move |j| (1..columns).map(move |i| [i, j]))
    }

    /// Number of corners between squares.
    pub fn num_corners(&self) -> usize {
        ((self.columns - 1) * (self.rows - 1)) as usize
    }

    /// The centre of the board in its frame, in metres.
    pub fn center(&self) -> Point2<f64> {
        Point2::new(f64::from(self.columns), f64::from(self.rows)) * (0.5 * self.square_m)
    }

    /// Whether a square is dark.
    pub fn is_dark(column: u32, row: u32) -> bool {
        (column + row).is_multiple_of(2)
    }

    /// Whether a square has a dot; squares beyond the pattern have none.
    pub fn has_dot(column: u32, row: u32) -> bool {
        column < PATTERN_SIDE && row < PATTERN_SIDE && PATTERN[row as usize] >> column & 1 == 1
    }

    /// Whether ink is printed at a point of the board's frame. The point's coordinates are in sides of a square.
    pub fn is_inked(&self, place: &Point2<f64>) -> bool {
        let inside = |value: f64, side: u32| (0.0..f64::from(side)).contains(&value);
        if !(inside(place.x, self.columns) && inside(place.y, self.rows)) {
            return false;
        }
        let [column, row] = [place.x, place.y].map(|value| value as u32);
        let middle = Point2::new(f64::from(column) + 0.5, f64::from(row) + 0.5);
        let in_dot =
            Self::has_dot(column, row) && (place - middle).norm_squared() < Self::DOT_RADIUS * Self::DOT_RADIUS;
        Self::is_dark(column, row) != in_dot
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The colours and dots of a window of `side` × `side` squares, at a position and a rotation by quarters.
    fn window(side: u32, [column, row]: [u32; 2], turn: u32) -> Vec<(bool, bool)> {
        let places = (0..side).flat_map(|y| (0..side).map(move |x| (x, y)));
        let turned = places.map(|(x, y)| match turn {
            0 => (x, y),
            1 => (side - 1 - y, x),
            2 => (side - 1 - x, side - 1 - y),
            _ => (y, side - 1 - x),
        });
        turned.map(|(x, y)| (column + x, row + y)).map(|(x, y)| (Board::is_dark(x, y), Board::has_dot(x, y))).collect()
    }

    fn min_difference(side: u32) -> usize {
        let windows: Vec<_> = (0..=6 - side)
            .flat_map(|row| (0..=9 - side).map(move |column| [column, row]))
            .flat_map(|place| (0..4).map(move |turn| window(side, place, turn)))
            .collect();
        let pairs = windows.iter().enumerate().flat_map(|(k, a)| windows[k + 1..].iter().map(move |b| (a, b)));
        // Only windows with the same colours of squares can be confused.
        let alike = pairs.filter(|(a, b)| a[0].0 == b[0].0);
        alike.map(|(a, b)| a.iter().zip(b).filter(|(a, b)| a.1 != b.1).count()).min().unwrap()
    }

    #[test]
    fn dots_tell_every_place_and_turn_apart() {
        assert!(min_difference(3) >= 1);
        assert!(min_difference(4) >= 4);
    }

    #[test]
    fn the_origin_is_the_outer_corner_of_a_dark_square() {
        let board = Board::new(9, 6, 0.025).unwrap();
        assert!(board.is_inked(&Point2::new(0.01, 0.01)) && !board.is_inked(&Point2::new(1.01, 0.01)));
        assert!(!board.is_inked(&Point2::new(-0.01, 0.01)) && !board.is_inked(&Point2::new(9.01, 5.9)));
        assert_eq!(board.corner([8, 5]), Point3::new(0.2, 0.125, 0.0));
        assert_eq!(board.corners().count(), board.num_corners());
        // A dot has the opposite colour of its square: the ink differs between the dot's centre and the square around
        // the dot.
        let (column, row) = (0..54).map(|k| (k % 9, k / 9)).find(|(x, y)| Board::has_dot(*x, *y)).unwrap();
        let [x, y] = [column, row].map(|k| f64::from(k) + 0.5);
        assert_ne!(board.is_inked(&Point2::new(x, y)), board.is_inked(&Point2::new(x + 0.2, y)));
    }

    #[test]
    fn boards_that_are_none_are_refused() {
        assert!(matches!(Board::new(3, 6, 0.025), Err(CalibrationError::BoardSize { .. })));
        assert!(matches!(Board::new(9, 60, 0.025), Err(CalibrationError::BoardSize { .. })));
        assert!(matches!(Board::new(9, 6, 25.0), Err(CalibrationError::SquareSize { .. })));
        assert!(matches!(Board::new(9, 6, f64::NAN), Err(CalibrationError::SquareSize { .. })));
        let board = Board::new(9, 6, 0.025).unwrap();
        assert!((board.as_printed(98.0).unwrap().square_m() - 0.0245).abs() < 1e-12);
        assert!(matches!(board.as_printed(9.8), Err(CalibrationError::Ruler { .. })));
    }
}
