//! What a taught model finds in a picture, as the page draws it.

use std::time::Instant;

use image::RgbImage;
use serde::Serialize;

use crate::error::{Error, Result};
use crate::marks::Marks;
use crate::session::Session;
use crate::teacher::{FoundGrasp, GraspPose};

/// One detection; `marks` are what accepting it would mark.
#[derive(Serialize)]
struct DetectionView {
    score: f64,
    is_accepted: bool,
    marks: Marks,
    pose: Option<GraspPose>,
}

/// All of a picture, and how long they took.
#[derive(Serialize)]
pub struct DetectionsView {
    seconds: f64,
    detections: Vec<DetectionView>,
}

/// Finds the part with the model taught last.
pub fn detect(session: &Session, picture: &RgbImage) -> Result<DetectionsView> {
    let model = session.taught_model()?;
    let size = [picture.width(), picture.height()];
    let start = Instant::now();
    let found = model.detect(picture).map_err(Error::Teacher)?;
    let seconds = start.elapsed().as_secs_f64();
    let view = |found: FoundGrasp| DetectionView {
        score: found.score,
        is_accepted: found.is_accepted,
        marks: Marks::of_found(&found, size),
        pose: found.pose,
    };
    Ok(DetectionsView { seconds, detections: found.into_iter().map(view).collect() })
}
