//! The tables of a Markdown document, and the marks that name the measurements of their figures.

use crate::markdown::lines_without_code;

/// A table of a document.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    /// The number of its first line, from 1.
    pub line: usize,
    /// The title of its section.
    pub section: String,
    /// Its first line.
    pub header: String,
    /// Whether more than half of its cells begin with a number; the first column is not counted.
    pub has_figures: bool,
    /// The mark that applies to it.
    pub mark: Option<Mark>,
    /// The paragraphs of its section, and those of the enclosing sections before their first subsection.
    pub paragraphs: Vec<String>,
}

/// A comment about the table on the next line. If no table is there, it applies to the tables of the rest of its
/// section that have no mark of their own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Mark {
    /// `<!-- measured: a, b -->`: names of measurements.
    Measured(Vec<String>),
    /// `<!-- not measured: a reason -->`.
    NotMeasured(String),
}

/// A section: its level, its title, its own paragraphs, and the last mark in it that is not of a single table.
#[derive(Debug, Default)]
struct Section {
    level: usize,
    title: String,
    paragraphs: Vec<String>,
    mark: Option<Mark>,
}

/// The tables of a document, in order.
pub fn tables(document: &str) -> Vec<Table> {
    let mut sections = vec![Section::default()];
    // Indices of the current section and its parents. A section's paragraphs are complete only at the end, so each
    // table keeps these indices.
    let mut open = vec![0_usize];
    let mut found: Vec<(Table, Vec<usize>)> = Vec::new();
    let mut is_in_table = false;
    let mut paragraph = String::new();
    let lines: Vec<&str> = lines_without_code(document).collect();
    for (idx, &line) in lines.iter().enumerate() {
        let here = *open.last().unwrap_or(&0);
        let is_row = line.starts_with('|');
        let is_comment = line.trim_start().starts_with("<!--");
        let is_text = !is_row && !is_comment && !line.trim().is_empty() && !line.starts_with('#');
        if !is_text && !paragraph.is_empty() {
            sections[here].paragraphs.push(std::mem::take(&mut paragraph));
        }
        if is_row {
            if !is_in_table && lines.get(idx + 1).is_some_and(|next| is_rule(next)) {
                let own = idx.checked_sub(1).and_then(|above| mark_of(lines[above]));
                let mark = own.or_else(|| open.iter().rev().find_map(|&section| sections[section].mark.clone()));
                let rows = lines[idx + 2..].iter().take_while(|row| row.starts_with('|'));
                let table = Table {
                    line: idx + 1,
                    section: sections[here].title.clone(),
                    header: line.to_owned(),
                    has_figures: has_figures(rows),
                    mark,
                    paragraphs: Vec::new(),
                };
                found.push((table, open.clone()));
            }
        } else if line.starts_with('#') {
            let level = line.chars().take_while(|&c| c == '#').count();
            open.retain(|&section| sections[section].level < level);
            open.push(sections.len());
            let title = line.trim_start_matches('#').trim().to_owned();
            sections.push(Section { level, title, ..Section::default() });
        } else if let Some(mark) = mark_of(line) {
            if lines.get(idx + 1).is_none_or(|next| !next.starts_with('|')) {
                sections[here].mark = Some(mark);
            }
        } else if is_text {
            paragraph.push_str(line.trim());
            paragraph.push(' ');
        }
        is_in_table = is_row;
    }
    if !paragraph.is_empty() {
        sections[*open.last().unwrap_or(&0)].paragraphs.push(paragraph);
    }

    let with_text = |(mut table, path): (Table, Vec<usize>)| {
        table.paragraphs = path.iter().flat_map(|&section| sections[section].paragraphs.clone()).collect();
        table
    };
    found.into_iter().map(with_text).collect()
}

/// Whether a line separates the header of a table from its rows.
fn is_rule(line: &str) -> bool {
    line.starts_with('|') && line.contains("--") && line.chars().all(|c| matches!(c, '|' | '-' | ':' | ' '))
}

fn has_figures<'a>(rows: impl Iterator<Item = &'a &'a str>) -> bool {
    let (mut numbers, mut cells) = (0, 0);
    for row in rows {
        for cell in row.trim().trim_matches('|').split('|').skip(1).map(str::trim) {
            if cell.is_empty() || cell == "–" {
                continue;
            }
            cells += 1;
            let start = cell.trim_start_matches(|c: char| "*~<>≤≥±+−- ".contains(c));
            numbers += usize::from(start.starts_with(|c: char| c.is_ascii_digit()));
        }
    }
    2 * numbers > cells
}

/// The mark in a line; `None` for any other comment. Programs enclose the text that they write in `<!-- measured: begin
/// -->` and `<!-- measured: end -->`.
fn mark_of(line: &str) -> Option<Mark> {
    let text = line.trim().strip_prefix("<!--")?.strip_suffix("-->")?.trim();
    if let Some(reason) = text.strip_prefix("not measured:") {
        return Some(Mark::NotMeasured(reason.trim().to_owned()));
    }
    let names = text.strip_prefix("measured:")?.trim();
    let is_place = matches!(names, "begin" | "end");
    (!is_place).then(|| Mark::Measured(names.split(',').map(|name| name.trim().to_owned()).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const DOCUMENT: &str = "# A\n\nAt abc.\n\n<!-- measured: all -->\n## B\n\n<!-- measured: one, two -->\n\n\
        | x | ms |\n|---|--:|\n| a | 1 |\n| b | ~2 ms |\n\nText\nof B.\n\n### C\n\nText of C.\n\n| x | y |\n|---|---|\n| a | b |\n\n\
        ## D\n\n| x | ms |\n|---|--:|\n| a | **3** |\n\n<!-- not measured: sizes of parts -->\n| x | mm |\n|---|--:|\n| a | 4 |\n\n\
        | x | ms |\n|---|--:|\n| a | 5 |\n\n\
        ```\n| x | y |\n|---|---|\n| 1 | 1 |\n```\n";

    #[test]
    fn a_mark_applies_to_the_next_line_s_table_or_to_the_rest_of_its_section() {
        let named = |names: &[&str]| Some(Mark::Measured(names.iter().map(|&name| name.to_owned()).collect()));
        let found: Vec<_> = tables(DOCUMENT).into_iter().map(|t| (t.section, t.has_figures, t.mark)).collect();
        let expected = [
            ("B".to_owned(), true, named(&["one", "two"])),
            ("C".to_owned(), false, named(&["one", "two"])),
            ("D".to_owned(), true, named(&["all"])),
            ("D".to_owned(), true, Some(Mark::NotMeasured("sizes of parts".to_owned()))),
            ("D".to_owned(), true, named(&["all"])),
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn a_table_has_the_text_of_its_section_and_of_those_around() {
        let found = tables(DOCUMENT);
        assert_eq!(found[0].paragraphs, ["At abc. ", "Text of B. "]);
        assert_eq!(found[1].paragraphs, ["At abc. ", "Text of B. ", "Text of C. "]);
        assert_eq!(found[1].line, 22);
    }

    #[test]
    fn places_that_programs_write_are_no_marks() {
        assert_eq!(mark_of("<!-- measured: begin -->"), None);
        assert_eq!(mark_of("<!-- needs: a camera -->"), None);
    }

    #[test]
    fn figures_are_cells_that_begin_with_a_number() {
        assert!(has_figures(["| 1 | 5 of 6 | |", "| 2 | – | ≤ 0.5 mm |"].iter()));
        assert!(!has_figures(["| 1 | a 5 | 6 |", "| 2 | b | – |"].iter()));
    }
}
