//! Tables of pictures: errors of detections, and false alarms.

use sdg_report::{Cell, Column, Table, Tone};

use super::titled::{Titled, number, share, ways};
use crate::simulated::summary::Summary;
use crate::trial::{RIGHT_DEGREES, RIGHT_MM};

/// Detections compared with the simulator's ground truth.
pub(super) fn accuracy(summary: &Summary) -> Titled {
    let mut table = Table::new(vec![
        Column::text("model"),
        Column::text("right"),
        Column::number("right").unit("%"),
        Column::number("median").unit("mm").group("position"),
        Column::number("90 %").unit("mm").group("position"),
        Column::number("median").unit("°").group("angle"),
        Column::number("90 %").unit("°").group("angle"),
        Column::number("images per second"),
    ]);
    for model in &summary.models {
        for (name, figures) in ways(model) {
            table = table.row(vec![
                Cell::text(name),
                share(figures.right, Tone::Plain),
                number(figures.right.percent(), 1),
                number(figures.median_mm, 2),
                number(figures.p90_mm, 2),
                number(figures.median_deg, 2),
                number(figures.p90_deg, 2),
                number(figures.frames_per_second, 1),
            ]);
        }
    }
    Titled {
        title: "Detection errors".to_owned(),
        lead: format!(
            "{} unseen pictures of each part from the look-out pose. Right: found within {RIGHT_MM:.0} mm and \
             {RIGHT_DEGREES:.0}°. Errors are of all detections, right or wrong, modulo the part's symmetry. \
             \"alone\": without the check against the demonstration.",
            summary.settings.views
        ),
        table,
    }
}

/// Detections in pictures without the part.
pub(super) fn false_alarms(summary: &Summary) -> Titled {
    let mut table =
        Table::new(vec![Column::text("model"), Column::text("false alarms"), Column::text("false alarms, alone")]);
    for model in &summary.models {
        let tone = if model.verified.false_alarms.count == 0 { Tone::Good } else { Tone::Bad };
        table = table.row(vec![
            Cell::text(model.model.letter()),
            share(model.verified.false_alarms, tone),
            model.alone.as_ref().map_or(Cell::missing(), |alone| share(alone.false_alarms, Tone::Plain)),
        ]);
    }
    Titled {
        title: "Pictures without the part".to_owned(),
        lead: format!(
            "{} pictures for each part with unseen objects and with objects that resemble parts; every second one also \
             shows another shipped part.",
            summary.settings.scenes
        ),
        table,
    }
}
