//! Grasp attempts as a table and as a matrix of counts.

use sdg_geometry::median;

use crate::chart::Matrix;
use crate::table::{Cell, Column, Table, Tone};

/// Error of a detection relative to the ground truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetectionError {
    /// Horizontal distance between the detected and the true grasp, in millimetres.
    pub distance_mm: f64,
    /// Difference of the angles, in degrees.
    pub angle_deg: f64,
}

/// A grasp attempt.
#[derive(Debug, Clone, PartialEq)]
pub struct AttemptSummary {
    /// Number of the attempt, from 1.
    pub number: usize,
    /// Position of the part's grasp in the robot's base frame, x and y in millimetres; not finite if unknown.
    pub object_mm: [f64; 2],
    /// Angle of the part's grasp, in degrees; not finite if unknown.
    pub object_angle_deg: f64,
    /// The error of the detection; `None` without a detection.
    pub detection_error: Option<DetectionError>,
    /// Index of the step at which the attempt ended, from 0; the last step on success. `None` if the simulation failed.
    pub step: Option<usize>,
    /// Whether the attempt ended because the last picture did not show the part.
    pub not_found: bool,
    /// Whether the part was held at the end or, in an attempt with a place, was put down in it.
    pub success: bool,
    /// The reason of the failure; empty on success.
    pub why: String,
    /// Duration in seconds.
    pub duration_secs: f64,
}

/// The table of attempts, with medians at the bottom if there are several. `steps` are the names of the steps in order,
/// and `done` is the name of success ("held").
///
/// Outcome and step come before the measurements, so that a phone shows them without scrolling.
#[must_use]
pub fn attempts_table(steps: &[&str], done: &str, attempts: &[AttemptSummary]) -> Table {
    let mut table = Table::new(vec![
        Column::number("#"),
        Column::text("outcome"),
        Column::text("reached"),
        Column::number("x").unit("mm").group("part position"),
        Column::number("y").unit("mm").group("part position"),
        Column::number("angle").unit("°").group("part position"),
        Column::number("position").unit("mm").group("detection error"),
        Column::number("angle").unit("°").group("detection error"),
        Column::number("time").unit("s"),
    ]);
    for attempt in attempts {
        let verdict = if attempt.success { (Tone::Good, done) } else { (Tone::Bad, "failed") };
        let why = attempt.why.trim();
        let error = |pick: fn(&DetectionError) -> f64| {
            attempt.detection_error.as_ref().map_or(Cell::missing(), |error| Cell::number(pick(error), 1))
        };
        table = table.row(vec![
            Cell::number(attempt.number as f64, 0),
            Cell::Verdict {
                tone: verdict.0,
                text: verdict.1.to_owned(),
                note: (!why.is_empty()).then(|| why.to_owned()),
            },
            Cell::Progress {
                done: if attempt.success { steps.len() } else { attempt.step.unwrap_or(0) },
                total: steps.len(),
                label: attempt.step.map_or("simulation", |step| steps[step]).to_owned(),
            },
            Cell::number(attempt.object_mm[0], 0),
            Cell::number(attempt.object_mm[1], 0),
            Cell::number(attempt.object_angle_deg, 0),
            error(|e| e.distance_mm),
            error(|e| e.angle_deg),
            Cell::number(attempt.duration_secs, 1),
        ]);
    }
    if attempts.len() < 2 {
        return table;
    }
    let num_done = attempts.iter().filter(|attempt| attempt.success).count();
    let errors = |pick: fn(&DetectionError) -> f64| {
        let values = attempts.iter().filter_map(|attempt| attempt.detection_error.as_ref().map(pick));
        median(values).map_or(Cell::missing(), |value| Cell::number(value, 1))
    };
    table.summary(vec![
        Cell::text(""),
        Cell::text(format!("{num_done} of {} {done}", attempts.len())),
        Cell::text(""),
        Cell::text(""),
        Cell::text(""),
        Cell::text("median"),
        errors(|e| e.distance_mm),
        errors(|e| e.angle_deg),
        median(attempts.iter().map(|a| a.duration_secs)).map_or(Cell::missing(), |value| Cell::number(value, 1)),
    ])
}

