//! A grasp model for a camera with a known pose, or for pictures of any camera.

use std::ops::RangeInclusive;

use image::RgbImage;
use nalgebra::Point2;
use sdg_calibration::{CalibratedCamera, CameraFileError, Frame};
use sdg_demonstration::PixelFrame;
use sdg_geometry::PinholeCamera;
use sdg_grasp::{
    CameraOverTable, Differences, GraspDetection, GraspError, GraspModel, PartDetector, PlanViewDetection,
    PlanViewDetector, PlanarPose, SearchRegion, TaughtDemonstration, Verification,
};

use crate::error::Result;

/// Detects grasps in pictures: in pixels, and also in metres if the camera and its pose are known.
///
/// Used by the command line, the page, the ROS 2 node, an arm's sequence, rehearsals and evaluations.
#[derive(Debug, Clone)]
pub struct Perception {
    view: View,
    frame: Option<Frame>,
}

#[derive(Debug, Clone)]
enum View {
    /// Pictures of any camera.
    AnyCamera(Box<GraspModel>),
    /// Pictures of a calibrated camera with a pose. The detector's model is adapted to plan views: it has no region,
    /// and parts have a known size.
    OverTable(Box<PlanViewDetector>, CameraOverTable),
}

/// A detection, and its pose in metres if the camera's pose is known.
#[derive(Debug, Clone)]
pub struct Found {
    /// The detection, in pixels of the picture as given.
    pub detection: GraspDetection,
    /// The pose of the grasp in the world frame of the camera's pose.
    pub pose: Option<PlanarPose>,
}

/// The camera above its table according to its file, and the frame of that pose.
///
/// # Errors
/// The file has no pose of the camera.
pub fn camera_over_table(camera: &CalibratedCamera) -> std::result::Result<(CameraOverTable, Frame), CameraFileError> {
    let (posed, table) = camera.posed()?;
    let camera_over_table =
        CameraOverTable { camera: posed, table_height_m: table.height_m, workspace: table.workspace };
    Ok((camera_over_table, table.frame))
}

impl Perception {
    /// Perception for pictures of any camera. Grasps are in pixels.
    pub fn of_any_camera(model: GraspModel) -> Self {
        Self { view: View::AnyCamera(Box::new(model)), frame: None }
    }

    /// Perception for a calibrated camera with a known pose. Grasps are also in metres, in the world frame of that
    /// pose.
    ///
    /// # Errors
    /// The model was taught without a camera, the camera does not see the plane of the marks, or the model's region is
    /// not inside the camera's pictures.
    pub fn over_table(model: GraspModel, camera_over_table: &CameraOverTable) -> Result<Self> {
        Ok(Self {
            view: View::OverTable(Box::new(PlanViewDetector::new(model, camera_over_table)?), *camera_over_table),
            frame: None,
        })
    }

    /// Like [`Self::over_table`], with the pose in the camera file.
    ///
    /// # Errors
    /// The errors of [`Self::over_table`]; or the file has no pose of the camera.
    pub fn calibrated(model: GraspModel, camera: &CalibratedCamera) -> Result<Self> {
        let (camera_over_table, frame) = camera_over_table(camera)?;
        Ok(Self { frame: Some(frame), ..Self::over_table(model, &camera_over_table)? })
    }

    /// Changes the pose of the camera, or the camera.
    ///
    /// # Errors
    /// The errors of [`Self::over_table`]; the pose is then unchanged.
    pub fn move_to(&mut self, camera_over_table: &CameraOverTable) -> Result<()> {
        match &mut self.view {
            View::AnyCamera(model) => *self = Self::over_table(GraspModel::clone(model), camera_over_table)?,
            View::OverTable(detector, at) => {
                detector.move_to(camera_over_table)?;
                *at = *camera_over_table;
            }
        }
        Ok(())
    }

    /// Sets the sizes to search in the plane of the marks, relative to the part's size; see
    /// [`PlanViewDetector::set_sizes`]. Has no effect for pictures of any camera.
    ///
    /// # Errors
    /// The range is invalid.
    pub fn set_sizes(&mut self, sizes: Option<RangeInclusive<f64>>) -> Result<()> {
        match &mut self.view {
            View::AnyCamera(_) => Ok(()),
            View::OverTable(detector, _) => Ok(detector.set_sizes(sizes)?),
        }
    }

    /// Restricts the search to this region, in pixels of the pictures, instead of the model's region; `None` searches
    /// the whole picture.
    ///
    /// # Errors
    /// The region is empty, is not inside the pictures (if their size is known), or is too small for the part. The
    /// previous region is then kept.
    pub fn look_in(&mut self, region: Option<SearchRegion>) -> Result<()> {
        match &mut self.view {
            View::AnyCamera(model) => **model = GraspModel::clone(model).with_region(region)?,
            View::OverTable(detector, _) => detector.look_in(region.as_ref())?,
        }
        Ok(())
    }

    /// The searched region, in pixels of the pictures; `None` for the whole picture.
    pub fn region(&self) -> Option<&SearchRegion> {
        match &self.view {
            View::AnyCamera(model) => model.region(),
            View::OverTable(detector, _) => detector.region(),
        }
    }

