//! What parts are searched for with and followed with: a model, with or without a calibrated camera.

use std::sync::Arc;

use image::{RgbImage, imageops};

use burn::tensor::read_sync;
use sdg_shape::PixelRect;

use crate::detection::{Found, GraspDetection};
use crate::error::Result;
use crate::model::{GraspModel, Verification};
use crate::plan_view::{PlanViewDetector, PlanarPose};
use crate::region::SearchRegion;

/// A model, and the plan view that it works in where the camera is calibrated.
#[derive(Debug, Clone)]
pub enum PartDetector {
    /// Poses in pixels alone.
    Picture(Box<GraspModel>),
    /// Poses in metres, too.
    PlanView(Box<PlanViewDetector>),
}

impl From<GraspModel> for PartDetector {
    fn from(model: GraspModel) -> Self {
        Self::Picture(Box::new(model))
    }
}

impl From<PlanViewDetector> for PartDetector {
    fn from(detector: PlanViewDetector) -> Self {
        Self::PlanView(Box::new(detector))
    }
}

impl PartDetector {
    pub(super) fn model(&self) -> &GraspModel {
        match self {
            Self::Picture(model) => model,
            Self::PlanView(detector) => detector.model(),
        }
    }

    /// Width and height of the frame of reference.
    pub(super) fn frame_size(&self, picture: &RgbImage) -> [u32; 2] {
        match self {
            Self::Picture(_) => [picture.width(), picture.height()],
            Self::PlanView(detector) => detector.view_size(),
        }
    }

    /// A rectangle of the frame of reference, within it.
    pub(super) fn window(&self, picture: &RgbImage, rect: &PixelRect) -> RgbImage {
        match self {
            Self::Picture(_) => {
                let PixelRect { left, top, width, height } = *rect;
                imageops::crop_imm(picture, left, top, width, height).to_image()
            }
            Self::PlanView(detector) => detector.window_of(picture, rect),
        }
    }

    /// What a whole picture shows; detections in the frame of reference.
    fn find(&self, picture: &RgbImage) -> Result<Vec<Found>> {
        match self {
            Self::Picture(model) => read_sync(model.find_async(picture, Verification::ByShape)),
            Self::PlanView(detector) => detector.find(picture, Verification::ByShape),
        }
    }

    /// The part of the picture that is searched, in its pixels; all of it where `None`.
    pub(super) fn region(&self) -> Option<&SearchRegion> {
        match self {
            Self::Picture(model) => model.region(),
            Self::PlanView(detector) => detector.region(),
        }
    }

    /// A detection of the frame of reference in pixels of the picture, and in metres; `None` where the camera does not show it.
    pub(super) fn output(&self, detection: GraspDetection) -> Option<(GraspDetection, Option<PlanarPose>)> {
        match self {
            Self::Picture(_) => Some((detection, None)),
            Self::PlanView(detector) => {
                let placed = detector.placed(detection)?;
                Some((placed.detection, Some(placed.pose)))
            }
        }
    }
}

/// A search of one frame, to be run where there is time for it.
#[derive(Debug)]
pub struct PartSearch {
    pub(super) number: u64,
    pub(super) picture: Arc<RgbImage>,
    pub(super) detector: Arc<PartDetector>,
}

/// What a search found.
pub struct SearchOutcome {
    pub(super) number: u64,
    pub(super) found: Result<Vec<Found>>,
}

impl PartSearch {
    /// Searches: some tens to some hundreds of milliseconds.
    pub fn run(&self) -> SearchOutcome {
        SearchOutcome { number: self.number, found: self.detector.find(&self.picture) }
    }
}
