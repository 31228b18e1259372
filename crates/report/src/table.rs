//! Tables with aligned numbers.

use crate::html::{escape, format_number};

/// The rating of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Tone {
    /// No rating: without colour.
    #[default]
    Plain,
    /// Good.
    Good,
    /// Needs attention.
    Warning,
    /// Bad.
    Bad,
}

impl Tone {
    pub(crate) fn class(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::Good => "good",
            Self::Warning => "warning",
            Self::Bad => "bad",
        }
    }
}

/// The contents of a cell.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// Text.
    Text(String),
    /// A number with fixed decimals; a dash if it is not finite.
    Number {
        /// The number.
        value: f64,
        /// Number of decimals.
        decimals: usize,
    },
    /// A verdict in a word or two, with the reason below.
    Verdict {
        /// Colour of the verdict.
        tone: Tone,
        /// The verdict.
        text: String,
        /// The reason, if any.
        note: Option<String>,
    },
    /// Progress in a number of steps.
    Progress {
        /// Number of finished steps.
        done: usize,
        /// Total number of steps.
        total: usize,
        /// Name of the step that was reached.
        label: String,
    },
}

impl Cell {
    /// Text.
    #[must_use]
    pub fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    /// A number with fixed decimals.
    #[must_use]
    pub fn number(value: f64, decimals: usize) -> Self {
        Self::Number { value, decimals }
    }

    /// A dash, for a missing value.
    #[must_use]
    pub fn missing() -> Self {
        Self::Number { value: f64::NAN, decimals: 0 }
    }

    fn to_html(&self) -> String {
        match self {
            Self::Text(text) => escape(text),
            Self::Number { value, decimals } => format_number(*value, *decimals),
            Self::Verdict { tone, text, note } => {
                let mut html = format!("<span class=\"badge {}\">{}</span>", tone.class(), escape(text));
                if let Some(note) = note {
                    html += &format!("<span class=\"note\">{}</span>", escape(note));
                }
                html
            }
            Self::Progress { done, total, label } => {
                let dots: String =
                    (0..*total).map(|step| if step < *done { "<i class=\"on\"></i>" } else { "<i></i>" }).collect();
                format!("<span class=\"steps\">{dots}<b>{}</b></span>", escape(label))
            }
        }
    }

    fn to_markdown(&self) -> String {
        match self {
            Self::Text(text) => escape_markdown(text),
            Self::Number { value, decimals } => format_number(*value, *decimals),
            Self::Verdict { text, note: None, .. } => escape_markdown(text),
            Self::Verdict { text, note: Some(note), .. } => escape_markdown(&format!("{text} ({note})")),
            Self::Progress { done, total, label } => escape_markdown(&format!("{done} of {total}, {label}")),
        }
    }
}

/// Text for a table cell: on one line, with escaped bars.
fn escape_markdown(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|")
}

/// A column: its heading, unit and group.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    heading: String,
    unit: Option<String>,
    group: Option<String>,
    numeric: bool,
}

impl Column {
    /// A column of text, aligned left.
    #[must_use]
    pub fn text(heading: impl Into<String>) -> Self {
        Self { heading: heading.into(), unit: None, group: None, numeric: false }
    }

    /// A column of numbers, aligned right.
    #[must_use]
    pub fn number(heading: impl Into<String>) -> Self {
        Self { numeric: true, ..Self::text(heading) }
    }

    /// Adds a unit beside the heading.
    #[must_use]
    pub fn unit(mut self, unit: impl Into<String>) -> Self {
        self.unit = Some(unit.into());
        self
    }

    /// Puts the column into a group; neighbours in the same group have a common heading.
    #[must_use]
    pub fn group(mut self, group: impl Into<String>) -> Self {
        self.group = Some(group.into());
        self
    }

    fn to_markdown(&self) -> String {
        let group = self.group.as_ref().map(|group| format!("{group}: ")).unwrap_or_default();
        let unit = self.unit.as_ref().map(|unit| format!(", {unit}")).unwrap_or_default();
        escape_markdown(&format!("{group}{}{unit}", self.heading))
    }

    fn class(&self) -> &'static str {
        if self.numeric { " class=\"number\"" } else { "" }
    }
}

/// Rows below headed columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    caption: Option<String>,
    columns: Vec<Column>,
    rows: Vec<Vec<Cell>>,
    summary: Option<Vec<Cell>>,
}

impl Table {
    /// A table without rows.
    #[must_use]
    pub fn new(columns: Vec<Column>) -> Self {
        Self { caption: None, columns, rows: Vec::new(), summary: None }
    }

    /// Sets the text below the table.
    #[must_use]
    pub fn caption(mut self, caption: impl Into<String>) -> Self {
        self.caption = Some(caption.into());
        self
    }

    /// Adds a row.
    ///
    /// # Panics
    /// If the number of cells differs from the number of columns.
    #[must_use]
    pub fn row(mut self, cells: Vec<Cell>) -> Self {
        self.check(&cells);
        self.rows.push(cells);
        self
    }

    /// Sets the last row, which is separated from the other rows: medians or totals.
    ///
    /// # Panics
    /// If the number of cells differs from the number of columns.
    #[must_use]
    pub fn summary(mut self, cells: Vec<Cell>) -> Self {
        self.check(&cells);
        self.summary = Some(cells);
        self
    }

