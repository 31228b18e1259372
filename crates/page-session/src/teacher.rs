//! Teaching for the annotation page, whose crate does not depend on grasp models.

use std::borrow::Cow;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use nalgebra::Point2;
use sdg_annotate::{
    CameraPictures, Figures, GraspTeacher, LiveOptions, NegativesRefused, Region, Searched, SizeCheck, TaughtModel,
    TaughtSummary, TeachRequest, TeacherError, TeachingMaterial, TeachingStep,
};
use sdg_camera::{Address, Camera, OpenOptions, PixelFrame};
use sdg_cell::Perception;
use sdg_demonstration::Demonstration;
use sdg_evaluation::held_back::HeldBackFigures;
use sdg_evaluation::{Share, TaughtFile, wilson_interval};
use sdg_geometry::RotationalSymmetry;
use sdg_grasp::{
    CheckConfig, GraspError, GraspModel, Preset, TeachOptions, TeachingEvent, check_region_from_above,
    check_teaching_region,
};
use sdg_inputs::camera_files::CameraFile;
use sdg_inputs::one_line;
use sdg_kinematics::HAND_OPENING_MAX_M;

use crate::model::PageModel;
use crate::region::search_region;

/// Teaches models with one preset.
#[derive(Debug, Clone)]
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
        Ok(Box::new(PageModel::new(self.detector(model)?, summary, bytes)))
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
        Ok(Box::new(PageModel::new(self.detector(model)?, summary, bytes)))
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

    fn open(
        &self,
        bytes: &[u8],
        summary: &TaughtSummary,
        searched: Option<Searched>,
    ) -> Result<Box<dyn TaughtModel>, TeacherError> {
        let mut model = GraspModel::from_bytes(bytes, &TeachOptions::new(0).device)?;
        if searched.is_some() {
            // The model's region, which is replaced, may not fit this camera's pictures.
            model = model.with_region(None)?;
        }
        let mut detector = self.detector(model)?;
        if let Some(searched) = searched {
            detector.look_in(searched.region().as_ref().map(search_region))?;
        }
        Ok(Box::new(PageModel::new(detector, summary.clone(), bytes.to_vec())))
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
            options.over_table = Some(camera.over_table);
            demonstrations = Cow::Owned(seen);
        }
        let file = TaughtFile::teach(&demonstrations, &options, &mut |event| observe(step(event)))
            .map_err(|error| with_name(error, &material.negative_names))?;
        Ok((file, demonstrations))
    }

    fn detector(&self, model: GraspModel) -> anyhow::Result<Perception> {
        match &self.camera {
            None => Ok(Perception::of_any_camera(model)),
            Some((camera, _)) => camera.perception(model),
        }
    }
}

impl PageTeacher {
    /// The hand's maximum opening, in pixels at the centre of the photo, in the plane of the marks. It is nearly
    /// constant over a table that is seen from above. `None` without a calibrated camera.
    pub(crate) fn max_opening_px(&self) -> Option<f64> {
        let (file, [mark_height_m, _]) = self.camera.as_ref()?;
        let [width, height] = file.size_px();
        let middle = Point2::new(0.5 * f64::from(width), 0.5 * f64::from(height));
        let over_table = &file.over_table;
        let scale = over_table.camera.metres_per_pixel(&middle, over_table.table_height_m + mark_height_m)?;
        Some(HAND_OPENING_MAX_M / scale)
    }

    /// Width and height of photos, with a calibrated camera.
    pub fn photo_size(&self) -> Option<[u32; 2]> {
        self.camera.as_ref().map(|(camera, _)| camera.size_px())
    }

    /// The orientation of the pixels of photos and of pictures to try: a calibration is for the sensor's pixels.
    pub fn pixel_frame(&self) -> PixelFrame {
        if self.camera.is_some() { PixelFrame::Sensor } else { PixelFrame::Upright }
    }

    /// The options for opening the camera of live pictures. With a calibrated camera, pictures of its calibrated size
    /// in the sensor's orientation are requested.
    pub fn open_options(&self, mut options: OpenOptions) -> OpenOptions {
        if let Some((camera, _)) = &self.camera {
            [options.width, options.height] = camera.size_px();
            options.frame = PixelFrame::Sensor;
        }
        options
    }

    /// The live pictures of an open camera. With a calibrated camera, frames of another size are a fault.
    pub fn live(&self, camera: Box<dyn Camera>, address: &Address, photo_path: std::path::PathBuf) -> LiveOptions {
        let check = self.camera.clone().map(|(camera, _)| -> Box<SizeCheck> {
            Box::new(move |size| camera.check_size(size).map_err(|error| one_line(&error)))
        });
        let pictures = Arc::new(CameraPictures::read(camera, matches!(address, Address::Sim(_)), check));
        LiveOptions { pictures, address: address.to_string(), photo_path }
    }
}

