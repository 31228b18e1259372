//! A matrix of counts, such as a confusion matrix.

use super::frame::framed;
use crate::html::{escape, format_number};

/// Widths of the drawings, each with the class by which the style selects it.
const SIZES: [(f64, &str); 3] = [(320.0, "narrow"), (440.0, "medium"), (720.0, "wide")];
const ROW_HEIGHT: f64 = 30.0;
/// Gap between neighbouring cells.
const GAP: f64 = 3.0;
/// Mean width of a letter in labels, in pixels.
const LETTER_WIDTH: f64 = 6.4;
/// Sine and cosine of the angle of slanted headings.
const SLANT: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Minimum shade of a cell with a nonzero count, so that the cell is visible.
const MIN_SHADE: f64 = 0.16;

/// Counts in rows and columns, drawn as shaded cells, for example a confusion matrix.
///
/// ```
/// use sdg_report::Matrix;
///
/// let matrix = Matrix::new("Where attempts end", ["detect", "lift", "held"])
///     .good_column(2)
///     .row("seen right", [0, 1, 9])
///     .row("not seen", [2, 0, 0]);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    title: String,
    columns: Vec<String>,
    good_column: Option<usize>,
    rows: Vec<(String, Vec<usize>)>,
    caption: Option<String>,
}

impl Matrix {
    /// A matrix without rows.
    #[must_use]
    pub fn new<C: Into<String>>(title: impl Into<String>, columns: impl IntoIterator<Item = C>) -> Self {
        let columns = columns.into_iter().map(Into::into).collect();
        Self { title: title.into(), columns, good_column: None, rows: Vec::new(), caption: None }
    }

    /// Sets the column of successes; the other columns are shaded as failures.
    #[must_use]
    pub fn good_column(mut self, column: usize) -> Self {
        self.good_column = Some(column);
        self
    }

    /// Adds a row. Panics unless there is one count per column.
    #[must_use]
    pub fn row(mut self, label: impl Into<String>, counts: impl Into<Vec<usize>>) -> Self {
        let counts = counts.into();
        assert_eq!(counts.len(), self.columns.len(), "one count for each column");
        self.rows.push((label.into(), counts));
        self
    }

    /// Sets the text below the matrix.
    #[must_use]
    pub fn caption(mut self, caption: impl Into<String>) -> Self {
        self.caption = Some(caption.into());
        self
    }

    pub(crate) fn to_html(&self) -> String {
        let drawings = SIZES.into_iter().map(|(width, class)| self.to_svg(width, class));
        framed("chart matrix", &self.title, "", drawings, self.caption.as_deref())
    }

    fn to_svg(&self, width: f64, class: &str) -> String {
        let longest = |labels: &mut dyn Iterator<Item = &String>| {
            LETTER_WIDTH * labels.map(|label| label.chars().count()).max().unwrap_or(0) as f64
        };
        let longest_heading = longest(&mut self.columns.iter());
        let left = longest(&mut self.rows.iter().map(|(label, _)| label)).min(0.45 * width) + 10.0;
        // Slanted headings extend beyond the right edge of their column.
        let fits = |room: f64| longest_heading + 8.0 <= room / self.columns.len().max(1) as f64;
        let slanted = !fits(width - left);
        let right = if slanted { width - SLANT * longest_heading * 0.55 } else { width };
        let step = (right - left) / self.columns.len().max(1) as f64;
        let top = if slanted { SLANT * longest_heading + 14.0 } else { 20.0 };
        let height = top + ROW_HEIGHT * self.rows.len() as f64;

        let mut svg = format!(
            "<svg class=\"{class}\" viewBox=\"0 0 {width} {height:.1}\" role=\"img\" aria-label=\"{}\">",
            escape(&self.description())
        );
        for (column, heading) in self.columns.iter().enumerate() {
            let (x, y) = (left + step * (column as f64 + 0.5), top - 8.0);
            let placed = if slanted {
                format!("text-anchor=\"start\" transform=\"rotate(-45 {x:.1} {y:.1})\"")
            } else {
                "text-anchor=\"middle\"".to_owned()
            };
            svg += &format!("<text x=\"{x:.1}\" y=\"{y:.1}\" {placed}>{}</text>", escape(heading));
        }
        for (row, (label, counts)) in self.rows.iter().enumerate() {
            let y = top + ROW_HEIGHT * row as f64;
            let baseline = y + ROW_HEIGHT / 2.0 + 3.0;
            svg += &format!("<text x=\"0\" y=\"{baseline:.1}\">{}</text>", escape(label));
            let total: usize = counts.iter().sum();
            for (column, &count) in counts.iter().enumerate() {
                svg += &self.cell(left + step * column as f64, y, step, column, count, total);
            }
        }
        svg + "</svg>"
    }

