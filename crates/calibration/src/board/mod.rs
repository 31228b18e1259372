//! The board: a checkerboard in which dots tell the squares apart.
//!
//! ```text
//! y ↑   ■ □ ■ □        Square (column, row) counts from the lower left, square (0, 0) is dark.
//!   │   □ ■ □ ■        Corner [i, j] is where squares (i-1, j-1) and (i, j) touch: 0 < i < columns, 0 < j < rows.
//!   │   ■ □ ■ □        Corner [i, j] lies at (i, j) · square_m.
//!   └──────────→ x     The origin is the outer corner of square (0, 0); z points out of the sheet, towards the reader.
//! ```
//! Some squares have a dot of the other colour in their middle. The pattern of dots is the same on every board, whatever its
//! number of squares, and differs between any two places and turns at which three by three squares can be seen: a board that
//! the picture cuts off is still known, and neither 9 × 6 nor 8 × 6 squares can be taken for the other.

mod checkerboard;
mod sheet;

pub use self::checkerboard::Board;
pub(crate) use self::checkerboard::PATTERN_SIDE;
pub use self::sheet::{Paper, Sheet};