/// The error of a teaching, with the name of the picture that it is about.
fn with_name(error: GraspError, negative_names: &[String]) -> TeacherError {
    if let GraspError::DemonstrationAsNegative { number } = &error
        && let Some(name) = negative_names.get(number - 1)
    {
        return format!("{name}: expected a picture without the part, found a demonstration").into();
    }
    error.into()
}

/// `seconds` is the duration of teaching and, with `figures`, of the test on held-out samples.
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

#[cfg(test)]
mod tests {
    use super::*;
    use image::RgbImage;
    use sdg_annotate::{ModelKind, Session, SessionOptions};
    use std::path::Path;

    const DATASETS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../datasets");

    fn pendulum() -> Demonstration {
        let folder = Path::new(DATASETS).join("demonstrations/pendulum");
        let [photo, marks] = ["image.png", "annotation.json"].map(|name| folder.join(name));
        sdg_inputs::demonstrations::read_pair(&photo, &marks).unwrap()
    }

    fn request() -> TeachRequest {
        TeachRequest {
            model: ModelKind::S,
            time_budget_secs: None,
            steps: None,
            symmetry: 1,
            fixed_height: false,
            seed: 1,
            region: None,
        }
    }

    #[test]
    fn a_demonstration_among_the_pictures_without_the_part_is_named() {
        let material = TeachingMaterial {
            negatives: vec![RgbImage::new(640, 480), pendulum().image],
            negative_names: ["empty.png", "part.png"].map(str::to_owned).to_vec(),
            demonstrations: vec![pendulum()],
        };
        let teacher = PageTeacher { preset: Preset::default(), camera: None };
        let refused = teacher.teach_on_trial(&material, &request()).err().unwrap().to_string();
        assert!(refused.starts_with("part.png: expected a picture without the part"), "{refused}");
    }

    #[test]
    fn a_model_opens_with_a_smaller_camera_if_its_region_is_replaced() {
        let datasets = Path::new(DATASETS);
        let folder = tempfile::tempdir().unwrap();
        let text = std::fs::read_to_string(datasets.join("workcell/camera.yaml")).unwrap();
        let small = text
            .replace("image_width: 640", "image_width: 320")
            .replace("image_height: 480", "image_height: 240")
            .replace("[550.0, 0.0, 319.5, 0.0, 550.0, 239.5,", "[275.0, 0.0, 159.5, 0.0, 275.0, 119.5,");
        let path = folder.path().join("camera.yaml");
        std::fs::write(&path, small).unwrap();
        let [large, small] = [datasets.join("workcell/camera.yaml"), path].map(|path| {
            let camera = Some((CameraFile::read(&path).unwrap(), [0.016, 0.009]));
            PageTeacher { preset: Preset::default(), camera }
        });
        let material = TeachingMaterial { demonstrations: vec![pendulum()], ..TeachingMaterial::default() };
        let region = Region { x: 0, y: 0, width: 640, height: 480, picture: Some([640, 480]) };
        let request = TeachRequest { region: Some(region), ..request() };
        let taught = large.teach_on_trial(&material, &request).unwrap();
        let bytes = taught.to_bytes().unwrap();
        assert!(small.open(&bytes, &taught.summary(), None).is_err(), "its region is beyond the smaller pictures");

        // A project in which the whole picture was chosen.
        std::fs::create_dir(folder.path().join("models")).unwrap();
        std::fs::write(folder.path().join("models/pendulum.sdg"), &bytes).unwrap();
        let project = r#"{"format": 1, "label": "pendulum", "photos": [], "tried": [], "removed": [], "current_model": 0,
            "searched": "all", "models": [{"file": "pendulum.sdg", "taught_secs": 1, "photos": 1, "negatives": 0,
            "material": "", "summary": {"model": "S", "object": "pendulum", "seconds": 1.0, "figures": null,
            "negatives": null}}]}"#;
        std::fs::write(folder.path().join("sdg-project.json"), project).unwrap();
        let options = SessionOptions { project: Some(folder.path().to_owned()), ..SessionOptions::default() };
        let session = Session::open(&options, Arc::new(small)).unwrap();
        let view = session.view();
        assert!(view.models[0].is_current && view.region.is_none(), "{:?}", view.notes);
        session.use_version(0).unwrap();
        assert!(session.view().models[0].is_current);
        assert!(session.compare_versions(0, 0).is_ok());
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
        let marks = photo.with_extension("json");
        let demonstration = sdg_inputs::demonstrations::read_pair(&photo, &marks).unwrap();
        let taught = sdg_grasp::TaughtDemonstration::new(&demonstration).unwrap().marks.width_px;
        assert_eq!((on_the_page, taught), (40.0, 40.0));
    }
}
