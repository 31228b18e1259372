//! A rehearsal in words and as JSON.

use std::path::Path;

use sdg_report::AttemptSummary;
use serde_json::{Value, json};

use crate::rehearsal::{SIMULATION, step_name};
use crate::run_page::RunPage;

/// The result of an attempt in words.
pub fn attempt_in_words(attempt: &AttemptSummary) -> String {
    let error = attempt
        .detection_error
        .map(|e| format!(", detected {:.1} mm and {:.1}° off", e.distance_mm, e.angle_deg))
        .unwrap_or_default();
    let step = step_name(attempt);
    let outcome = match (attempt.success, step) {
        (true, "check") => "placed".to_owned(),
        (true, _) => "grasped and held".to_owned(),
        (false, SIMULATION) => format!("the simulation failed: {}", attempt.why),
        (false, _) => format!("failed at {step}: {}", attempt.why),
    };
    format!("{outcome}{error} ({:.1} s)", attempt.duration_secs)
}

/// The run as JSON, as printed by `sdg rehearse` (docs/command-line.md); `teach_seconds` if it also taught the model.
pub fn run_json(page: &RunPage, teach_seconds: Option<f64>, report: &Path) -> Value {
    let RunPage { model, object, rehearsed, .. } = page;
    let mut line = json!({
        "model": model.kind().letter(),
        "object": object.name,
        "part": object.description,
        "attempts": rehearsed.attempts.len(),
        "interrupted": rehearsed.interruption().is_some(),
        "successes": rehearsed.successes(),
        "failures": rehearsed.failures(),
        "report": report.display().to_string(),
    });
    if let Some(seconds) = teach_seconds {
        line["teach_seconds"] = json!(seconds);
    }
    line
}
