//! The paper's two tables with this project's results, and more detailed tables. The Markdown document and the page
//! have the same rows.

mod document;
mod grasping;
mod looking;
mod models;
mod titled;

use sdg_report::{Cell, Column, Table, Tone};

use super::groups::PartGroup;
use super::records::TeachingRecord;
use super::summary::{Figures, Summary};
use crate::statistics::Share;

pub use titled::Titled;
pub(super) use titled::{number, share};

pub(super) use document::{document, incomplete, this_run};

/// All tables, the most important first.
pub fn tables(summary: &Summary) -> Vec<Titled> {
    let mut tables = vec![
        grasping::success(summary),
        grasping::by_part(summary),
        grasping::failures(summary),
        looking::accuracy(summary),
        looking::false_alarms(summary),
        models::costs(summary),
        models::models(summary),
        cells(summary),
    ];
    if summary.cells.iter().any(|cell| matches!(cell.teaching, Some(TeachingRecord::Failed { .. }))) {
        tables.push(models::not_taught(summary));
    }
    if summary.group == PartGroup::HeldOut {
        for titled in &mut tables {
            titled.title = format!("{}: {}", summary.group.title(), titled.title.to_lowercase());
        }
    }
    tables
}

/// The tables as a document, group by group; `facts` are the settings for reproducing the results.
pub fn markdown(summaries: &[Summary], facts: &[(&str, String)], command: &str) -> String {
    let notice = summaries.first().and_then(notice);
    document("Evaluation", notice, summaries.iter().flat_map(tables), facts, command)
}

/// A notice that precedes the tables, if results are missing.
pub fn notice(summary: &Summary) -> Option<String> {
    incomplete(summary.remaining)
}

/// A table of every cell.
fn cells(summary: &Summary) -> Titled {
    let mut table = Table::new(vec![
        Column::text("part"),
        Column::text("model"),
        Column::number("teaching").unit("s"),
        Column::text("held").group("verified"),
        Column::text("right").group("verified"),
        Column::text("false alarms").group("verified"),
        Column::number("median").unit("mm").group("verified"),
        Column::text("held").group("alone"),
        Column::text("right").group("alone"),
        Column::text("false alarms").group("alone"),
        Column::number("median").unit("mm").group("alone"),
    ]);
    let mut cells: Vec<_> = summary.cells.iter().collect();
    // The sort is stable: models keep their order within a part.
    cells.sort_by(|a, b| a.object.cmp(&b.object));
    for cell in cells {
        let teaching = match &cell.teaching {
            Some(TeachingRecord::Taught { facts, .. }) => Cell::number(facts.seconds, 0),
            Some(TeachingRecord::Failed { .. }) => Cell::text("failed"),
            None => Cell::missing(),
        };
        let mut row = vec![Cell::text(cell.object.replace('_', " ")), Cell::text(cell.model.letter()), teaching];
        for figures in [Some(&cell.verified), cell.alone.as_ref()] {
            let counted =
                |pick: fn(&Figures) -> Share| figures.map_or(Cell::missing(), |f| share(pick(f), Tone::Plain));
            row.extend([
                counted(|f| f.held),
                counted(|f| f.right),
                counted(|f| f.false_alarms),
                number(figures.and_then(|f| f.median_mm), 2),
            ]);
        }
        table = table.row(row);
    }
    Titled { title: "Every part and model".to_owned(), lead: "Components of the sums above.".to_owned(), table }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulated::summary::ModelSummary;
    use crate::{CellSummary, Settings, wilson_interval};
    use sdg_grasp::ModelKind;
    use std::collections::BTreeMap;

    fn figures(count: usize, of: usize) -> Figures {
        let held = Share { count, of };
        Figures {
            held,
            held_interval: wilson_interval(held),
            held_at_first_look: Share { count: count.saturating_sub(2), of },
            failures_by_step: BTreeMap::from([("lift".to_owned(), of - count)]),
            right: Share { count: 24, of: 25 },
            median_mm: Some(0.654),
            false_alarms: Share { count: 1, of: 25 },
            frames_per_second: Some(12.34),
            ..Figures::default()
        }
    }

    fn summary() -> Summary {
        let why = "the network | finds nothing".to_owned();
        let cell = CellSummary {
            model: ModelKind::B,
            object: "rod_end".into(),
            teaching: Some(TeachingRecord::Failed { why }),
            verified: figures(9, 10),
            alone: Some(Figures::default()),
            failures: Vec::new(),
            failures_alone: Vec::new(),
        };
        let model = ModelSummary {
            model: ModelKind::B,
            network: ModelKind::C,
            taught: Share { count: 0, of: 1 },
            samples: Some(3456.0),
            crops: None,
            teaching_secs: Some(151.6),
            longest_teaching_secs: Some(151.6),
            largest_bytes: Some(8_912_345),
            verified: figures(9, 10),
            alone: Some(Figures::default()),
        };
        Summary {
            group: PartGroup::Paper,
            settings: Settings::for_test(1, 10, 25),
            remaining: 0,
            unverified: false,
            models: vec![model],
            cells: vec![cell],
        }
    }

    #[test]
    fn rows_stand_beside_the_paper_s() {
        let text = markdown(&[summary()], &[("seed", "1".to_owned())], "sdg evaluate --seed 1");
        assert!(text.contains("| B | 9 of 10 | 90.0 | 59.6 to 98.2 | 7 of 10 | 2 of 10 | – | – | 82.5 |"), "{text}");
        assert!(text.contains("| B | 3456 | 2:32 | 8.91 | 12.3 | 1500 | 7:30 | 450 | 20 |"), "{text}");
        assert!(text.contains("B reads the network taught for C, which is taught once."));
        assert!(text.contains("| rod end | 9 of 10 |\n| all | 9 of 10 |"), "{text}");
        // There is one failure, at the lift: the sixth step, after teach, detect, hover, approach and close.
        assert!(text.contains("| B | 1 of 10 | 0 | 0 | 0 | 0 | 0 | 1 | 0 | 0 |"), "{text}");
        assert!(text.contains("| B | 24 of 25 | 96.0 | 0.65 | – | – | – | 12.3 |"), "{text}");
        assert!(text.contains("the network \\| finds nothing"), "{text}");
        assert!(text.contains("- seed: 1\n\n```\nsdg evaluate --seed 1\n```\n") && !text.contains("Not complete"));
    }

    #[test]
    fn held_out_parts_stand_apart() {
        let held_out = Summary { group: PartGroup::HeldOut, ..summary() };
        let text = markdown(&[summary(), held_out], &[], "sdg evaluate");
        let (paper, apart) = (text.find("## Success").unwrap(), text.find("## Held-out parts: success").unwrap());
        assert!(paper < apart && text[apart..].contains("| B | 9 of 10 |"), "{text}");
    }

    #[test]
    fn what_is_missing_is_told_first() {
        let text = markdown(&[Summary { remaining: 3, ..summary() }], &[], "sdg evaluate");
        assert!(text.starts_with("# Evaluation\n\n**Not complete: 3 units"), "{text}");
    }
}
