//! The detector for search and tracking: a model, with or without a calibrated camera.

use std::sync::Arc;

use image::{RgbImage, imageops};

use burn::tensor::read_sync;
use sdg_shape::PixelRect;

use crate::detection::{Found, GraspDetection};
use crate::error::Result;
use crate::model::{GraspModel, Verification};
use crate::plan_view::{PlanViewDetector, PlanarPose};
use crate::region::SearchRegion;

/// A model, and its plan view if the camera is calibrated.
#[derive(Debug, Clone)]
pub enum PartDetector {
    /// Poses in pixels only.
    Picture(Box<GraspModel>),
    /// Poses in pixels and in metres.
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

    /// Width and height of the searched image: the picture or the plan view.
    pub(super) fn frame_size(&self, picture: &RgbImage) -> [u32; 2] {
        match self {
            Self::Picture(_) => [picture.width(), picture.height()],
            Self::PlanView(detector) => detector.view_size(),
        }
    }

    /// Width and height of a picture whose searched image has this size.
    pub(super) fn picture_size(&self, searched: [u32; 2]) -> [u32; 2] {
        match self {
            Self::Picture(_) => searched,
            Self::PlanView(detector) => detector.picture_size(),
        }
    }

    /// The pixels of a rectangle of the searched image.
    pub(super) fn window(&self, picture: &RgbImage, rect: &PixelRect) -> RgbImage {
        match self {
            Self::Picture(_) => {
                let PixelRect { left, top, width, height } = *rect;
                imageops::crop_imm(picture, left, top, width, height).to_image()
            }
            Self::PlanView(detector) => detector.window_of(picture, rect),
        }
    }

    /// The detections in a whole picture, in pixels of the searched image.
    fn find(&self, picture: &RgbImage) -> Result<Vec<Found>> {
        match self {
            Self::Picture(model) => read_sync(model.find_async(picture, Verification::ByShape)),
            Self::PlanView(detector) => detector.find(picture, Verification::ByShape),
        }
    }

    /// The searched region of the picture, in its pixels; `None` for the whole picture.
    pub(super) fn region(&self) -> Option<&SearchRegion> {
        match self {
            Self::Picture(model) => model.region(),
            Self::PlanView(detector) => detector.region(),
        }
    }

    /// Converts a detection to pixels of the picture and to metres; `None` if it is outside the picture.
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

/// A search of one frame, which the caller runs at a time of its choice.
#[derive(Debug)]
pub struct PartSearch {
    pub(super) number: u64,
    pub(super) picture: Arc<RgbImage>,
    pub(super) detector: Arc<PartDetector>,
}

/// The result of a search.
pub struct SearchOutcome {
    pub(super) number: u64,
    pub(super) found: Result<Vec<Found>>,
}

impl PartSearch {
    /// Runs the search, which takes some tens to some hundreds of milliseconds.
    pub fn run(&self) -> SearchOutcome {
        SearchOutcome { number: self.number, found: self.detector.find(&self.picture) }
    }
}