    /// Detects the part in a picture; the detections are ordered by decreasing score.
    ///
    /// # Errors
    /// The errors of [`Self::check_picture`]; or the model fails.
    pub fn detect(&self, picture: &RgbImage, verification: Verification) -> Result<Vec<Found>> {
        self.check_picture(picture)?;
        Ok(match &self.view {
            View::AnyCamera(model) => {
                let found = model.detect(picture, verification)?;
                found.into_iter().map(|detection| Found { detection, pose: None }).collect()
            }
            View::OverTable(detector, _) => {
                let metric = |PlanViewDetection { detection, pose }| Found { detection, pose: Some(pose) };
                detector.detect(picture, verification)?.into_iter().map(metric).collect()
            }
        })
    }

    /// Checks that a picture has the size of the calibrated camera's pictures, and that the region is for pictures of
    /// this size and inside the picture.
    ///
    /// # Errors
    /// The picture has another size, or the region is for another size or not inside the picture.
    pub fn check_picture(&self, picture: &RgbImage) -> Result<()> {
        self.check_size(picture)?;
        if let Some(region) = self.region() {
            region.check(picture.dimensions().into()).map_err(GraspError::from)?;
        }
        Ok(())
    }

    fn check_size(&self, picture: &RgbImage) -> Result<()> {
        let View::OverTable(_, camera_over_table) = &self.view else { return Ok(()) };
        let PinholeCamera { width, height, .. } = camera_over_table.camera.intrinsics;
        let (found_width, found_height) = picture.dimensions();
        if (found_width, found_height) == (width, height) {
            return Ok(());
        }
        Err(CameraFileError::OtherSize { width, height, found_width, found_height }.into())
    }

    /// The camera's pose; `None` for pictures of any camera.
    pub fn camera_over_table(&self) -> Option<&CameraOverTable> {
        match &self.view {
            View::AnyCamera(_) => None,
            View::OverTable(_, camera_over_table) => Some(camera_over_table),
        }
    }

    /// Width and height of the calibrated camera's pictures.
    pub fn picture_size(&self) -> Option<[u32; 2]> {
        self.camera_over_table().map(|camera_over_table| {
            [camera_over_table.camera.intrinsics.width, camera_over_table.camera.intrinsics.height]
        })
    }

    /// Orientation of the pictures: a calibration refers to the sensor's pixels.
    pub fn pixel_frame(&self) -> PixelFrame {
        match self.view {
            View::AnyCamera(_) => PixelFrame::Upright,
            View::OverTable(..) => PixelFrame::Sensor,
        }
    }

    /// The frame of positions, as named in the camera file.
    pub fn frame(&self) -> Option<Frame> {
        self.frame
    }

    /// The model. If the camera's pose is known, its parts have a known size.
    pub fn model(&self) -> &GraspModel {
        match &self.view {
            View::AnyCamera(model) => model,
            View::OverTable(detector, _) => detector.model(),
        }
    }

    /// The detector for a tracker.
    pub fn to_part_detector(&self) -> PartDetector {
        match &self.view {
            View::AnyCamera(model) => GraspModel::clone(model).into(),
            View::OverTable(detector, _) => PlanViewDetector::clone(detector).into(),
        }
    }

    /// The part's size in a picture relative to its nominal size; `None` with a calibrated camera, where this ratio has
    /// no meaning, or without verification.
    pub fn size_of(&self, detection: &GraspDetection, picture_size: [u32; 2]) -> Option<f64> {
        match &self.view {
            View::AnyCamera(model) => model.size_of(detection, picture_size),
            View::OverTable(..) => None,
        }
    }

    /// The differences between a picture and the demonstration for each detection; `None` as in [`Self::size_of`].
    pub fn differences(&self, picture: &RgbImage, detections: &[&GraspDetection]) -> Vec<Option<Differences>> {
        match &self.view {
            View::AnyCamera(model) => model.differences(picture, detections),
            View::OverTable(..) => vec![None; detections.len()],
        }
    }

    /// Length of a pixel in the plane of the marks, in metres; `None` if the camera's pose is unknown or the pixel does
    /// not show this plane.
    pub fn metres_per_pixel(&self, pixel: &Point2<f64>) -> Option<f64> {
        match &self.view {
            View::AnyCamera(_) => None,
            View::OverTable(detector, _) => detector.metres_per_pixel(pixel),
        }
    }

    /// The grasp points of the demonstrations that were taught from this picture, in its pixels. `find` receives the
    /// picture in the form used for teaching.
    ///
    /// # Errors
    /// The picture's size differs from that of the calibrated camera.
    pub fn taught_grasps(
        &self,
        picture: &RgbImage,
        find: fn(&RgbImage, &[TaughtDemonstration]) -> Vec<Point2<f64>>,
    ) -> Result<Vec<Point2<f64>>> {
        self.check_size(picture)?;
        Ok(match &self.view {
            View::AnyCamera(model) => find(picture, model.demonstrations()),
            View::OverTable(detector, _) => {
                let found = find(&detector.plan_view_of(picture), detector.model().demonstrations());
                found.iter().filter_map(|grasp| detector.shown(grasp)).collect()
            }
        })
    }
}