    fn check(&self, cells: &[Cell]) {
        assert_eq!(cells.len(), self.columns.len(), "a row has one cell for each column");
    }

    pub(crate) fn to_html(&self) -> String {
        // The element scrolls horizontally on a small screen; tabindex makes it scrollable by keyboard.
        let mut html = String::from("<figure class=\"table\"><div class=\"scroll\" tabindex=\"0\"><table><thead>");
        if self.columns.iter().any(|column| column.group.is_some()) {
            html += "<tr class=\"groups\">";
            for run in self.columns.chunk_by(|a, b| a.group.is_some() && a.group == b.group) {
                match &run[0].group {
                    Some(group) => {
                        html += &format!(
                            "<th colspan=\"{}\" scope=\"colgroup\"><span>{}</span></th>",
                            run.len(),
                            escape(group)
                        );
                    }
                    None => html += "<td></td>",
                }
            }
            html += "</tr>";
        }
        html += "<tr>";
        for column in &self.columns {
            html += &format!("<th scope=\"col\"{}>{}", column.class(), escape(&column.heading));
            if let Some(unit) = &column.unit {
                html += &format!(" <span class=\"unit\">{}</span>", escape(unit));
            }
            html += "</th>";
        }
        html += "</tr></thead><tbody>";
        for row in &self.rows {
            html += &self.row_to_html(row);
        }
        html += "</tbody>";
        if let Some(summary) = &self.summary {
            html += &format!("<tfoot>{}</tfoot>", self.row_to_html(summary));
        }
        html += "</table></div>";
        if let Some(caption) = &self.caption {
            html += &format!("<figcaption>{}</figcaption>", escape(caption));
        }
        html + "</figure>"
    }

    /// The table as Markdown, with its caption below. The heading of a grouped column contains the group's heading.
    #[must_use]
    pub fn to_markdown(&self) -> String {
        let headings: Vec<String> = self.columns.iter().map(Column::to_markdown).collect();
        let rules: Vec<&str> = self.columns.iter().map(|column| if column.numeric { "--:" } else { "---" }).collect();
        let mut markdown = format!("| {} |\n| {} |\n", headings.join(" | "), rules.join(" | "));
        for row in self.rows.iter().chain(&self.summary) {
            let cells: Vec<String> = row.iter().map(Cell::to_markdown).collect();
            markdown += &format!("| {} |\n", cells.join(" | "));
        }
        if let Some(caption) = &self.caption {
            markdown += &format!("\n{}\n", escape_markdown(caption));
        }
        markdown
    }

    fn row_to_html(&self, cells: &[Cell]) -> String {
        let cells: String = cells
            .iter()
            .zip(&self.columns)
            .map(|(cell, column)| format!("<td{}>{}</td>", column.class(), cell.to_html()))
            .collect();
        format!("<tr>{cells}</tr>")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::html_checker::assert_well_formed;

    fn table() -> Table {
        Table::new(vec![
            Column::text("part"),
            Column::number("x").unit("mm").group("pose"),
            Column::number("y").unit("mm").group("pose"),
            Column::text("outcome"),
        ])
    }

    #[test]
    fn neighbours_share_a_group_heading() {
        let html = table().to_html();
        assert_well_formed(&html);
        assert!(html.contains(
            "<tr class=\"groups\"><td></td><th colspan=\"2\" scope=\"colgroup\"><span>pose</span></th><td></td></tr>"
        ));
    }

    #[test]
    fn cells_are_formatted_and_escaped() {
        let verdict = Cell::Verdict { tone: Tone::Bad, text: "<lost>".into(), note: Some("a & b".into()) };
        let html = table()
            .row(vec![Cell::text("<i>"), Cell::number(-1.5, 2), Cell::missing(), verdict])
            .summary(vec![
                Cell::Progress { done: 2, total: 3, label: "hover".into() },
                Cell::number(1.0, 1),
                Cell::number(2.0, 0),
                Cell::text(""),
            ])
            .caption("<all>")
            .to_html();
        assert_well_formed(&html);
        assert!(html.contains("&lt;i&gt;") && html.contains("\u{2212}1.50") && html.contains(">–<"));
        assert!(html.contains("badge bad\">&lt;lost&gt;") && html.contains("a &amp; b"));
        assert_eq!(html.matches("<i class=\"on\"></i>").count(), 2);
    }

    #[test]
    fn markdown_has_the_same_rows() {
        let verdict = Cell::Verdict { tone: Tone::Bad, text: "lost".into(), note: Some("a | b\nc".into()) };
        let markdown = table()
            .row(vec![Cell::text("rod end"), Cell::number(-1.5, 1), Cell::missing(), verdict])
            .summary(vec![
                Cell::text("all"),
                Cell::number(1.0, 0),
                Cell::number(2.0, 0),
                Cell::Progress { done: 2, total: 3, label: "hover".into() },
            ])
            .caption("As measured.")
            .to_markdown();
        assert_eq!(
            markdown,
            "| part | pose: x, mm | pose: y, mm | outcome |\n| --- | --: | --: | --- |\n\
             | rod end | \u{2212}1.5 | – | lost (a \\| b c) |\n| all | 1 | 2 | 2 of 3, hover |\n\nAs measured.\n"
        );
    }

    #[test]
    #[should_panic(expected = "one cell for each column")]
    fn a_short_row_is_a_mistake() {
        let _ = table().row(vec![Cell::text("a")]);
    }
}
