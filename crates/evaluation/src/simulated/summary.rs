//! Sums of the records in the store, by cell and by model.

use std::collections::BTreeMap;

use anyhow::Result;
use sdg_geometry::percentile;
use sdg_grasp::{ModelKind, Verification};
use serde::Serialize;

use super::cell::Cell;
use super::groups::PartGroup;
use super::records::{AttemptRecord, DetectionRecord, TeachingRecord};
use super::settings::Settings;
use super::store::Store;
use super::units::Evaluation;
use crate::statistics::{Share, wilson_interval};

/// All results of a group of parts. The remaining units are not part of the sums; `remaining` is their number for all
/// groups.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    pub group: PartGroup,
    /// Settings of the results.
    pub settings: Settings,
    /// Number of remaining units.
    pub remaining: usize,
    /// Whether grasps without the check against the demonstration were requested.
    pub unverified: bool,
    /// The summary of each model, in the requested order.
    pub models: Vec<ModelSummary>,
    /// The summary of each model on each part.
    pub cells: Vec<CellSummary>,
}

/// The results of a model on all parts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelSummary {
    pub model: ModelKind,
    /// The model whose network is used; the model itself, unless it uses another model's.
    pub network: ModelKind,
    /// Number of teaching runs that gave a model, of all teaching runs.
    pub taught: Share,
    /// Number of samples for the detector: the median over the parts.
    pub samples: Option<f64>,
    /// Number of crops for the orientation CNN: the median over the parts; `None` for models without one.
    pub crops: Option<f64>,
    /// Wall-clock time from photo to model: the median over the parts.
    pub teaching_secs: Option<f64>,
    /// Wall-clock time from photo to model: the maximum over the parts.
    pub longest_teaching_secs: Option<f64>,
    pub largest_bytes: Option<usize>,
    /// Results with the check against the demonstration.
    pub verified: Figures,
    /// Results without the check; `None` for a model without a network.
    pub alone: Option<Figures>,
}

/// The results of a model on one part.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CellSummary {
    pub model: ModelKind,
    pub object: String,
    /// Outcome of teaching; `None` if it has not ended.
    pub teaching: Option<TeachingRecord>,
    /// Results with the check against the demonstration.
    pub verified: Figures,
    pub alone: Option<Figures>,
    /// Failed attempts with the check.
    pub failures: Vec<AttemptRecord>,
    /// Failed attempts without the check.
    pub failures_alone: Vec<AttemptRecord>,
}

/// Counts and measurements.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Figures {
    /// Attempts that held the part, of all attempts.
    pub held: Share,
    /// 95 % confidence interval (Wilson) of `held`.
    pub held_interval: [f64; 2],
    /// Attempts that held the part after one picture from the look-out pose and one from above, of all attempts.
    pub held_at_first_look: Share,
    /// Failed attempts by the step at which they ended.
    pub failures_by_step: BTreeMap<String, usize>,
    /// Unseen pictures in which the part was found within 10 mm and 10°, of all with the part.
    pub right: Share,
    /// Median of the position errors of detections, in millimetres.
    pub median_mm: Option<f64>,
    /// 90th percentile of the position errors, in millimetres.
    pub p90_mm: Option<f64>,
    /// Median of the angle errors of detections, in degrees, modulo the part's symmetry.
    pub median_deg: Option<f64>,
    /// 90th percentile of the angle errors, in degrees.
    pub p90_deg: Option<f64>,
    /// Pictures without the part in which a detection was accepted, of all without the part.
    pub false_alarms: Share,
    /// Images per second while the machine has no other load.
    pub frames_per_second: Option<f64>,
}

impl Figures {
    /// Attempts that held the part after at least one further picture, of all attempts.
    pub fn held_after_further_looks(&self) -> Share {
        Share { count: self.held.count - self.held_at_first_look.count, of: self.held.of }
    }
}

/// The records that are summed for one row of a table.
#[derive(Default)]
struct Gathered {
    attempts: Vec<AttemptRecord>,
    /// The detections in pictures with the part; `None` if there was no model.
    present: Vec<Option<DetectionRecord>>,
    absent: Vec<DetectionRecord>,
    secs: Vec<f64>,
}

impl Gathered {
    fn extend(&mut self, other: &Self) {
        self.attempts.extend_from_slice(&other.attempts);
        self.present.extend_from_slice(&other.present);
        self.absent.extend_from_slice(&other.absent);
        self.secs.extend_from_slice(&other.secs);
    }

