//! The printed board, as SVG and as PDF.
//!
//! Units: millimetres from the lower left of the paper, y up. Both files contain the same shapes; for SVG, whose y
//! points down, y is converted. Below the board are its data and a line of 100 mm for checking with a ruler.

use std::fmt::Write;

use super::checkerboard::Board;
use crate::error::CalibrationError;

/// A paper size, in landscape format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Paper {
    /// 297 × 210 mm.
    A4,
    /// 420 × 297 mm.
    A3,
    /// 279.4 × 215.9 mm.
    Letter,
}

impl Paper {
    /// All paper sizes.
    pub const ALL: [Self; 3] = [Self::A4, Self::A3, Self::Letter];

    /// Width and height in millimetres.
    pub fn size_mm(self) -> [f64; 2] {
        match self {
            Self::A4 => [297.0, 210.0],
            Self::A3 => [420.0, 297.0],
            Self::Letter => [279.4, 215.9],
        }
    }

    /// The name in the sheet's description and at the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::A4 => "a4",
            Self::A3 => "a3",
            Self::Letter => "letter",
        }
    }
}

/// Margin at each side that office printers cannot print on.
const MARGIN_MM: f64 = 8.0;
/// Height of the area below the board for its data.
const FOOTER_MM: f64 = 30.0;
/// Length of the printed line for checking the scale with a ruler.
const RULER_MM: f64 = 100.0;
const MM_PER_INCH: f64 = 25.4;
const POINTS_PER_INCH: f64 = 72.0;

/// A board on paper.
#[derive(Debug, Clone, PartialEq)]
pub struct Sheet {
    board: Board,
    paper: Paper,
    shapes: Vec<Shape>,
}

#[derive(Debug, Clone, PartialEq)]
enum Shape {
    /// A filled rectangle: lower left corner, width and height, in mm.
    Rectangle { x: f64, y: f64, width: f64, height: f64 },
    /// A filled circle, in mm.
    Disc { x: f64, y: f64, radius: f64, is_dark: bool },
    /// Text from its lower left corner; size in mm.
    Text { x: f64, y: f64, size: f64, text: String },
}

impl Sheet {
    /// The largest side of squares that fit on the paper, in steps of 5 mm.
    ///
    /// # Errors
    /// [`CalibrationError::Paper`] if not even 5 mm fit.
    pub fn square_m_that_fits(columns: u32, rows: u32, paper: Paper) -> Result<f64, CalibrationError> {
        let [width, height] = room_mm(paper);
        let side = (width / f64::from(columns)).min(height / f64::from(rows));
        let whole = (side / 5.0).floor() * 5.0;
        if whole < 5.0 {
            return Err(CalibrationError::Paper { paper: paper.name(), columns, rows, square_mm: 5.0, fits_mm: side });
        }
        Ok(whole / 1000.0)
    }

