//! The board: a checkerboard with dots that identify the squares.
//!
//! ```text
//! y ↑   ■ □ ■ □        Square (column, row) counts from the lower left, square (0, 0) is dark.
//!   │   □ ■ □ ■        Corner [i, j] is where squares (i-1, j-1) and (i, j) touch: 0 < i < columns, 0 < j < rows.
//!   │   ■ □ ■ □        Corner [i, j] lies at (i, j) · square_m.
//!   └──────────→ x     The origin is the outer corner of square (0, 0); z points out of the sheet, towards the reader.
//! ```
//! Some squares have a dot of the opposite colour in their centre. The pattern of dots is the same on boards of every
//! size. On 9 × 6 squares, any two windows of three by three squares differ at every rotation. A board is therefore
//! identified even if it is partly outside the picture, and a board with more squares than expected is rejected.

mod checkerboard;
mod sheet;

pub use self::checkerboard::Board;
pub(crate) use self::checkerboard::PATTERN_SIDE;
pub use self::sheet::{Paper, Sheet};
