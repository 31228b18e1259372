//! Teaching and detection for the annotation page, whose crate does not depend on grasp models.

use std::borrow::Cow;
use std::ops::ControlFlow;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use image::RgbImage;
use sdg_annotate::{
    Figures, FoundGrasp, GraspPose, GraspTeacher, NegativesRefused, Refusal, Region, TaughtModel, TaughtSummary,
    TeachRequest, TeacherError, TeachingMaterial, TeachingStep,
};
use sdg_calibration::Frame;
use sdg_cell::DEFAULT_MIN_SCORE;
use sdg_cell::{Found, Perception};
use sdg_demonstration::Demonstration;
use sdg_evaluation::TaughtFile;
use sdg_evaluation::held_back::HeldBackFigures;
use sdg_evaluation::{Share, wilson_interval};
use sdg_geometry::RotationalSymmetry;
use sdg_grasp::{
    Advice, CheckConfig, GraspModel, PlanarPose, Preset, SearchRegion, TeachOptions, TeachingEvent, Verification,
    check_region_from_above, check_teaching_region,
};
use sdg_inputs::camera_files::CameraFile;

use crate::found_text::{MIN_ADVISED_SCORE, Wording, advice_in_words};
use crate::paint::Paint;

/// Teaches models with one preset.
pub struct PageTeacher {
    /// Network, training and augmentation.
    pub preset: Preset,
    /// The camera of the photos and of the pictures to try, and the heights of the marks and of the grasp above the
    /// table, in metres.
    pub camera: Option<(CameraFile, [f64; 2])>,
}

impl GraspTeacher for PageTeacher {
    fn teach(
        &self,
        material: &TeachingMaterial,
        request: &TeachRequest,
        observe: &mut dyn FnMut(TeachingStep) -> ControlFlow<()>,
    ) -> Result<Box<dyn TaughtModel>, TeacherError> {
        let start = Instant::now();
        let (file, demonstrations) = self.taught_file(material, request, observe)?;
        let figures = file.figures(&demonstrations, request.seed)?;
        let TaughtFile { model, bytes, .. } = file;
        let summary = summary(&model, Some(page_figures(&figures)), start.elapsed().as_secs_f64());
        Ok(Box::new(PageModel { detector: Mutex::new(self.detector(model)?), summary, bytes }))
    }

    fn teach_on_trial(
        &self,
        material: &TeachingMaterial,
        request: &TeachRequest,
    ) -> Result<Box<dyn TaughtModel>, TeacherError> {
        let start = Instant::now();
        let (file, _) = self.taught_file(material, request, &mut |_| ControlFlow::Continue(()))?;
        let TaughtFile { model, bytes, .. } = file;
        let summary = summary(&model, None, start.elapsed().as_secs_f64());
        Ok(Box::new(PageModel { detector: Mutex::new(self.detector(model)?), summary, bytes }))
    }

    fn check_region(&self, region: &Region, demonstrations: &[Demonstration]) -> Result<(), TeacherError> {
        let region = search_region(region);
        let Some((camera, [mark, grasp])) = &self.camera else {
            let mut options = TeachOptions::new(0);
            options.region = Some(region);
            return Ok(check_teaching_region(demonstrations, &options)?);
        };
        let (seen, lengths) = camera.seen_from_above(demonstrations, *mark, *grasp)?;
        Ok(check_region_from_above(&region, &seen, &camera.over_table, &lengths)?)
    }

    fn open(&self, bytes: &[u8], summary: &TaughtSummary) -> Result<Box<dyn TaughtModel>, TeacherError> {
        let model = GraspModel::from_bytes(bytes, &TeachOptions::new(0).device)?;
        let detector = Mutex::new(self.detector(model)?);
        Ok(Box::new(PageModel { detector, summary: summary.clone(), bytes: bytes.to_vec() }))
    }
}

impl PageTeacher {
    /// A model and its demonstrations as taught: in the plan view if a camera is known.
    fn taught_file<'m>(
        &self,
        material: &'m TeachingMaterial,
        request: &TeachRequest,
        observe: &mut dyn FnMut(TeachingStep) -> ControlFlow<()>,
    ) -> Result<(TaughtFile, Cow<'m, [Demonstration]>), TeacherError> {
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
        if request.fixed_height {
            options.size_tolerance = CheckConfig::FIXED_HEIGHT_TOLERANCE;
        }
        options.region = request.region.as_ref().map(search_region);
        options.negatives.clone_from(&material.negatives);
        let mut demonstrations = Cow::Borrowed(material.demonstrations.as_slice());
        if let Some((camera, [mark, grasp])) = &self.camera {
            let (seen, lengths) = camera.seen_from_above(&demonstrations, *mark, *grasp)?;
            options.negatives = camera.pictures_from_above(&options.negatives, &lengths)?;
            if let Some(region) = &options.region {
                check_region_from_above(region, &seen, &camera.over_table, &lengths)?;
            }
            options.lengths = Some(lengths);
            demonstrations = Cow::Owned(seen);
        }
        let file = TaughtFile::teach(&demonstrations, &options, &mut |event| observe(step(event)))?;
        Ok((file, demonstrations))
    }

    fn detector(&self, model: GraspModel) -> anyhow::Result<Perception> {
        match &self.camera {
            None => Ok(Perception::of_any_camera(model)),
            Some((camera, _)) => camera.perception(model),
        }
    }
}

fn search_region(region: &Region) -> SearchRegion {
    let Region { x, y, width, height, picture } = *region;
    SearchRegion { picture, ..SearchRegion::new([x, y, width, height]) }
}

fn page_region(region: &SearchRegion) -> Region {
    let SearchRegion { x, y, width, height, picture } = *region;
    Region { x, y, width, height, picture }
}

