//! The JSON object of `sdg evaluate --pictures --json`.

use std::path::Path;

use sdg_geometry::BoundingBox;
use sdg_grasp::{DetectionRecord, GraspModel, ModelKind, Verification};
use serde_json::{Value, json};

use super::label_offset::label_offset;
use super::picture::LeftOut;
use super::score::{Hit, Judged, Tested, Totals, TrueGrasp, by_kind, judge, sweep};

/// A model, tested on a folder.
pub struct Evaluated<'a> {
    pub folder: &'a Path,
    pub model_file: &'a Path,
    pub model: &'a GraspModel,
    /// Whether detections were checked against the demonstration.
    pub verification: Verification,
    /// Minimum score of accepted detections.
    pub min_score: f64,
    /// The pictures with their detections.
    pub tested: Vec<Tested>,
    /// Files of the folder that are left out.
    pub left_out: Vec<LeftOut>,
    /// Number of instances with labels of other objects.
    pub others: usize,
    /// The label of all instances, if it is not the model's object: they count as the part.
    pub foreign_label: Option<String>,
}

impl Evaluated<'_> {
    /// Judges every picture with the minimum score.
    pub fn judged(&self) -> Vec<Judged> {
        self.tested.iter().map(|tested| judge(tested, self.min_score)).collect()
    }
}

/// All results as one object; the names of fields end with the units `px`, `mm`, `percent` (of the diagonal), `deg`.
pub fn to_json(evaluated: &Evaluated, report: &Path) -> Value {
    let judged = evaluated.judged();
    let totals = Totals::of(&judged);
    let pictures: Vec<Value> = evaluated
        .tested
        .iter()
        .zip(&judged)
        .map(|(tested, judged)| picture(tested, judged, evaluated.model.kind()))
        .collect();
    let tested: Vec<&Tested> = evaluated.tested.iter().collect();
    json!({
        "folder": evaluated.folder.display().to_string(),
        "grasp_model": evaluated.model_file.display().to_string(),
        "model": evaluated.model.kind().letter(),
        "object": evaluated.model.object(),
        "symmetry": evaluated.model.facts().symmetry,
        "verified": evaluated.verification == Verification::ByShape,
        "min_score": evaluated.min_score,
        "found": totals.found.count,
        "parts": totals.found.of,
        "missed": totals.missed,
        "wrong": totals.wrong,
        "optional_found": totals.optional.count,
        "optional": totals.optional.of,
        "clean": totals.clean.count,
        "pictures_with_part": totals.clean.of,
        "false_alarms": totals.false_alarms.count,
        "pictures_without_part": totals.false_alarms.of,
        "errors": totals.errors,
        "label_offset": label_offset(&evaluated.tested, evaluated.min_score),
        "pictures": pictures,
        "by_kind": by_kind_json(&tested, evaluated.min_score),
        "by_min_score": by_min_score(&tested),
        "left_out": evaluated.left_out,
        "other_labels": evaluated.others,
        "foreign_label": evaluated.foreign_label,
        "report": report.display().to_string(),
    })
}

/// The totals at other minimum scores.
pub fn by_min_score(tested: &[&Tested]) -> Vec<Value> {
    let at = |(min_score, totals): (f64, Totals)| {
        json!({
            "min_score": min_score,
            "found": totals.found.count,
            "wrong": totals.wrong,
            "clean": totals.clean.count,
            "false_alarms": totals.false_alarms.count,
        })
    };
    sweep(tested).into_iter().map(at).collect()
}

/// The totals of each kind of picture that the labels name.
pub fn by_kind_json(tested: &[&Tested], min_score: f64) -> Vec<Value> {
    let of_kind = |(kind, totals): (&str, Totals)| {
        json!({
            "kind": kind,
            "found": totals.found.count,
            "parts": totals.found.of,
            "wrong": totals.wrong,
            "false_alarms": totals.false_alarms.count,
            "pictures_without_part": totals.false_alarms.of,
        })
    };
    by_kind(tested, min_score).into_iter().map(of_kind).collect()
}

fn picture(tested: &Tested, judged: &Judged, kind: ModelKind) -> Value {
    let instances: Vec<Value> = tested
        .truths
        .iter()
        .enumerate()
        .map(|(instance_idx, truth)| {
            let grasp = truth.grasp.map(|TrueGrasp { center, angle, diagonal_px, .. }| {
                json!({"x": center.x, "y": center.y, "angle_deg": angle.degrees(), "diagonal_px": diagonal_px})
            });
            let BoundingBox { x1, y1, x2, y2 } = truth.bbox;
            json!({
                "grasp": grasp,
                "box": [x1, y1, x2, y2],
                "optional": truth.optional,
                "found": judged.is_found(instance_idx),
            })
        })
        .collect();
    let detections: Vec<Value> = tested
        .detections
        .iter()
        .zip(&judged.hits)
        .map(|(detection, hit)| {
            let hit = hit.map(|Hit { instance_idx, error }| json!({"instance": instance_idx, "error": error}));
            json!({"hit": hit, "detection": DetectionRecord::new(detection, kind)})
        })
        .collect();
    let parts = judged.parts();
    json!({
        "image": tested.picture.path.display().to_string(),
        "labels": tested.picture.labels.display().to_string(),
        "width": tested.picture.size[0],
        "height": tested.picture.size[1],
        "outcome": judged.outcome(),
        "found": parts.count,
        "parts": parts.of,
        "missed": judged.missed(),
        "wrong": judged.wrong(),
        "clean": judged.is_clean(),
        "false_alarm": judged.is_false_alarm(),
        "seconds": tested.seconds,
        "instances": instances,
        "detections": detections,
    })
}