    /// Places a board on the paper.
    ///
    /// # Errors
    /// [`CalibrationError::Paper`] if it does not fit.
    pub fn new(board: Board, paper: Paper) -> Result<Self, CalibrationError> {
        let [paper_width, paper_height] = paper.size_mm();
        let square = 1000.0 * board.square_m();
        let (columns, rows) = (board.columns(), board.rows());
        let [width, height] = [columns, rows].map(|side| f64::from(side) * square);
        let [room_x, room_y] = room_mm(paper);
        if width > room_x || height > room_y {
            let fits_mm = (room_x / f64::from(columns)).min(room_y / f64::from(rows));
            return Err(CalibrationError::Paper { paper: paper.name(), columns, rows, square_mm: square, fits_mm });
        }
        let left = 0.5 * (paper_width - width);
        // The remaining space is divided equally above and below the board.
        let bottom = FOOTER_MM + 0.5 * (paper_height - MARGIN_MM - FOOTER_MM - height);
        let mut shapes = Vec::new();
        let squares = || (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
        for (column, row) in squares().filter(|(column, row)| Board::is_dark(*column, *row)) {
            let [x, y] = [left + f64::from(column) * square, bottom + f64::from(row) * square];
            shapes.push(Shape::Rectangle { x, y, width: square, height: square });
        }
        for (column, row) in squares().filter(|(column, row)| Board::has_dot(*column, *row)) {
            let [x, y] = [left + (f64::from(column) + 0.5) * square, bottom + (f64::from(row) + 0.5) * square];
            let is_dark = !Board::is_dark(column, row);
            shapes.push(Shape::Disc { x, y, radius: Board::DOT_RADIUS * square, is_dark });
        }
        footer(&mut shapes, &board, left, bottom);
        Ok(Self { board, paper, shapes })
    }

    /// The board's description in both files, such as `sdg-board squares=9x6 square_mm=25 paper=a4`.
    pub fn facts(&self) -> String {
        let (columns, rows, square_m) = (self.board.columns(), self.board.rows(), self.board.square_m());
        format!(
            "sdg-board squares={columns}x{rows} square_mm={} paper={}",
            trimmed(1000.0 * square_m),
            self.paper.name()
        )
    }

    /// Reads the board from a file of [`Self::to_svg`] or [`Self::to_pdf`].
    ///
    /// # Errors
    /// [`CalibrationError::NoBoardFile`] if the file does not contain the description; the errors of [`Board::new`].
    pub fn board_of(file: &str) -> Result<Board, CalibrationError> {
        let facts =
            file.split_once("sdg-board squares=").map(|(_, facts)| facts).ok_or(CalibrationError::NoBoardFile)?;
        let read = || {
            let (squares, further) = facts.split_once(" square_mm=")?;
            let (columns, rows) = squares.split_once('x')?;
            let millimetres = further.split_once(' ')?.0;
            Some((columns.parse().ok()?, rows.parse().ok()?, millimetres.parse::<f64>().ok()?))
        };
        let (columns, rows, square_mm) = read().ok_or(CalibrationError::NoBoardFile)?;
        Board::new(columns, rows, square_mm / 1000.0)
    }

    /// The sheet as SVG, in millimetres.
    pub fn to_svg(&self) -> String {
        let [width, height] = self.paper.size_mm();
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" viewBox=\"0 0 {width} {height}\">\n\
             <title>{facts}</title>\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n",
            facts = self.facts()
        );
        for shape in &self.shapes {
            // Writing to a string cannot fail.
            let _ = match shape {
                Shape::Rectangle { x, y, width: w, height: h } => {
                    let [x, y, w, h] = [*x, height - y - h, *w, *h].map(trimmed);
                    writeln!(svg, "<rect x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\"/>")
                }
                Shape::Disc { x, y, radius, is_dark } => {
                    let [x, y, radius] = [*x, height - y, *radius].map(trimmed);
                    let fill = if *is_dark { "black" } else { "white" };
                    writeln!(svg, "<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" fill=\"{fill}\"/>")
                }
                Shape::Text { x, y, size, text } => {
                    let [x, y] = [*x, height - y].map(trimmed);
                    writeln!(
                        svg,
                        "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\" font-family=\"Helvetica, sans-serif\">{text}</text>"
                    )
                }
            };
        }
        svg.push_str("</svg>\n");
        svg
    }