    fn cell(&self, x: f64, y: f64, step: f64, column: usize, count: usize, total: usize) -> String {
        let tone = match (count, self.good_column) {
            (0, _) => "none",
            (_, Some(good)) if good == column => "good",
            (_, Some(_)) => "bad",
            (_, None) => "plain",
        };
        let share = count as f64 / total.max(1) as f64;
        let shade = if count == 0 { 1.0 } else { MIN_SHADE + (1.0 - MIN_SHADE) * share };
        // Above this shade, the number is on a dark background (in the dark theme, on a light one).
        let ink = if count > 0 && shade > 0.55 { " on" } else { "" };
        format!(
            "<rect class=\"cell {tone}\" x=\"{:.1}\" y=\"{y:.1}\" width=\"{:.1}\" height=\"{:.1}\" rx=\"3\" \
             fill-opacity=\"{shade:.2}\"/><text class=\"count {tone}{ink}\" x=\"{:.1}\" y=\"{:.1}\" \
             text-anchor=\"middle\">{count}</text>",
            x + GAP / 2.0,
            step - GAP,
            ROW_HEIGHT - GAP,
            x + step / 2.0,
            y + ROW_HEIGHT / 2.0 + 3.0
        )
    }

    /// The nonzero counts in words, for screen readers.
    fn description(&self) -> String {
        let mut text = format!("{}.", self.title);
        for (label, counts) in &self.rows {
            let named: Vec<String> = self
                .columns
                .iter()
                .zip(counts)
                .filter(|(_, count)| **count > 0)
                .map(|(column, count)| format!("{column} {}", format_number(*count as f64, 0)))
                .collect();
            let named = if named.is_empty() { "nothing".to_owned() } else { named.join(", ") };
            text += &format!(" {label}: {named}.");
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::html_checker::assert_well_formed;

    fn matrix() -> Matrix {
        Matrix::new("Where <attempts> end", ["detect", "approach & close", "held"])
            .good_column(2)
            .row("seen right", [0, 1, 9])
            .row("<not seen>", [2, 0, 0])
            .caption("of \"twelve\"")
    }

    #[test]
    fn every_count_is_drawn_once_a_size() {
        let html = matrix().to_html();
        assert_well_formed(&html);
        // Three widths of six cells.
        assert_eq!(html.matches("<rect").count(), 18);
        assert_eq!(html.matches("class=\"cell good\"").count(), 3);
        assert_eq!(html.matches("class=\"cell bad\"").count(), 6);
        assert!(html.contains("seen right: approach &amp; close 1, held 9. &lt;not seen&gt;: detect 2."));
    }

    #[test]
    fn the_shade_grows_with_the_share() {
        let svg = matrix().to_svg(720.0, "wide");
        // 9 of 10 and 1 of 10: 0.16 + 0.84 · fraction.
        assert!(svg.contains("fill-opacity=\"0.92\"") && svg.contains("fill-opacity=\"0.24\""), "{svg}");
    }

    #[test]
    fn an_empty_matrix_does_not_panic() {
        let none: [&str; 0] = [];
        assert_well_formed(&Matrix::new("empty", none).to_html());
        assert_well_formed(&Matrix::new("empty", none).row("x", []).to_html());
    }

    #[test]
    #[should_panic(expected = "one count for each column")]
    fn a_short_row_is_a_mistake() {
        let _ = Matrix::new("m", ["a", "b"]).row("x", [1]);
    }
}
