//! The board: a checkerboard with dots that identify the squares.
//!
//! ```text
//! y ↑   ■ □ ■ □        Square (column, row) counts from the lower left, square (0, 0) is dark.
//!   │   □ ■ □ ■        Corner [i, j] is where squares (i-1, j-1) and (i, j) touch: 0 < i < columns, 0 < j < rows.
//!   │   ■ □ ■ □        Corner [i, j] lies at (i, j) · square_m.
//!   └──────────→ x     The origin is the outer corner of square (0, 0); z points out of the sheet, towards the reader.
//! ```
//! Some squares have a dot of the other colour in their middle. The pattern of dots is the same on every board of any
//! size, and differs between any two places and turns with three by three visible squares. A board that the picture
//! cuts off is therefore still identified, and boards of 9 × 6 and 8 × 6 squares cannot be confused.

mod checkerboard;
mod sheet;

pub use self::checkerboard::Board;
pub(crate) use self::checkerboard::PATTERN_SIDE;
pub use self::sheet::{Paper, Sheet};