/// `seconds` includes all waiting: for the teaching and for the test of the model on held-out samples.
fn summary(model: &GraspModel, figures: Option<Figures>, seconds: f64) -> TaughtSummary {
    let negatives =
        model.facts().negatives.map(|said| NegativesRefused { refused: said.refused, pictures: said.pictures });
    let object = model.object().to_owned();
    TaughtSummary { model: model.kind(), object, seconds, figures, negatives }
}

fn page_figures(figures: &HeldBackFigures) -> Figures {
    let counts = |share: Share| [share.count, share.of];
    let (found, false_alarms) = (figures.found(), figures.false_alarms());
    Figures {
        found: counts(found),
        found_interval: wilson_interval(found),
        wrong: figures.wrong(),
        false_alarms: counts(false_alarms),
        false_alarms_interval: wilson_interval(false_alarms),
        error: figures.median_distance().map(|(error, unit)| (error, unit.to_owned())),
        error_degrees: figures.median_errors().map(|[_, degrees]| degrees),
        others_in_photo: figures.others_in_photo(),
        turned_photos: figures.turned().iter().map(|turned| turned.photo).collect(),
    }
}

fn step(event: &TeachingEvent) -> TeachingStep {
    match event {
        TeachingEvent::OrientationStep { step, planned_steps, loss, .. } => TeachingStep::Step {
            of: "the angles",
            is_last: false,
            done: step + 1,
            planned: *planned_steps,
            loss: *loss,
        },
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

/// Only one search runs at a time, because each uses all cores.
struct PageModel {
    detector: Mutex<Perception>,
    summary: TaughtSummary,
    /// Contents of the model file.
    bytes: Vec<u8>,
}

impl PageModel {
    fn detector(&self) -> MutexGuard<'_, Perception> {
        self.detector.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn find(&self, image: &RgbImage, with_places: bool) -> Result<Vec<FoundGrasp>, TeacherError> {
        let detector = self.detector();
        let found = detector.detect(image, Verification::ByShape)?;
        let wording = Wording {
            detector: &detector,
            picture_size: image.dimensions().into(),
            min_score: DEFAULT_MIN_SCORE,
            paint: Paint::PLAIN,
        };
        let mut grasps: Vec<FoundGrasp> = found.iter().map(|found| found_grasp(&detector, found, &wording)).collect();
        let detections: Vec<_> = found.iter().map(|found| &found.detection).collect();
        for (grasp, touches) in grasps.iter_mut().zip(detector.touched_by_jaws(&detections)) {
            grasp.touches = touches;
        }
        if with_places {
            let explained: Vec<usize> = wording.explained(found.iter().map(|found| &found.detection));
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
fn found_grasp(detector: &Perception, found: &Found, wording: &Wording<'_>) -> FoundGrasp {
    let detection = &found.detection;
    FoundGrasp {
        score: detection.score,
        is_accepted: detection.is_accepted(),
        bbox: detection.bbox,
        outline: detection.outline.clone(),
        grasp: detection.grasp,
        line_length: detector.marked_length(detection),
        pose: found.pose.as_ref().zip(detector.frame()).map(|(pose, frame)| grasp_pose(pose, frame)),
        refusal: (!detection.is_accepted()).then(|| Refusal {
            reason: wording.reasons(detection, 2),
            remedy: detection.advice().filter(|_| detection.score >= MIN_ADVISED_SCORE).map(remedy),
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

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_annotate::{Session, SessionOptions};
    use std::sync::Arc;

    #[test]
    fn advice_about_light_compares_the_picture_with_the_photo() {
        for (advice, light) in [(Advice::DarkerPhoto, "darker"), (Advice::BrighterPhoto, "brighter")] {
            for text in [crate::found_text::advice_with_options(advice), remedy(advice)] {
                // In a dark picture, "in brighter light" was read as a demand for more light.
                let compared = format!("it is {light} here than in the photo: a second ");
                assert!(text.contains(&compared) && text.ends_with(" in this light would help"), "{text}");
            }
        }
    }

    #[test]
    fn the_page_shows_the_opening_that_is_taught_where_a_file_states_none() {
        let folder = tempfile::tempdir().unwrap();
        let photo = folder.path().join("photo.png");
        RgbImage::from_fn(200, 120, |x, y| image::Rgb([(x * 5 % 251) as u8, (y * 7 % 241) as u8, 90]))
            .save(&photo)
            .unwrap();
        // At the start of the line, the outline is twice as wide as at its middle.
        let labelme = r#"{"imageWidth": 200, "imageHeight": 120, "shapes": [
            {"label": "bar", "shape_type": "polygon", "group_id": 1, "points": [[20, 40], [60, 40], [60, 20], [80, 20], [80, 40],
                [180, 40], [180, 80], [80, 80], [80, 100], [60, 100], [60, 80], [20, 80]]},
            {"label": "grasp_start", "shape_type": "point", "group_id": 1, "points": [[70, 60]]},
            {"label": "grasp_end", "shape_type": "point", "group_id": 1, "points": [[130, 60]]}]}"#;
        std::fs::write(photo.with_extension("json"), labelme).unwrap();
        let options = SessionOptions { images: vec![(photo.clone(), None)], ..SessionOptions::default() };
        let session =
            Session::open(&options, Arc::new(PageTeacher { preset: Preset::default(), camera: None })).unwrap();
        let on_the_page = session.marks(0).unwrap().grasp.unwrap().jaw_width;
        let demonstrations = crate::demonstrations::read_all(&[photo.display().to_string()]).unwrap();
        let taught = sdg_grasp::TaughtDemonstration::new(&demonstrations[0]).unwrap().marks.width_px;
        assert_eq!((on_the_page, taught), (40.0, 40.0));
    }
}