    /// The sheet as PDF 1.7 of one page, with the request to viewers not to scale it.
    pub fn to_pdf(&self) -> Vec<u8> {
        let [width, height] = self.paper.size_mm().map(|side| side * POINTS_PER_INCH / MM_PER_INCH);
        let content = self.pdf_content();
        let facts = self.facts();
        let objects = [
            "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>".to_owned(),
            "<< /Type /Pages /Kids [3 0 R] /Count 1 >>".to_owned(),
            format!(
                "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {width:.4} {height:.4}] /Contents 4 0 R \
                 /Resources << /Font << /F 5 0 R >> >> >>"
            ),
            format!("<< /Length {} >>\nstream\n{content}endstream", content.len()),
            "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>".to_owned(),
            format!("<< /Title ({facts}) >>"),
        ];
        let mut pdf = "%PDF-1.7\n".to_owned();
        let mut offsets = Vec::new();
        for (k, object) in objects.iter().enumerate() {
            offsets.push(pdf.len());
            let _ = write!(pdf, "{} 0 obj\n{object}\nendobj\n", k + 1);
        }
        let (start, size) = (pdf.len(), objects.len() + 1);
        // Each entry of the table has 20 bytes.
        let _ = write!(pdf, "xref\n0 {size}\n0000000000 65535 f \n");
        for offset in offsets {
            let _ = writeln!(pdf, "{offset:010} 00000 n ");
        }
        let _ = write!(pdf, "trailer\n<< /Size {size} /Root 1 0 R /Info 6 0 R >>\nstartxref\n{start}\n%%EOF\n");
        pdf.into_bytes()
    }

    fn pdf_content(&self) -> String {
        let scale = POINTS_PER_INCH / MM_PER_INCH;
        let mut content = format!("{scale:.9} 0 0 {scale:.9} 0 0 cm\n");
        for shape in &self.shapes {
            let _ = match shape {
                Shape::Rectangle { x, y, width, height } => {
                    let [x, y, width, height] = [*x, *y, *width, *height].map(trimmed);
                    writeln!(content, "0 g {x} {y} {width} {height} re f")
                }
                Shape::Disc { x, y, radius, is_dark } => {
                    writeln!(content, "{} g {} f", if *is_dark { 0 } else { 1 }, pdf_circle(*x, *y, *radius))
                }
                Shape::Text { x, y, size, text } => {
                    let [x, y] = [*x, *y].map(trimmed);
                    writeln!(
                        content,
                        "0 g BT /F {size} Tf {x} {y} Td ({}) Tj ET",
                        text.replace('(', "\\(").replace(')', "\\)")
                    )
                }
            };
        }
        content
    }
}

/// Maximum width and height of a board.
fn room_mm(paper: Paper) -> [f64; 2] {
    let [width, height] = paper.size_mm();
    [width - 2.0 * MARGIN_MM, height - MARGIN_MM - FOOTER_MM]
}

fn footer(shapes: &mut Vec<Shape>, board: &Board, left: f64, bottom: f64) {
    let (columns, rows, square_m) = (board.columns(), board.rows(), board.square_m());
    // The line is 12 mm below the board, so that a white margin remains around the outer squares.
    let line = bottom - 12.0;
    let mut text = |x: f64, y: f64, size: f64, text: String| shapes.push(Shape::Text { x, y, size, text });
    text(left, bottom - 6.0, 3.5, "Origin: the corner above. x to the right, y upwards.".to_owned());
    text(
        left + RULER_MM + 4.0,
        line - 1.2,
        3.5,
        "100 mm between the ends of this line: check it with a ruler.".to_owned(),
    );
    let facts = format!(
        "sdg board, {columns} x {rows} squares of {} mm. Print at 100 %. Glue it to something flat.",
        trimmed(1000.0 * square_m)
    );
    text(left, line - 8.0, 3.5, facts);
    shapes.push(Shape::Rectangle { x: left, y: line - 0.15, width: RULER_MM, height: 0.3 });
    // The ticks are inside the line's length: a ruler measures from outer edge to outer edge.
    for x in [left, left + RULER_MM - 0.3] {
        shapes.push(Shape::Rectangle { x, y: line - 2.0, width: 0.3, height: 4.0 });
    }
}

