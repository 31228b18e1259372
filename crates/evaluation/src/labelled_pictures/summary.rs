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
        line(format!("{kind}: {}", of_kind(&totals)));
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

/// The counts of the pictures of one kind, with the part and without it.
fn of_kind(totals: &Totals) -> String {
    let with_part = (totals.clean.of > 0).then(|| format!("found {} parts, {} wrong", totals.found, totals.wrong));
    let without_part = (totals.false_alarms.of > 0)
        .then(|| format!("false alarms on {} pictures without the part", totals.false_alarms));
    with_part.into_iter().chain(without_part).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::Share;

    #[test]
    fn a_kind_with_both_sorts_of_pictures_has_both_counts() {
        let share = |count, of| Share { count, of };
        let mixed = Totals {
            found: share(2, 3),
            missed: 1,
            wrong: 4,
            optional: share(0, 0),
            clean: share(1, 2),
            false_alarms: share(1, 5),
            errors: None,
        };
        let both = "found 2 of 3 parts, 4 wrong; false alarms on 1 of 5 pictures without the part";
        assert_eq!(of_kind(&mixed), both);
        let with_part = Totals { false_alarms: share(0, 0), ..mixed };
        assert_eq!(of_kind(&with_part), "found 2 of 3 parts, 4 wrong");
    }
}
