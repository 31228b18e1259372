//! A summary of labelled pictures in a few lines.

use sdg_grasp::Verification;

use super::label_offset::label_offset;
use super::records::Evaluated;
use super::score::{Totals, by_kind};

/// Numbers of found and missed parts and of wrong detections, and the errors of the found parts.
pub fn summary(evaluated: &Evaluated, totals: &Totals) -> String {
    let mut text = String::new();
    let mut line = |line: String| text += &(line + "\n");
    let check = if evaluated.verification == Verification::ByShape { "with" } else { "without" };
    line(format!(
        "{}: model {}, {check} the check, scores from {} on",
        evaluated.model.object(),
        evaluated.model.kind(),
        evaluated.min_score
    ));
    if totals.clean.of > 0 {
        line(format!(
            "found {} parts, {} missed, {} wrong; clean {} pictures",
            totals.found, totals.missed, totals.wrong, totals.clean
        ));
    }
    if totals.optional.of > 0 {
        line(format!("optional: {} found", totals.optional));
    }
    if totals.false_alarms.of > 0 {
        line(format!("false alarms on {} pictures without the part", totals.false_alarms));
    }
    for (kind, totals) in by_kind(&evaluated.tested.iter().collect::<Vec<_>>(), evaluated.min_score) {
        let with_part = format!("found {} parts, {} wrong", totals.found, totals.wrong);
        let without_part = format!("false alarms on {} pictures", totals.false_alarms);
        line(format!("{kind}: {}", if totals.clean.of > 0 { with_part } else { without_part }));
    }
    if let Some(errors) = totals.errors {
        let mm = |mm: Option<f64>| mm.map(|mm| format!(" = {mm:.2} mm")).unwrap_or_default();
        line(format!(
            "errors: median {:.2} px{} ({:.2} % of the diagonal), {:.2}°; 95 % within {:.2} px{} ({:.2} %), {:.2}°",
            errors.median_px,
            mm(errors.median_mm),
            errors.median_percent,
            errors.median_deg,
            errors.p95_px,
            mm(errors.p95_mm),
            errors.p95_percent,
            errors.p95_deg
        ));
    }
    if let Some(offset) = label_offset(&evaluated.tested, evaluated.min_score) {
        line(offset.in_words());
    }
    if evaluated.others > 0 {
        line(format!("not counted: {} instances of other labels", evaluated.others));
    }
    for left_out in &evaluated.left_out {
        line(format!("left out: {}: {}", left_out.file, left_out.why));
    }
    text
}
