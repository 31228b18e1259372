//! Finds photos whose grasp points in another direction than that of the first photo.
//!
//! A model taught from two such photos would grasp the part in two ways, with the hand turned.

use sdg_demonstration::Demonstration;

use crate::detection::GraspDetection;
use crate::error::Result;
use crate::model::{GraspModel, Verification};
use crate::score_calibration::ScoreCalibration;

/// Minimum difference of two grasp directions that counts as another grasp. Chosen by hand: most errors of hand-made
/// marks are below 10°.
const MIN_TURN_DEG: f64 = 45.0;

/// A photo whose grasp points in another direction than that of the first photo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnedGrasp {
    /// Number of the photo; the first photo has the number 1.
    pub photo: usize,
    /// The smallest rotation between the two directions, up to the part's symmetry, in degrees.
    pub turn_deg: f64,
}

/// The further photos in which the first demonstration alone finds the part, but with its grasp in another direction
/// than the marked one.
///
/// # Errors
/// As for [`GraspModel::detect`], and a further demonstration without a grasp.
pub fn turned_grasps(model: &GraspModel, demonstrations: &[Demonstration]) -> Result<Vec<TurnedGrasp>> {
    if demonstrations.len() < 2 {
        return Ok(Vec::new());
    }
    let first = GraspModel {
        network: None,
        demonstrations: model.demonstrations[..1].to_vec(),
        score_calibration: ScoreCalibration::NEUTRAL,
        ..model.clone()
    };
    let mut turned = Vec::new();
    for (idx, Demonstration { image, annotation }) in demonstrations.iter().enumerate().skip(1) {
        let marked = annotation.require_grasp()?.angle();
        let is_marked_part =
            |found: &&GraspDetection| found.is_accepted() && annotation.bbox.contains(&found.bbox.center());
        let detections = first.detect(image, Verification::ByShape)?;
        let Some(found) = detections.iter().find(is_marked_part) else { continue };
        let turn_deg = model.facts.symmetry.distance(found.grasp.angle, marked).to_degrees();
        if turn_deg > MIN_TURN_DEG {
            turned.push(TurnedGrasp { photo: idx + 1, turn_deg });
        }
    }
    Ok(turned)
}
