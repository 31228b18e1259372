//! A grasp model behind a camera whose place is known, or behind any camera.

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

/// Pictures in, grasps out: in pixels, and in metres as well where the camera and its place are known.
///
/// Every caller looks through this: the command line, the page, the ROS 2 node, an arm's sequence, rehearsals and evaluations.
#[derive(Debug, Clone)]
pub struct Perception {
    view: View,
    frame: Option<Frame>,
}

#[derive(Debug, Clone)]
enum View {
    /// Pictures of any camera.
    AnyCamera(Box<GraspModel>),
    /// Those of a calibrated camera in its place; the model as it was given, for a camera without place.
    OverTable(Box<PlanViewDetector>, CameraOverTable),
}

/// A detection, in metres as well where the camera's place is known.
#[derive(Debug, Clone)]
pub struct Found {
    /// In pixels of the picture as given.
    pub detection: GraspDetection,
    /// In the world of the camera's place.
    pub pose: Option<PlanarPose>,
}

/// A camera over its table as its file says, and the frame of that.
///
/// # Errors
/// A file without the camera's pose.
pub fn camera_over_table(camera: &CalibratedCamera) -> std::result::Result<(CameraOverTable, Frame), CameraFileError> {
    let (posed, table) = camera.posed()?;
    let place = CameraOverTable { camera: posed, table_height_m: table.height_m, workspace: table.workspace };
    Ok((place, table.frame))
}

impl Perception {
    /// Looks at pictures of any camera: grasps are in pixels.
    pub fn of_any_camera(model: GraspModel) -> Self {
        Self { view: View::AnyCamera(Box::new(model)), frame: None }
    }

    /// Looks through a calibrated camera in its place: grasps are in metres of the place's world as well.
    ///
    /// # Errors
    /// A model that was taught without a camera; a camera that does not see the plane of the marks.
    pub fn over_table(model: GraspModel, place: &CameraOverTable) -> Result<Self> {
        Ok(Self { view: View::OverTable(Box::new(PlanViewDetector::new(model, place)?), *place), frame: None })
    }

    /// The same with the place that the camera's file has.
    ///
    /// # Errors
    /// As [`Self::over_table`]; a file without the camera's pose.
    pub fn calibrated(model: GraspModel, camera: &CalibratedCamera) -> Result<Self> {
        let (place, frame) = camera_over_table(camera)?;
        Ok(Self { frame: Some(frame), ..Self::over_table(model, &place)? })
    }

    /// Goes on from another place of the camera, or with another camera.
    ///
    /// # Errors
    /// As [`Self::over_table`]; the place then stays what it was.
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

    /// Looks for parts of these sizes in the plane of the marks, over the part's own, as [`PlanViewDetector::look_for_sizes`]; nothing changes
    /// for pictures of any camera.
    ///
    /// # Errors
    /// A range that is none.
    pub fn look_for_sizes(&mut self, sizes: Option<RangeInclusive<f64>>) -> Result<()> {
        match &mut self.view {
            View::AnyCamera(_) => Ok(()),
            View::OverTable(detector, _) => Ok(detector.look_for_sizes(sizes)?),
        }
    }

    /// Searches this part of pictures alone, in their pixels, instead of the part that the model's file says; all of them with `None`.
    ///
    /// # Errors
    /// A region without pixels, and one that cannot be of these pictures, as far as their size is known, or that the part does not fit in;
    /// nothing is changed then.
    pub fn look_in(&mut self, region: Option<SearchRegion>) -> Result<()> {
        match &mut self.view {
            View::AnyCamera(model) => **model = GraspModel::clone(model).with_region(region)?,
            View::OverTable(detector, _) => detector.look_in(region.as_ref())?,
        }
        Ok(())
    }

    /// The part of pictures that is searched, in their pixels; all of them where `None`.
    pub fn region(&self) -> Option<&SearchRegion> {
        match &self.view {
            View::AnyCamera(model) => model.region(),
            View::OverTable(detector, _) => detector.region(),
        }
    }

    /// Finds the part in a picture, best score first.
    ///
    /// # Errors
    /// A picture of another size than the calibrated camera's or than the region is for; the model's own errors.
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

    /// Whether a picture can be the calibrated camera's, and whether the region is one of it.
    ///
    /// # Errors
    /// A picture of another size, and a region that does not lie in it.
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

    /// Where the camera is; `None` for pictures of any camera.
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

    /// Which way up its pictures are: a calibration knows the sensor's pixels.
    pub fn pixel_frame(&self) -> PixelFrame {
        match self.view {
            View::AnyCamera(_) => PixelFrame::Upright,
            View::OverTable(..) => PixelFrame::Sensor,
        }
    }

    /// The frame of positions, as the camera's file says.
    pub fn frame(&self) -> Option<Frame> {
        self.frame
    }

    /// The model, with its size known where the camera's place is.
    pub fn model(&self) -> &GraspModel {
        match &self.view {
            View::AnyCamera(model) => model,
            View::OverTable(detector, _) => detector.model(),
        }
    }

    /// The same for a tracker.
    pub fn to_part_detector(&self) -> PartDetector {
        match &self.view {
            View::AnyCamera(model) => GraspModel::clone(model).into(),
            View::OverTable(detector, _) => PlanViewDetector::clone(detector).into(),
        }
    }

    /// The part's size in a picture over its size in the photo; `None` where that says nothing: by a calibrated camera, or without
    /// the check.
    pub fn size_of(&self, detection: &GraspDetection, picture_size: [u32; 2]) -> Option<f64> {
        match &self.view {
            View::AnyCamera(model) => model.size_of(detection, picture_size),
            View::OverTable(..) => None,
        }
    }

    /// Where a picture differs from the demonstration under each detection; `None` as [`Self::size_of`].
    pub fn differences(&self, picture: &RgbImage, detections: &[&GraspDetection]) -> Vec<Option<Differences>> {
        match &self.view {
            View::AnyCamera(model) => model.differences(picture, detections),
            View::OverTable(..) => vec![None; detections.len()],
        }
    }

    /// Length that a pixel covers in the plane of the marks, in metres, where the camera's place is known.
    pub fn metres_per_pixel(&self, pixel: &Point2<f64>) -> Option<f64> {
        match &self.view {
            View::AnyCamera(_) => None,
            View::OverTable(detector, _) => detector.metres_per_pixel(pixel),
        }
    }

    /// The middles of the grasps of those demonstrations that were cut from this very picture, in its pixels; `find` gets the
    /// picture as the model was shown it.
    ///
    /// # Errors
    /// A picture of another size than the calibrated camera's.
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