/// Detections and outcomes: numbers of attempts by the class of the last detection's error (rows) and by the step at
/// which the attempt failed (columns). The last column, named `done`, is success. Attempts whose simulation failed are
/// not counted.
///
/// `right_mm` and `right_deg` are the maximum errors of a correct detection.
#[must_use]
pub fn outcome_matrix(
    steps: &[&str],
    done: &str,
    attempts: &[AttemptSummary],
    right_mm: f64,
    right_deg: f64,
) -> Matrix {
    let seen = |attempt: &AttemptSummary| match attempt.detection_error {
        _ if attempt.not_found => 2,
        Some(error) if error.distance_mm <= right_mm && error.angle_deg <= right_deg => 0,
        Some(_) => 1,
        None => 3,
    };
    let mut counts = vec![vec![0usize; steps.len() + 1]; 4];
    for attempt in attempts {
        let ended = if attempt.success { Some(steps.len()) } else { attempt.step };
        if let Some(ended) = ended {
            counts[seen(attempt)][ended] += 1;
        }
    }
    let mut caption = format!(
        "Correct: the last detection is within {right_mm:.0} mm and {right_deg:.0}° of the ground truth. A \
         failure in the first row is due to the robot, in the next two to perception."
    );
    if counts[3].iter().all(|&count| count == 0) {
        counts.truncate(3);
    } else {
        caption += " Not searched: no picture was taken, or the search of a picture failed.";
    }
    let num_simulation = attempts.iter().filter(|attempt| attempt.step.is_none()).count();
    if num_simulation > 0 {
        caption += &format!(" Not counted: {num_simulation} of {} attempts, whose simulation failed.", attempts.len());
    }
    let columns = steps.iter().copied().chain([done]);
    let labels = ["correct", "wrong", "not detected", "not searched"];
    let matrix = Matrix::new("Last detection, and step at which the attempt ended", columns).good_column(steps.len());
    labels.into_iter().zip(counts).fold(matrix, |matrix, (label, counts)| matrix.row(label, counts)).caption(caption)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::html_checker::assert_well_formed;

    const STEPS: [&str; 6] = ["detect", "hover", "approach", "close", "lift", "hold"];

    fn attempt(number: usize, step: usize, success: bool, why: &str) -> AttemptSummary {
        AttemptSummary {
            number,
            object_mm: [512.0, -34.0],
            object_angle_deg: 127.0,
            detection_error: (step > 0).then_some(DetectionError { distance_mm: number as f64, angle_deg: 0.5 }),
            step: Some(step),
            not_found: step == 0,
            success,
            why: why.to_owned(),
            duration_secs: 9.5,
        }
    }

    #[test]
    fn outcomes_are_counted_by_what_was_seen() {
        let beside = AttemptSummary {
            detection_error: Some(DetectionError { distance_mm: 30.0, angle_deg: 0.5 }),
            ..attempt(4, 3, false, "closed on nothing")
        };
        let html = outcome_matrix(
            &STEPS,
            "held",
            &[attempt(1, 5, true, ""), attempt(2, 4, false, "slipped"), attempt(3, 0, false, "nothing found"), beside],
            10.0,
            10.0,
        )
        .to_html();
        assert_well_formed(&html);
        assert!(html.contains("correct: lift 1, held 1. wrong: close 1. not detected: detect 1."), "{html}");
        assert!(!html.contains("not searched") && !html.contains("Not counted"), "{html}");
    }

    #[test]
    fn perception_is_not_blamed_without_a_searched_picture() {
        let blocked = AttemptSummary { not_found: false, ..attempt(1, 0, false, "the way is blocked") };
        let not_confirmed = AttemptSummary {
            detection_error: Some(DetectionError { distance_mm: 1.0, angle_deg: 0.5 }),
            ..attempt(2, 0, false, "nothing found from above")
        };
        let unstable = AttemptSummary { step: None, ..blocked.clone() };
        let attempts = [blocked, not_confirmed, unstable];
        let html = outcome_matrix(&STEPS, "held", &attempts, 10.0, 10.0).to_html();
        assert_well_formed(&html);
        assert!(html.contains("correct: nothing. wrong: nothing. not detected: detect 1. not searched: detect 1."));
        assert!(html.contains("Not counted: 1 of 3 attempts"), "{html}");
        assert!(attempts_table(&STEPS, "held", &attempts).to_html().contains("simulation"));
    }

    #[test]
    fn the_table_tells_what_happened() {
        let html = attempts_table(
            &STEPS,
            "held",
            &[attempt(1, 5, true, ""), attempt(2, 4, false, "slipped <out>"), attempt(3, 0, false, "nothing found")],
        )
        .to_html();
        assert_well_formed(&html);
        assert!(html.contains("1 of 3 held") && html.contains("slipped &lt;out&gt;"));
        // Six steps of the first attempt, four of the second (detect to close), none of the third.
        assert_eq!(html.matches("<i class=\"on\"></i>").count(), 10);
        // The median of 1 and 2 mm; the third attempt has no detection.
        assert!(html.contains("<td class=\"number\">1.5</td>"), "{html}");
    }

    #[test]
    fn a_table_of_nothing_is_well_formed() {
        assert_well_formed(&attempts_table(&STEPS, "held", &[]).to_html());
    }
}