/// Four cubic Bézier curves, with an error of 0.03 % of the circle's radius.
fn pdf_circle(x: f64, y: f64, radius: f64) -> String {
    const HANDLE: f64 = 0.552_284_75;
    let at = |u: f64, v: f64| format!("{} {}", trimmed(x + u * radius), trimmed(y + v * radius));
    let (k, start) = (HANDLE, at(1.0, 0.0));
    let quarter = |a: (f64, f64), b: (f64, f64), end: (f64, f64)| {
        format!(" {} {} {} c", at(a.0, a.1), at(b.0, b.1), at(end.0, end.1))
    };
    let curves = [
        quarter((1.0, k), (k, 1.0), (0.0, 1.0)),
        quarter((-k, 1.0), (-1.0, k), (-1.0, 0.0)),
        quarter((-1.0, -k), (-k, -1.0), (0.0, -1.0)),
        quarter((k, -1.0), (1.0, -k), (1.0, 0.0)),
    ];
    format!("{start} m{}", curves.concat())
}

/// A number with at most four decimals, without trailing zeros.
fn trimmed(value: f64) -> String {
    let text = format!("{value:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet() -> Sheet {
        Sheet::new(Board::new(9, 6, 0.025).unwrap(), Paper::A4).unwrap()
    }

    #[test]
    fn squares_stand_where_the_board_has_them() {
        let sheet = sheet();
        let squares: Vec<_> = sheet
            .shapes
            .iter()
            .filter_map(|shape| match shape {
                Shape::Rectangle { x, y, width, height } if *width == 25.0 && *height == 25.0 => Some((*x, *y)),
                _ => None,
            })
            .collect();
        assert_eq!(squares.len(), 27);
        // 297 mm minus nine squares is 72 mm: 36 mm at each side.
        assert_eq!(squares[0].0, 36.0);
        assert_eq!(squares.last().unwrap().0 - squares[0].0, 7.0 * 25.0);
        assert_eq!(squares.last().unwrap().1 - squares[0].1, 5.0 * 25.0);
    }

    #[test]
    fn both_files_tell_their_size_and_the_ruler_is_100_mm() {
        let sheet = sheet();
        let svg = sheet.to_svg();
        assert!(svg.contains("width=\"297mm\" height=\"210mm\" viewBox=\"0 0 297 210\""), "{svg}");
        assert!(svg.contains("width=\"100\" height=\"0.3\""));
        assert_eq!(Sheet::board_of(&svg), Board::new(9, 6, 0.025));
        let pdf = String::from_utf8(sheet.to_pdf()).unwrap();
        // 297 mm are 841.8898 points.
        assert!(pdf.contains("/MediaBox [0 0 841.8898 595.2756]") && pdf.contains("/PrintScaling /None"));
        assert_eq!(Sheet::board_of(&pdf), Board::new(9, 6, 0.025));
        assert_eq!(Sheet::board_of("<svg>"), Err(CalibrationError::NoBoardFile));
    }

    #[test]
    fn the_table_of_objects_leads_to_each() {
        let pdf = String::from_utf8(sheet().to_pdf()).unwrap();
        let (_, start) = pdf.rsplit_once("startxref\n").unwrap();
        let start: usize = start.lines().next().unwrap().parse().unwrap();
        let table: Vec<&str> = pdf[start..].lines().skip(3).take(6).collect();
        for (k, line) in table.iter().enumerate() {
            let offset: usize = line[..10].parse().unwrap();
            assert!(pdf[offset..].starts_with(&format!("{} 0 obj", k + 1)), "{line}");
        }
    }

    #[test]
    fn what_does_not_fit_is_refused_with_what_would() {
        assert!((Sheet::square_m_that_fits(9, 6, Paper::A4).unwrap() - 0.025).abs() < 1e-12);
        assert!((Sheet::square_m_that_fits(9, 6, Paper::A3).unwrap() - 0.040).abs() < 1e-12);
        let error = Sheet::new(Board::new(9, 6, 0.04).unwrap(), Paper::A4).unwrap_err();
        assert!(error.to_string().contains("28.7 mm"), "{error}");
    }
}
