//! Grasp attempts with a model in the simulated workcell, and what became of them.

use std::ops::ControlFlow;

use anyhow::{Context, Result};
use image::RgbImage;
use nalgebra::Isometry3;
use sdg_grasp::{GraspDetection, GraspModel, GraspPlane, GraspPose, Verification};
use sdg_report::{Attempt, DetectionError, Step};
use sdg_simulation::objects::{LARGEST_JAW_WIDTH_M, ObjectSpec};
use sdg_simulation::scene::{SceneVariation, VariationConfig};
use sdg_simulation::{
    AttemptConfig, AttemptOutcome, AttemptReport, CameraView, GraspTarget, Perception, RecordConfig, Workcell,
    WorkcellConfig,
};
use serde::Serialize;

/// Height of the camera over the table when the shipped demonstrations were photographed, in metres: at the same height
/// the part has the same size in the picture.
const DEMONSTRATION_HEIGHT_M: f64 = 0.58;

/// What to rehearse.
pub struct Rehearsal<'a> {
    /// The model that looks.
    pub model: &'a GraspModel,
    /// The part on the table.
    pub object: &'a ObjectSpec,
    /// How many attempts.
    pub attempts: u32,
    /// Decides part poses, robot starts, lights, table and distractors.
    pub seed: u64,
    /// Whether detections are checked against the demonstration.
    pub verification: Verification,
}

/// What became of a rehearsal.
pub struct Rehearsed {
    /// One each, in their order.
    pub attempts: Vec<Attempt>,
    /// Pictures from outside of the first attempt that succeeded, or of the last one recorded.
    pub film: Vec<RgbImage>,
    /// What the wrist camera saw last before each attempt's approach, with the detection drawn.
    pub views: Vec<RgbImage>,
}

/// A failed attempt, as the contract lists it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Failure {
    attempt: usize,
    step: &'static str,
    why: String,
}

impl Rehearsed {
    /// How many attempts held the part.
    pub fn successes(&self) -> usize {
        self.attempts.iter().filter(|attempt| attempt.success).count()
    }

    /// The attempts that did not, and why.
    pub fn failures(&self) -> Vec<Failure> {
        self.attempts
            .iter()
            .filter(|attempt| !attempt.success)
            .map(|attempt| Failure { attempt: attempt.number, step: attempt.step.name(), why: attempt.why.clone() })
            .collect()
    }

    /// Whether the part was not seen in any attempt.
    pub fn found_nothing(&self) -> bool {
        !self.attempts.is_empty()
            && self.attempts.iter().all(|attempt| !attempt.success && attempt.step == Step::Detect)
    }
}

impl Rehearsal<'_> {
    /// Runs the attempts one after the other; `observe` hears of each and may end the rehearsal.
    pub fn run(&self, observe: &mut dyn FnMut(&Attempt) -> ControlFlow<()>) -> Result<Rehearsed> {
        let mut rehearsed = Rehearsed { attempts: Vec::new(), film: Vec::new(), views: Vec::new() };
        let mut filmed_success = false;
        for number in 1..=self.attempts as usize {
            let seed = attempt_seed(self.seed, number);
            let scene = SceneVariation::sample(Some(self.object), &VariationConfig::default(), seed);
            let mut workcell = Workcell::new(&WorkcellConfig::new(scene))?;
            let mut perception = ModelPerception { rehearsal: self, last: None };
            let record = (!filmed_success).then(RecordConfig::default);
            let config = AttemptConfig { record, hover_height_m: DEMONSTRATION_HEIGHT_M, ..AttemptConfig::default() };
            let mut report =
                workcell.run_attempt(&mut perception, &config, seed).with_context(|| format!("attempt {number}"))?;
            if !report.frames.is_empty() {
                rehearsed.film = std::mem::take(&mut report.frames);
                filmed_success = report.outcome.is_success();
            }
            rehearsed.views.extend(perception.last);
            let attempt = self.record(number, &report);
            rehearsed.attempts.push(attempt);
            if rehearsed.attempts.last().is_some_and(|attempt| observe(attempt).is_break()) {
                break;
            }
        }
        Ok(rehearsed)
    }

    fn record(&self, number: usize, report: &AttemptReport) -> Attempt {
        let (step, why) = match &report.outcome {
            AttemptOutcome::Success => (Step::Hold, String::new()),
            AttemptOutcome::Failure { step, why } => {
                (Step::from_name(&step.to_string()).unwrap_or(Step::Detect), why.clone())
            }
        };
        let (mut object_mm, mut object_angle_deg, mut detection_error) = ([f64::NAN; 2], f64::NAN, None);
        if let Some(base_from_object) = &report.base_from_object {
            let (tcp, direction_rad) = self.object.grasp_in_base(base_from_object);
            object_mm = [tcp.x * 1e3, tcp.y * 1e3];
            object_angle_deg = direction_rad.to_degrees();
            // The last look decides where the hand goes.
            detection_error = report
                .targets
                .iter()
                .rev()
                .flatten()
                .next()
                .map(|target| grasp_error(self.object, base_from_object, &target.base_from_tcp));
        }
        Attempt {
            number,
            object_mm,
            object_angle_deg,
            detection_error,
            step,
            success: report.outcome.is_success(),
            why,
            duration_secs: report.wall_secs,
        }
    }
}

/// A seed of its own for every attempt of every rehearsal.
fn attempt_seed(seed: u64, number: usize) -> u64 {
    seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(number as u64)
}

/// How far a found grasp lies beside the true one, as reports give it.
pub fn grasp_error(
    object: &ObjectSpec,
    base_from_object: &Isometry3<f64>,
    base_from_tcp: &Isometry3<f64>,
) -> DetectionError {
    let error = object.grasp_error(base_from_object, base_from_tcp);
    DetectionError { distance_mm: error.distance_m * 1e3, angle_deg: error.angle_rad.to_degrees() }
}

/// The heights of a part's grasp, which no photo shows.
pub fn grasp_plane(object: &ObjectSpec) -> GraspPlane {
    GraspPlane { mark_height_m: object.mark_height_m, grasp_height_m: object.grasp_height_m }
}

/// The model as the workcell's eyes.
struct ModelPerception<'a> {
    rehearsal: &'a Rehearsal<'a>,
    last: Option<RgbImage>,
}

impl Perception for ModelPerception<'_> {
    fn perceive(
        &mut self,
        view: &CameraView,
    ) -> std::result::Result<Option<GraspTarget>, Box<dyn std::error::Error + Send + Sync>> {
        let Rehearsal { model, object, verification, .. } = self.rehearsal;
        let detections = model.detect(&view.image, *verification)?;
        self.last = Some(crate::pictures::with_detections(&view.image, &detections));
        let Some(best) = detections.into_iter().next().filter(GraspDetection::is_accepted) else { return Ok(None) };
        let pose = GraspPose::from_planar(&view.camera, &best.grasp, &grasp_plane(object), LARGEST_JAW_WIDTH_M)?;
        Ok(Some(GraspTarget { base_from_tcp: pose.base_from_tcp, jaw_width_m: pose.jaw_width_m, score: best.score }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attempts_of_neighbouring_seeds_differ() {
        let seeds = |seed| (1..=50).map(move |number| attempt_seed(seed, number));
        assert!(seeds(1).all(|one| seeds(2).all(|other| one != other)));
    }
}
