//! A grasp model behind any camera, or behind a calibrated one.

use std::path::Path;

use anyhow::{Context, Result};
use image::RgbImage;
use nalgebra::Point2;
use sdg_calibration::Frame;
use sdg_demonstration::PixelFrame;
use sdg_grasp::{
    Differences, GraspDetection, GraspError, GraspModel, PartDetector, PlanDetection, PlanDetector, PlanarPose,
    TaughtDemonstration, Verification,
};

use crate::camera_files::CameraFile;

/// A model, and the camera whose pictures it is shown.
#[derive(Debug)]
pub enum PictureDetector {
    /// Pictures of any camera.
    AnyCamera(Box<GraspModel>),
    /// Those of a calibrated one.
    Calibrated(Box<CameraFile>, Box<PlanDetector>),
}

/// A detection, in metres as well where the camera is known.
#[derive(Debug, Clone)]
pub struct Found {
    /// In pixels of the picture as given.
    pub detection: GraspDetection,
    /// In the camera's frame.
    pub pose: Option<PlanarPose>,
}

impl PictureDetector {
    /// Puts the model of a file behind the camera of a file, if one is given.
    ///
    /// # Errors
    /// A camera file that cannot be used, or that does not see the plane of the marks, with its name; a model that was taught without a
    /// camera, with its file's name.
    pub fn new(model: GraspModel, model_file: &Path, camera: Option<&Path>) -> Result<Self> {
        match camera {
            None => Ok(Self::AnyCamera(Box::new(model))),
            Some(path) => {
                let camera = CameraFile::read(path)?;
                Self::calibrated(model, camera).map_err(|error| {
                    // A plane that is not seen is the camera's fault.
                    let is_of_camera = matches!(error.downcast_ref::<GraspError>(), Some(GraspError::PlanView(_)));
                    let file = if is_of_camera { path } else { model_file };
                    error.context(file.display().to_string())
                })
            }
        }
    }

    /// Puts a model behind a calibrated camera.
    ///
    /// # Errors
    /// A model that was taught without a camera; a camera that does not see the plane of the marks.
    pub fn calibrated(model: GraspModel, camera: CameraFile) -> Result<Self> {
        let detector = PlanDetector::new(model, &camera.over_table)?;
        Ok(Self::Calibrated(Box::new(camera), Box::new(detector)))
    }

    /// Finds the part in a picture, best score first.
    ///
    /// # Errors
    /// A picture of another size than the calibrated camera's.
    pub fn detect(&self, picture: &RgbImage, verification: Verification) -> Result<Vec<Found>> {
        match self {
            Self::AnyCamera(model) => {
                let found = model.detect(picture, verification)?;
                Ok(found.into_iter().map(|detection| Found { detection, pose: None }).collect())
            }
            Self::Calibrated(camera, detector) => {
                camera.check_picture(picture)?;
                let found = detector.detect(picture, verification)?;
                let metric = |PlanDetection { detection, pose }| Found { detection, pose: Some(pose) };
                Ok(found.into_iter().map(metric).collect())
            }
        }
    }

    /// Whether a picture can be the calibrated camera's.
    ///
    /// # Errors
    /// A picture of another size.
    pub fn check_picture(&self, picture: &RgbImage) -> Result<()> {
        match self {
            Self::AnyCamera(_) => Ok(()),
            Self::Calibrated(camera, _) => camera.check_picture(picture),
        }
    }

    /// Width and height of the calibrated camera's pictures.
    pub fn picture_size(&self) -> Option<[u32; 2]> {
        match self {
            Self::AnyCamera(_) => None,
            Self::Calibrated(camera, _) => Some(camera.size_px()),
        }
    }

    /// Which way up its pictures are: a calibration knows the sensor's pixels.
    pub fn pixel_frame(&self) -> PixelFrame {
        match self {
            Self::AnyCamera(_) => PixelFrame::Upright,
            Self::Calibrated(..) => PixelFrame::Sensor,
        }
    }

    /// The same for a tracker.
    pub fn to_part_detector(&self) -> PartDetector {
        match self {
            Self::AnyCamera(model) => GraspModel::clone(model).into(),
            Self::Calibrated(_, detector) => PlanDetector::clone(detector).into(),
        }
    }

    pub fn model(&self) -> &GraspModel {
        match self {
            Self::AnyCamera(model) => model,
            Self::Calibrated(_, detector) => detector.model(),
        }
    }

    /// The part's size in a picture over its size in the photo; `None` where that says nothing: by a calibrated camera, or without
    /// the check.
    pub fn size_of(&self, detection: &GraspDetection, picture_size: [u32; 2]) -> Option<f64> {
        match self {
            Self::AnyCamera(model) => model.size_of(detection, picture_size),
            Self::Calibrated(..) => None,
        }
    }

    /// Where a picture differs from the demonstration under each detection; `None` as [`Self::size_of`].
    pub fn differences(&self, picture: &RgbImage, detections: &[&GraspDetection]) -> Vec<Option<Differences>> {
        match self {
            Self::AnyCamera(model) => model.differences(picture, detections),
            Self::Calibrated(..) => vec![None; detections.len()],
        }
    }

    /// What positions are given in, where they are.
    pub fn frame(&self) -> Option<Frame> {
        match self {
            Self::AnyCamera(_) => None,
            Self::Calibrated(camera, _) => Some(camera.frame),
        }
    }

    /// What a pixel covers in the plane of the marks, in metres, where the camera is known.
    pub fn metres_per_pixel(&self, pixel: &Point2<f64>) -> Option<f64> {
        match self {
            Self::AnyCamera(_) => None,
            Self::Calibrated(_, detector) => detector.metres_per_pixel(pixel),
        }
    }

    /// The middles of the grasps of those demonstrations that were cut from this very picture, in its pixels; `find` gets the
    /// picture as the model was shown it.
    pub fn taught_grasps(
        &self,
        picture: &RgbImage,
        find: fn(&RgbImage, &[TaughtDemonstration]) -> Vec<Point2<f64>>,
    ) -> Result<Vec<Point2<f64>>> {
        match self {
            Self::AnyCamera(model) => Ok(find(picture, model.demonstrations())),
            Self::Calibrated(camera, detector) => {
                camera.check_picture(picture).context("a labelled picture")?;
                let found = find(&detector.plan_view_of(picture), detector.model().demonstrations());
                Ok(found.iter().filter_map(|grasp| detector.shown(grasp)).collect())
            }
        }
    }
}
