//! A grasp model with a camera of known pose, or for pictures of any camera.

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
/// All callers use it: the command line, the page, the ROS 2 node, an arm's sequence, rehearsals and evaluations.
#[derive(Debug, Clone)]
pub struct Perception {
    view: View,
    frame: Option<Frame>,
}

#[derive(Debug, Clone)]
enum View {
    /// Pictures of any camera.
    AnyCamera(Box<GraspModel>),
    /// Pictures of a calibrated camera with a pose; also the original model, for a camera without a pose.
    OverTable(Box<PlanViewDetector>, CameraOverTable),
}

/// A detection, with its pose in metres if the camera's pose is known.
#[derive(Debug, Clone)]
pub struct Found {
    /// In pixels of the picture as given.
    pub detection: GraspDetection,
    /// In the world frame of the camera's pose.
    pub pose: Option<PlanarPose>,
}

/// The camera over its table as given in its file, and the frame of that pose.
///
/// # Errors
/// The file has no pose of the camera.
pub fn camera_over_table(camera: &CalibratedCamera) -> std::result::Result<(CameraOverTable, Frame), CameraFileError> {
    let (posed, table) = camera.posed()?;
    let place = CameraOverTable { camera: posed, table_height_m: table.height_m, workspace: table.workspace };
    Ok((place, table.frame))
}

impl Perception {
    /// For pictures of any camera: grasps are in pixels.
    pub fn of_any_camera(model: GraspModel) -> Self {
        Self { view: View::AnyCamera(Box::new(model)), frame: None }
    }

    /// For a calibrated camera with a known pose: grasps are also in metres in the world frame of that pose.
    ///
    /// # Errors
    /// The model was taught without a camera, or the camera does not see the plane of the marks.
    pub fn over_table(model: GraspModel, place: &CameraOverTable) -> Result<Self> {
        Ok(Self { view: View::OverTable(Box::new(PlanViewDetector::new(model, place)?), *place), frame: None })
    }

    /// The same with the pose in the camera's file.
    ///
    /// # Errors
    /// Those of [`Self::over_table`]; the file has no pose of the camera.
    pub fn calibrated(model: GraspModel, camera: &CalibratedCamera) -> Result<Self> {
        let (place, frame) = camera_over_table(camera)?;
        Ok(Self { frame: Some(frame), ..Self::over_table(model, &place)? })
    }

    /// Continues with another pose of the camera, or with another camera.
    ///
    /// # Errors
    /// Those of [`Self::over_table`]; the pose is then unchanged.
    pub fn move_to(&mut self, place: &CameraOverTable) -> Result<()> {
        match &mut self.view {
            View::AnyCamera(model) => *self = Self::over_table(GraspModel::clone(model), place)?,
            View::OverTable(detector, at) => {
                detector.move_to(place)?;
                *at = *place;
            }
        }
        Ok(())
    }

    /// Searches for parts of these sizes in the plane of the marks, relative to the part's own, as
    /// [`PlanViewDetector::set_sizes`]; no effect for pictures of any camera.
    ///
    /// # Errors
    /// The range is invalid.
    pub fn set_sizes(&mut self, sizes: Option<RangeInclusive<f64>>) -> Result<()> {
        match &mut self.view {
            View::AnyCamera(_) => Ok(()),
            View::OverTable(detector, _) => Ok(detector.set_sizes(sizes)?),
        }
    }

    /// Restricts the search to this region, in pixels of the pictures, in place of the model's region; `None` searches
    /// the whole picture.
    ///
    /// # Errors
    /// The region is empty, is not inside these pictures, as far as their size is known, or is too small for the part;
    /// nothing is changed then.
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

    /// Detects the part in a picture, best score first.
    ///
    /// # Errors
    /// The picture's size differs from that of the calibrated camera or of the region; errors of the model.
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

    /// Checks that a picture can be from the calibrated camera, and that the region is inside it.
    ///
    /// # Errors
    /// The picture has another size, or the region is not inside it.
    pub fn check_picture(&self, picture: &RgbImage) -> Result<()> {
        self.check_size(picture)?;
        if let Some(region) = self.region() {
            region.check(picture.dimensions().into()).map_err(GraspError::from)?;
        }
        Ok(())
    }

    fn check_size(&self, picture: &RgbImage) -> Result<()> {
        let View::OverTable(_, place) = &self.view else { return Ok(()) };
        let PinholeCamera { width, height, .. } = place.camera.intrinsics;
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
            View::OverTable(_, place) => Some(place),
        }
    }

    /// Width and height of the calibrated camera's pictures.
    pub fn picture_size(&self) -> Option<[u32; 2]> {
        self.camera_over_table().map(|place| [place.camera.intrinsics.width, place.camera.intrinsics.height])
    }

    /// Orientation of its pictures: a calibration refers to the sensor's pixels.
    pub fn pixel_frame(&self) -> PixelFrame {
        match self.view {
            View::AnyCamera(_) => PixelFrame::Upright,
            View::OverTable(..) => PixelFrame::Sensor,
        }
    }

    /// The frame of positions, as given in the camera's file.
    pub fn frame(&self) -> Option<Frame> {
        self.frame
    }

    /// The model, with known size if the camera's pose is known.
    pub fn model(&self) -> &GraspModel {
        match &self.view {
            View::AnyCamera(model) => model,
            View::OverTable(detector, _) => detector.model(),
        }
    }

    /// The same in the form for a tracker.
    pub fn to_part_detector(&self) -> PartDetector {
        match &self.view {
            View::AnyCamera(model) => GraspModel::clone(model).into(),
            View::OverTable(detector, _) => PlanViewDetector::clone(detector).into(),
        }
    }

    /// The part's size in a picture relative to its size in the photo; `None` if that is meaningless: with a calibrated
    /// camera, or without the check.
    pub fn size_of(&self, detection: &GraspDetection, picture_size: [u32; 2]) -> Option<f64> {
        match &self.view {
            View::AnyCamera(model) => model.size_of(detection, picture_size),
            View::OverTable(..) => None,
        }
    }

    /// The differences between a picture and the demonstration for each detection; `None` as for [`Self::size_of`].
    pub fn differences(&self, picture: &RgbImage, detections: &[&GraspDetection]) -> Vec<Option<Differences>> {
        match &self.view {
            View::AnyCamera(model) => model.differences(picture, detections),
            View::OverTable(..) => vec![None; detections.len()],
        }
    }

    /// Length of a pixel in the plane of the marks, in metres, if the camera's pose is known.
    pub fn metres_per_pixel(&self, pixel: &Point2<f64>) -> Option<f64> {
        match &self.view {
            View::AnyCamera(_) => None,
            View::OverTable(detector, _) => detector.metres_per_pixel(pixel),
        }
    }

    /// The middles of the grasps of those demonstrations that come from this picture, in its pixels; `find` receives
    /// the picture in the form in which the model was taught it.
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
