//! Tables of attempts: the number of held parts, and the steps at which other attempts ended.

use sdg_report::{Cell, Column, Table, Tone};

use super::titled::{Titled, number, share, ways};
use crate::simulated::paper;
use crate::simulated::records::AttemptRecord;
use crate::simulated::summary::{Figures, Summary};
use crate::statistics::Share;

/// The success, as in the paper's Table II.
pub(super) fn success(summary: &Summary) -> Titled {
    let mut table = Table::new(vec![
        Column::text("model"),
        Column::text("held"),
        Column::number("success").unit("%"),
        Column::text("95 % interval"),
        Column::text("at the first look").group("held"),
        Column::text("after further looks").group("held"),
        Column::text("held").group("network alone"),
        Column::number("success").unit("%").group("network alone"),
        Column::number("success").unit("%").group("paper"),
    ]);
    for model in &summary.models {
        let figures = &model.verified;
        let alone = model.alone.as_ref().map_or(Share::default(), |alone| alone.held);
        table = table.row(vec![
            Cell::text(model.model.letter()),
            share(figures.held, Tone::Plain),
            number(figures.held.percent(), 1),
            Cell::text(interval(figures)),
            share(figures.held_at_first_look, Tone::Plain),
            share(figures.held_after_further_looks(), Tone::Plain),
            share(alone, Tone::Plain),
            number(alone.percent(), 1),
            number(paper::row(model.model).map(|row| row.success_percent), 1),
        ]);
    }
    let lead = format!(
        "Table II of the paper: {} grasp attempts on each part from random poses, robot starts, lights and other \
         objects, the same for every model. Held means hanging between both fingers one second after lifting. The interval \
         is Wilson's. At the first look: found in the first picture from the look-out pose and in the first from above it; \
         otherwise the camera was moved for another picture.",
        summary.settings.attempts
    );
    Titled { title: "Success".to_owned(), lead, table }
}

/// Success of each model on each part.
pub(super) fn by_part(summary: &Summary) -> Titled {
    let mut columns = vec![Column::text("part")];
    columns.extend(summary.models.iter().map(|model| Column::text(model.model.letter())));
    let mut table = Table::new(columns);
    let mut objects: Vec<&str> = Vec::new();
    for cell in &summary.cells {
        if !objects.contains(&cell.object.as_str()) {
            objects.push(&cell.object);
        }
    }
    for object in objects {
        let mut row = vec![Cell::text(object.replace('_', " "))];
        row.extend(summary.models.iter().map(|model| {
            let cell = summary.cells.iter().find(|cell| cell.model == model.model && cell.object == object);
            let held = cell.map_or(Share::default(), |cell| cell.verified.held);
            let tone = match held.percent() {
                Some(percent) if percent >= 95.0 => Tone::Good,
                Some(percent) if percent < 80.0 => Tone::Bad,
                _ => Tone::Warning,
            };
            share(held, tone)
        }));
        table = table.row(row);
    }
    let mut all = vec![Cell::text("all")];
    all.extend(summary.models.iter().map(|model| share(model.verified.held, Tone::Plain)));
    Titled {
        title: "Held, by part".to_owned(),
        lead: "With the check against the demonstration.".to_owned(),
        table: table.summary(all),
    }
}

/// The steps at which failed attempts ended.
pub(super) fn failures(summary: &Summary) -> Titled {
    let steps: Vec<&str> = AttemptRecord::steps().collect();
    let mut columns = vec![Column::text("model"), Column::text("failed")];
    columns.extend(steps.iter().map(|step| Column::number(*step)));
    let mut table = Table::new(columns);
    for model in &summary.models {
        for (name, figures) in ways(model) {
            if figures.held.of == 0 {
                continue;
            }
            let failed = Share { count: figures.held.of - figures.held.count, of: figures.held.of };
            let mut row = vec![Cell::text(name), share(failed, Tone::Plain)];
            row.extend(steps.iter().map(|step| {
                let count = figures.failures_by_step.get(*step).copied().unwrap_or(0);
                Cell::number(count as f64, 0)
            }));
            table = table.row(row);
        }
    }
    Titled {
        title: "Failures, by step".to_owned(),
        lead: "The step at which each failed attempt ended. \"teach\": there was no model to try.".to_owned(),
        table,
    }
}

fn interval(figures: &Figures) -> String {
    if figures.held.of == 0 {
        return "–".to_owned();
    }
    let [low, high] = figures.held_interval.map(|share| 100.0 * share);
    format!("{low:.1} to {high:.1}")
}
