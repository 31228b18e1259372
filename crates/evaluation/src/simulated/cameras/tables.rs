//! The results for calibrated cameras, as tables and as a page.

use sdg_report::{Cell, Column, KeyFigure, Report, Section, Table, Tone};

use super::summary::{CamerasSummary, HIGH_M, SetFigures};
use crate::footer::FOOTER;
use crate::simulated::tables::{Titled, document, incomplete, this_run};
use crate::teaching_page::photos;

/// All tables, the most important first.
pub fn tables(summary: &CamerasSummary) -> Vec<Titled> {
    vec![
        Titled {
            title: "By set of pictures".into(),
            lead: format!(
                "Taught from {} of the wrist camera in its plan view. Webcam, phone and overhead are other cameras with \
                 their own lenses, heights and tilts to 25 degrees; the other sets are the wrist camera's, harder along an \
                 axis; other-sizes shows parts of 0.8, 0.9, 1.1 or 1.25 times the size, which should be refused. Errors are \
                 of the detected parts, in the marks' plane; within sigma: the share within the detection's own estimate \
                 for 68 %.",
                photos(summary.photos as usize)
            ),
            table: table(&summary.sets, None),
        },
        Titled {
            title: "By the part's height".into(),
            lead: format!("The marks of low parts are at most {:.0} mm above the table.", 1e3 * HIGH_M),
            table: table(&summary.by_height, Some("parts")),
        },
        Titled {
            title: "By part".into(),
            lead: "The pictures of the three other cameras.".into(),
            table: table(&summary.by_part, Some("part")),
        },
    ]
}

/// Makes a table. `of` is the heading of a column that names the parts of a row; `None` if every row is of all parts.
fn table(rows: &[SetFigures], of: Option<&str>) -> Table {
    let mut columns = vec![Column::text("model"), Column::text("pictures")];
    columns.extend(of.map(Column::text));
    columns.extend([
        Column::text("found"),
        Column::number("wrong"),
        Column::number("median").unit("mm").group("position"),
        Column::number("95 %").unit("mm").group("position"),
        Column::text("within sigma").group("position"),
        Column::number("median").unit("°").group("angle"),
        Column::number("95 %").unit("°").group("angle"),
        Column::text("within sigma").group("angle"),
    ]);
    let mut table = Table::new(columns);
    for row in rows {
        // A line break inside the fraction is prevented.
        let whole = |share: crate::statistics::Share| share.to_string().replace(' ', "\u{a0}");
        let found = match row.found.of {
            0 => Cell::text(format!("accepted: {}", whole(row.accepted))),
            _ => Cell::text(whole(row.found)),
        };
        let within = |share: crate::statistics::Share| {
            share.percent().map_or(Cell::missing(), |percent| Cell::text(format!("{percent:.0} %")))
        };
        let number = |value: Option<f64>| value.map_or(Cell::missing(), |value| Cell::number(value, 2));
        let errors = row.errors;
        let mut cells = vec![Cell::text(row.model.letter()), Cell::text(row.set)];
        cells.extend(of.map(|_| Cell::text(row.parts.replace('_', " "))));
        cells.extend([
            found,
            Cell::number(row.wrong as f64, 0),
            number(errors.map(|errors| errors.median_mm)),
            number(errors.map(|errors| errors.p95_mm)),
            errors.map_or(Cell::missing(), |errors| within(errors.within_sigma_mm)),
            number(errors.and_then(|errors| errors.median_deg)),
            number(errors.and_then(|errors| errors.p95_deg)),
            errors.map_or(Cell::missing(), |errors| within(errors.within_sigma_deg)),
        ]);
        table = table.row(cells);
    }
    table
}

/// The tables as a document; `facts` are the settings for reproducing the results.
pub fn markdown(summary: &CamerasSummary, facts: &[(&str, String)], command: &str) -> String {
    document("Calibrated cameras", incomplete(summary.remaining), tables(summary), facts, command)
}

/// The tables as a page.
pub fn page(summary: &CamerasSummary, facts: &[(&str, String)], command: &str) -> Report {
    let mut report = Report::new("Calibrated cameras").kicker("Evaluation in simulation").lead(
        "A part taught with one camera, detected with others: detection rates, and position errors in millimetres.",
    );
    for row in summary.sets.iter().filter(|row| row.found.of > 0).take(3) {
        if let Some(errors) = row.errors {
            let label = format!("median error, model {}, {}", row.model.letter(), row.set);
            report = report.key_figure(KeyFigure::new(format!("{:.2}", errors.median_mm), "mm", label));
        }
    }
    let mut notice = incomplete(summary.remaining);
    for Titled { title, lead, table } in tables(summary) {
        let mut section = Section::new(title).lead(lead);
        if let Some(notice) = notice.take() {
            section = section.notice(Tone::Warning, notice);
        }
        report = report.section(section.table(table));
    }
    report.section(this_run(facts, command)).footer(FOOTER)
}
