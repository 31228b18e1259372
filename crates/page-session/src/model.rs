//! A taught model on the page: its detections, with reasons and advice for refused ones.

use std::sync::{Mutex, MutexGuard, PoisonError};

use image::RgbImage;
use sdg_annotate::{FoundGrasp, GraspPose, Refusal, Region, TaughtModel, TaughtSummary, TeacherError};
use sdg_calibration::Frame;
use sdg_cell::{DEFAULT_MIN_SCORE, DetectionWords, Found, Perception, advice_in_words};
use sdg_grasp::{Advice, PlanarPose, Verification};

use crate::region::{page_region, search_region};

/// Only one search runs at a time, because each uses all cores.
pub(crate) struct PageModel {
    detector: Mutex<Perception>,
    summary: TaughtSummary,
    /// Contents of the model file.
    bytes: Vec<u8>,
}

impl PageModel {
    pub(crate) fn new(detector: Perception, summary: TaughtSummary, bytes: Vec<u8>) -> Self {
        Self { detector: Mutex::new(detector), summary, bytes }
    }

    fn detector(&self) -> MutexGuard<'_, Perception> {
        self.detector.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn find(&self, image: &RgbImage, with_places: bool) -> Result<Vec<FoundGrasp>, TeacherError> {
        let detector = self.detector();
        let found = detector.detect(image, Verification::ByShape)?;
        let words = DetectionWords {
            detector: &detector,
            picture_size: image.dimensions().into(),
            min_score: DEFAULT_MIN_SCORE,
        };
        let mut grasps: Vec<FoundGrasp> = found.iter().map(|found| found_grasp(found, &words)).collect();
        let detections: Vec<_> = found.iter().map(|found| &found.detection).collect();
        for (grasp, touches) in grasps.iter_mut().zip(detector.touched_by_jaws(&detections)) {
            grasp.touches = touches;
        }
        if with_places {
            let explained: Vec<usize> = words.explained(found.iter().map(|found| &found.detection));
            let detections: Vec<_> = explained.iter().map(|&idx| &found[idx].detection).collect();
            for (idx, differences) in explained.into_iter().zip(detector.differences(image, &detections)) {
                if let Some((refusal, differences)) = grasps[idx].refusal.as_mut().zip(differences) {
                    refusal.edges = differences.edges.iter().map(|place| [place.x, place.y]).collect();
                    refusal.surface = differences.surface.iter().map(|place| [place.x, place.y]).collect();
                }
            }
        }
        Ok(grasps)
    }
}

impl TaughtModel for PageModel {
    fn summary(&self) -> TaughtSummary {
        self.summary.clone()
    }

    fn to_bytes(&self) -> Result<Vec<u8>, TeacherError> {
        Ok(self.bytes.clone())
    }

    fn region(&self) -> Option<Region> {
        self.detector().region().map(page_region)
    }

    fn look_in(&self, region: Option<Region>) -> Result<(), TeacherError> {
        Ok(self.detector().look_in(region.as_ref().map(search_region))?)
    }

    fn detect(&self, image: &RgbImage) -> Result<Vec<FoundGrasp>, TeacherError> {
        self.find(image, false)
    }

    fn detect_explained(&self, image: &RgbImage) -> Result<Vec<FoundGrasp>, TeacherError> {
        self.find(image, true)
    }
}

/// The advice as text for the page, which has buttons instead of options.
fn remedy(advice: Advice) -> String {
    advice_in_words(advice, "demonstration", "if it is the part, learn from it: this size is then taught as well")
}

/// `touches` stays empty, because it depends on the other detections.
fn found_grasp(found: &Found, words: &DetectionWords<'_>) -> FoundGrasp {
    let (detection, detector) = (&found.detection, words.detector);
    FoundGrasp {
        score: detection.score,
        is_accepted: detection.is_accepted(),
        bbox: detection.bbox,
        outline: detection.outline.clone(),
        grasp: detection.grasp,
        line_length: detector.marked_length(detection),
        pose: found.pose.as_ref().zip(detector.frame()).map(|(pose, frame)| grasp_pose(pose, frame)),
        refusal: (!detection.is_accepted()).then(|| Refusal {
            reason: words.reasons(detection, 2),
            remedy: words.advice_for(detection).map(remedy),
            ..Refusal::default()
        }),
        touches: Vec::new(),
    }
}

fn grasp_pose(pose: &PlanarPose, frame: Frame) -> GraspPose {
    GraspPose {
        frame: frame.name(),
        position_mm: pose.position_m.coords.map(|metres| 1e3 * metres).into(),
        yaw_deg: pose.yaw.degrees(),
        opening_mm: 1e3 * pose.opening_m,
        sigma_mm: 1e3 * pose.uncertainty.position_m,
        sigma_deg: pose.uncertainty.yaw_rad.to_degrees(),
    }
}
