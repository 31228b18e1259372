//! The results for many parts: look-alikes, and parts that need another photo.

use serde_json::{Value, json};

use super::cross_check::{CrossCheck, LookAlikePair};
use super::part_store::PartOutcome;

/// Minimum fraction of held-out samples with the part in which it is found; below it, a part needs another photo.
const MIN_FOUND: f64 = 0.75;

/// The results of all requested parts.
#[derive(Debug)]
pub struct Findings {
    /// Every part and its outcome.
    pub parts: Vec<(String, PartOutcome)>,
    /// Names of the parts with a model: rows and columns of the cross-check.
    pub taught: Vec<String>,
    pub check: CrossCheck,
    pub look_alikes: Vec<LookAlikePair>,
    /// Parts that need another photo, and the reasons.
    pub need_photo: Vec<(String, String)>,
    /// Photos without marks or of a format that is not read, and the reasons why they are left out.
    pub left_out: Vec<(String, String)>,
}

impl Findings {
    pub fn new(parts: Vec<(String, PartOutcome)>, check: CrossCheck, left_out: Vec<(String, String)>) -> Self {
        let is_taught = |outcome: &PartOutcome| matches!(outcome, PartOutcome::Taught { .. });
        let taught: Vec<String> =
            parts.iter().filter(|(_, outcome)| is_taught(outcome)).map(|(name, _)| name.clone()).collect();
        let mut need_photo = Vec::new();
        for (name, outcome) in &parts {
            let place = taught.iter().position(|known| known == name);
            let why = match outcome {
                PartOutcome::Failed { why } => Some(format!("not taught: {why}")),
                // First, because it can be the cause of the other reasons.
                PartOutcome::Taught { turned_photos, .. } if !turned_photos.is_empty() => {
                    let photos: Vec<String> = turned_photos.iter().map(usize::to_string).collect();
                    let photos = photos.join(", ");
                    Some(format!("its grasp has another direction in photo {photos} than in photo 1: mark them alike"))
                }
                PartOutcome::Taught { .. } if place.is_some_and(|place| !check.finds_own(place)) => {
                    Some("its model does not find it in its own photo".to_owned())
                }
                PartOutcome::Taught { found, parts, .. } if (*found as f64) < MIN_FOUND * *parts as f64 => {
                    Some(format!("its model finds it in {found} of {parts} held-out samples"))
                }
                PartOutcome::Taught { false_alarms, without_part, .. } if 2 * false_alarms > *without_part => {
                    Some(format!("its model finds it in {false_alarms} of {without_part} samples without it"))
                }
                PartOutcome::Taught { .. } => None,
            };
            need_photo.extend(why.map(|why| (name.clone(), why)));
        }
        Self { look_alikes: check.look_alikes(), parts, taught, check, need_photo, left_out }
    }

    /// The names of the parts in a pair.
    pub fn names(&self, pair: &LookAlikePair) -> [&str; 2] {
        pair.parts.map(|part| self.taught[part].as_str())
    }

    /// The results as JSON.
    pub fn to_json(&self) -> Value {
        let listed = |pairs: &[(String, String)]| -> Vec<Value> {
            pairs.iter().map(|(name, why)| json!({ "name": name, "why": why })).collect()
        };
        let parts: Vec<Value> =
            self.parts.iter().map(|(name, outcome)| json!({ "name": name, "outcome": outcome })).collect();
        let alike: Vec<Value> =
            self.look_alikes.iter().map(|pair| json!({ "parts": self.names(pair), "scores": pair.scores })).collect();
        json!({
            "parts": parts,
            "taught": self.taught.len(),
            "look_alike": alike,
            "need_photo": listed(&self.need_photo),
            "left_out": listed(&self.left_out),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taught(found: usize, false_alarms: usize, turned_photos: &[usize]) -> PartOutcome {
        PartOutcome::Taught {
            seconds: 1.0,
            found,
            parts: 18,
            wrong: 0,
            false_alarms,
            without_part: 6,
            median: Some([1.0, 0.5]),
            turned_photos: turned_photos.to_vec(),
        }
    }

    #[test]
    fn every_reason_for_another_photo_is_told() {
        let failed = PartOutcome::Failed { why: "no outline".to_owned() };
        let parts = [
            ("a", taught(18, 0, &[])),
            ("b", failed),
            ("c", taught(10, 0, &[])),
            ("d", taught(18, 4, &[])),
            ("e", taught(18, 0, &[])),
            ("f", taught(18, 0, &[2, 3])),
        ];
        let parts = parts.map(|(name, outcome)| (name.to_owned(), outcome)).to_vec();
        let own =
            |scores: [f64; 5]| (0..5).map(|i| (0..5).map(|j| if i == j { scores[i] } else { 0.0 }).collect()).collect();
        let findings = Findings::new(parts, CrossCheck { scores: own([0.9, 0.9, 0.9, 0.3, 0.9]) }, Vec::new());
        let told: Vec<String> = findings.need_photo.iter().map(|(name, why)| format!("{name}: {why}")).collect();
        assert_eq!(
            told,
            [
                "b: not taught: no outline",
                "c: its model finds it in 10 of 18 held-out samples",
                "d: its model finds it in 4 of 6 samples without it",
                "e: its model does not find it in its own photo",
                "f: its grasp has another direction in photo 2, 3 than in photo 1: mark them alike"
            ]
        );
        assert_eq!(findings.taught, ["a", "c", "d", "e", "f"]);
    }
}