    fn figures(&self) -> Figures {
        let held = Share::of(&self.attempts, |attempt| attempt.success);
        let mut failures_by_step = BTreeMap::new();
        for attempt in self.attempts.iter().filter(|attempt| !attempt.success) {
            *failures_by_step.entry(attempt.step.clone()).or_default() += 1;
        }
        let errors: Vec<_> = self.present.iter().flatten().filter_map(DetectionRecord::error).collect();
        let mm = || errors.iter().map(|error| error.distance_mm);
        let deg = || errors.iter().map(|error| error.angle_deg);
        Figures {
            held,
            held_interval: wilson_interval(held),
            held_at_first_look: Share::of(&self.attempts, |attempt| attempt.is_held_at_first_look()),
            failures_by_step,
            right: Share::of(&self.present, |record| record.is_some_and(|record| record.is_right())),
            median_mm: percentile(mm(), 50.0),
            p90_mm: percentile(mm(), 90.0),
            median_deg: percentile(deg(), 50.0),
            p90_deg: percentile(deg(), 90.0),
            false_alarms: Share::of(&self.absent, |record| record.is_accepted()),
            frames_per_second: percentile(self.secs.iter().copied(), 50.0).filter(|s| *s > 0.0).map(|s| 1.0 / s),
        }
    }

    fn failures(&self) -> Vec<AttemptRecord> {
        self.attempts.iter().filter(|attempt| !attempt.success).cloned().collect()
    }
}

impl Summary {
    /// Sums the results in the store, separately for the paper's parts and the held-out parts; groups without parts are
    /// missing.
    ///
    /// # Errors
    /// Records cannot be read.
    pub fn collect(evaluation: &Evaluation) -> Result<Vec<Self>> {
        let has_part = |group: &PartGroup| evaluation.objects.iter().any(|part| PartGroup::of(&part.name) == *group);
        PartGroup::ALL.into_iter().filter(has_part).map(|group| Self::of_group(evaluation, group)).collect()
    }

    fn of_group(evaluation: &Evaluation, group: PartGroup) -> Result<Self> {
        let store = evaluation.store;
        let settings = store.settings().clone();
        let mut summary = Self {
            group,
            settings,
            remaining: evaluation.remaining()?,
            unverified: evaluation.unverified,
            models: Vec::new(),
            cells: Vec::new(),
        };
        for &model in evaluation.models {
            let mut gathered = [Gathered::default(), Gathered::default()];
            let mut teachings = Vec::new();
            for object in evaluation.objects.iter().filter(|object| PartGroup::of(&object.name) == group) {
                let cell = Cell { model, object: &object.name };
                let teaching = cell.teaching(store)?;
                let attempted_alone = evaluation.unverified && model.has_network();
                let ways = [
                    gather(cell, Verification::ByShape, true, store)?,
                    gather(cell, Verification::Off, attempted_alone, store)?,
                ];
                let [verified, alone] = &ways;
                summary.cells.push(CellSummary {
                    model,
                    object: object.name.clone(),
                    teaching: teaching.clone(),
                    verified: verified.figures(),
                    alone: model.has_network().then(|| alone.figures()),
                    failures: verified.failures(),
                    failures_alone: alone.failures(),
                });
                teachings.extend(teaching);
                for (sum, way) in gathered.iter_mut().zip(&ways) {
                    sum.extend(way);
                }
            }
            summary.models.push(model_summary(model, &teachings, &gathered));
        }
        Ok(summary)
    }
}

fn model_summary(model: ModelKind, teachings: &[TeachingRecord], [verified, alone]: &[Gathered; 2]) -> ModelSummary {
    let taught: Vec<_> = teachings
        .iter()
        .filter_map(|teaching| match teaching {
            TeachingRecord::Taught { facts, bytes, .. } => Some((facts, *bytes)),
            TeachingRecord::Failed { .. } => None,
        })
        .collect();
    let seconds = || taught.iter().map(|(facts, _)| facts.seconds);
    ModelSummary {
        model,
        network: model.taught_as(),
        taught: Share { count: taught.len(), of: teachings.len() },
        samples: percentile(taught.iter().map(|(facts, _)| facts.samples as f64), 50.0),
        crops: percentile(
            taught.iter().filter_map(|(facts, _)| facts.orientation).map(|orientation| orientation.crops as f64),
            50.0,
        ),
        teaching_secs: percentile(seconds(), 50.0),
        longest_teaching_secs: percentile(seconds(), 100.0),
        largest_bytes: taught.iter().map(|(_, bytes)| *bytes).max(),
        verified: verified.figures(),
        alone: model.has_network().then(|| alone.figures()),
    }
}

