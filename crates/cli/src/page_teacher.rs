//! Grasp models for the annotation page, which does not see them.

use std::ops::ControlFlow;
use std::sync::{Mutex, MutexGuard, PoisonError};

use image::RgbImage;
use sdg_annotate::{
    FoundGrasp, GraspPose, GraspTeacher, TaughtModel, TaughtSummary, TeachRequest, TeacherError, TeachingStep,
};
use sdg_calibration::Frame;
use sdg_demonstration::Demonstration;
use sdg_geometry::RotationalSymmetry;
use sdg_grasp::{GraspModel, PlanarPose, Preset, TeachOptions, TeachingEvent, Verification, teach};

use crate::camera_files::CameraFile;
use crate::held_back::HeldBackFigures;
use crate::picture_detector::{Found, PictureDetector};

/// Teaches with one preset.
pub struct PageTeacher {
    /// Network, training and augmentation.
    pub preset: Preset,
    /// The camera that takes the photos and the pictures to try, and the heights of marks and grasp over the table in metres.
    pub camera: Option<(CameraFile, [f64; 2])>,
}

impl GraspTeacher for PageTeacher {
    fn teach(
        &self,
        demonstrations: &[Demonstration],
        request: &TeachRequest,
        observe: &mut dyn FnMut(TeachingStep) -> ControlFlow<()>,
    ) -> Result<Box<dyn TaughtModel>, TeacherError> {
        let mut options = TeachOptions::new(request.seed);
        options.kind = request.model;
        options.preset = self.preset;
        options.symmetry = match request.symmetry {
            0 => RotationalSymmetry::Full,
            1 => RotationalSymmetry::None,
            count => RotationalSymmetry::Fold(count),
        };
        options.time_budget = request.time_budget();
        options.steps = request.steps;
        let mut taught_with = |demonstrations: &[Demonstration], options: &TeachOptions| {
            teach(demonstrations, options, &mut |event| observe(step(event)))
        };
        // Model S is to be there at once, and tells no figures on the page.
        let figures_of = |model: &GraspModel, demonstrations: &[Demonstration]| {
            let figures = || HeldBackFigures::of(model, demonstrations, request.seed);
            model.kind().has_network().then(figures).transpose()
        };
        let (detector, figures) = match &self.camera {
            None => {
                let model = taught_with(demonstrations, &options)?.model;
                let figures = figures_of(&model, demonstrations)?;
                (PictureDetector::AnyCamera(Box::new(model)), figures)
            }
            Some((camera, [mark, grasp])) => {
                let (seen, lengths) = camera.seen_from_above(demonstrations, *mark, *grasp)?;
                options.lengths = Some(lengths);
                let model = taught_with(&seen, &options)?.model;
                let figures = figures_of(&model, &seen)?;
                (PictureDetector::calibrated(model, camera.clone())?, figures)
            }
        };
        Ok(Box::new(PageModel { detector: Mutex::new(detector), figures }))
    }
}

fn step(event: &TeachingEvent) -> TeachingStep {
    match event {
        TeachingEvent::OrientationStep { step, planned_steps, loss, .. } => {
            TeachingStep::Step { of: "its turns", is_last: false, done: step + 1, planned: *planned_steps, loss: *loss }
        }
        TeachingEvent::Step { record, planned_steps, .. } => TeachingStep::Step {
            of: "the network",
            is_last: true,
            done: record.step + 1,
            planned: *planned_steps,
            loss: record.losses.total(),
        },
        TeachingEvent::Validated(record) => {
            TeachingStep::Validated { done: record.steps_done, hit_rate: record.validation.hit_rate() }
        }
    }
}

/// One look at a time: each uses every core.
struct PageModel {
    detector: Mutex<PictureDetector>,
    figures: Option<HeldBackFigures>,
}

impl PageModel {
    fn detector(&self) -> MutexGuard<'_, PictureDetector> {
        self.detector.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl TaughtModel for PageModel {
    fn summary(&self) -> TaughtSummary {
        let detector = self.detector();
        let model = detector.model();
        let figures = self.figures.as_ref();
        let [error_px, error_degrees] = match figures.and_then(HeldBackFigures::median_errors) {
            Some(errors) => errors.map(Some),
            None => [None; 2],
        };
        TaughtSummary {
            model: model.kind(),
            object: model.object().to_owned(),
            seconds: model.facts().seconds,
            hit_rate: figures.and_then(|figures| figures.found().percent()).map(|percent| percent / 100.0),
            error_px,
            error_degrees,
        }
    }

    fn to_bytes(&self) -> Result<Vec<u8>, TeacherError> {
        Ok(self.detector().model().to_bytes()?)
    }

    fn detect(&self, image: &RgbImage) -> Result<Vec<FoundGrasp>, TeacherError> {
        let detector = self.detector();
        let found = detector.detect(image, Verification::ByShape)?;
        Ok(found.iter().map(|found| found_grasp(&detector, found)).collect())
    }
}

/// The marked line is as long, against the part, as the first demonstration's: detections tell its middle only.
fn found_grasp(detector: &PictureDetector, found: &Found) -> FoundGrasp {
    let taught = &detector.model().demonstrations()[0].marks;
    let detection = &found.detection;
    let scale = if taught.width_px > 0.0 { detection.grasp.width / taught.width_px } else { 1.0 };
    FoundGrasp {
        score: detection.score,
        is_accepted: detection.is_accepted(),
        bbox: detection.bbox,
        outline: detection.outline.clone(),
        grasp: detection.grasp,
        line_length: taught.grasp.length() * scale,
        pose: found.pose.as_ref().zip(detector.frame()).map(|(pose, frame)| grasp_pose(pose, frame)),
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