/// The records of a cell, with the check or without. If teaching failed, every attempt counts as failed and every
/// part as missed.
fn gather(cell: Cell, verification: Verification, attempted: bool, store: &Store) -> Result<Gathered> {
    let settings = store.settings();
    let attempts = if attempted { settings.attempts as usize } else { 0 };
    if let Some(TeachingRecord::Failed { why }) = cell.teaching(store)? {
        let failed = |number| AttemptRecord::failed(number, AttemptRecord::TEACH, why.clone());
        return Ok(Gathered {
            attempts: (1..=attempts).map(failed).collect(),
            present: vec![None; settings.views as usize],
            ..Gathered::default()
        });
    }
    let look = cell.look(store)?.unwrap_or_default();
    let speed = cell.speed(store)?.unwrap_or_default();
    let record = |picture: &super::records::PictureRecord| match verification {
        Verification::ByShape => Some(picture.verified),
        Verification::Off => picture.alone,
    };
    Ok(Gathered {
        attempts: if attempted { cell.attempts(verification, store)? } else { Vec::new() },
        present: look.present.iter().map(record).collect(),
        absent: look.absent.iter().filter_map(record).collect(),
        secs: match verification {
            Verification::ByShape => speed.verified_secs,
            Verification::Off => speed.alone_secs,
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulated::records::{AttemptsRecord, LookRecord, PictureRecord};
    use sdg_geometry::RotationalSymmetry;
    use sdg_grasp::{Preset, TeachingFacts};
    use sdg_simulation::objects::ObjectSpec;

    fn record(score: f64, error: Option<(f64, f64)>) -> DetectionRecord {
        DetectionRecord {
            score,
            network_score: score,
            agreement: Some(score),
            error_mm: error.map(|(mm, _)| mm),
            error_deg: error.map(|(_, deg)| deg),
        }
    }

    fn picture(verified: DetectionRecord, alone: DetectionRecord) -> PictureRecord {
        PictureRecord { seed: 0, other_part: None, verified, alone: Some(alone) }
    }

    fn attempt(number: usize, success: bool, step: &str) -> AttemptRecord {
        AttemptRecord { success, ..AttemptRecord::failed(number, step, String::new()) }
    }

    #[test]
    fn cells_add_up_and_a_failed_teaching_counts_as_failed_attempts() {
        let folder = tempfile::tempdir().unwrap();
        let settings = Settings::for_test(1, 3, 2);
        let store = Store::open(folder.path(), &settings).unwrap();
        let facts = TeachingFacts {
            seed: 1,
            symmetry: RotationalSymmetry::None,
            size_tolerance: None,
            lengths: None,
            region: None,
            samples: 100,
            steps: 10,
            seconds: 60.0,
            validation: None,
            orientation: None,
            negatives: None,
            base_weights_sha256: None,
        };
        let taught =
            TeachingRecord::Taught { facts: Box::new(facts), bytes: 9_000_000, jobs: 2, losses: vec![3.0, 1.0] };
        store.write("cells/C-pendulum.teaching.json", &taught).unwrap();
        let failed = TeachingRecord::Failed { why: "nothing learnt".into() };
        store.write("cells/C-rod_end.teaching.json", &failed).unwrap();
        let attempts = vec![attempt(1, true, "hold"), attempt(2, false, "lift"), attempt(3, true, "hold")];
        store.write("cells/B-pendulum.attempts-verified.json", &AttemptsRecord::new(attempts)).unwrap();
        let look = LookRecord {
            present: vec![
                picture(record(0.9, Some((1.0, 0.5))), record(0.4, Some((1.0, 0.5)))),
                picture(record(0.8, Some((30.0, 0.5))), record(0.9, Some((3.0, 9.0)))),
            ],
            absent: vec![picture(record(0.1, None), record(0.7, None)), picture(record(0.0, None), record(0.2, None))],
        };
        store.write("cells/B-pendulum.look.json", &look).unwrap();

        let objects = ["pendulum", "rod_end"].map(|name| ObjectSpec::by_name(name).unwrap());
        let evaluation = Evaluation {
            models: &[ModelKind::B],
            objects: &objects,
            preset: Preset::Edge,
            store: &store,
            unverified: false,
            jobs: 1,
        };
        let summary = Summary::collect(&evaluation).unwrap().remove(0);
        let model = &summary.models[0];
        assert_eq!((model.taught.to_string().as_str(), model.network), ("1 of 2", ModelKind::C));
        assert_eq!(model.verified.held, Share { count: 2, of: 6 });
        assert_eq!(model.verified.failures_by_step, BTreeMap::from([("lift".into(), 1), ("teach".into(), 3)]));
        // One picture is right, one is 30 mm off, and two are of the part that could not be taught.
        assert_eq!(model.verified.right, Share { count: 1, of: 4 });
        assert_eq!(model.verified.median_mm, Some(15.5));
        assert_eq!(model.verified.false_alarms, Share { count: 0, of: 2 });
        // Without the check, the first detection is refused, so only the error of the second counts.
        let alone = model.alone.as_ref().unwrap();
        assert_eq!((alone.right, alone.median_deg), (Share { count: 1, of: 4 }, Some(9.0)));
        assert_eq!(alone.false_alarms, Share { count: 1, of: 2 });
        assert_eq!(summary.cells[1].failures.len(), 3);
        assert_eq!(summary.cells[1].failures[0].why, "nothing learnt");
    }
}
