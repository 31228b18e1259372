//! What a taught model finds in a picture, as the page draws it.

use std::time::Instant;

use image::RgbImage;
use serde::Serialize;

use crate::error::{Error, Result};
use crate::marks::Marks;
use crate::session::Session;
use crate::teacher::{FoundGrasp, GraspPose, Refusal};

/// One detection; `marks` are what accepting it would mark.
#[derive(Serialize)]
struct DetectionView {
    score: f64,
    is_accepted: bool,
    marks: Marks,
    pose: Option<GraspPose>,
    refusal: Option<Refusal>,
    touches: Vec<usize>,
}

/// All of a picture, and how long they took.
#[derive(Serialize)]
pub struct DetectionsView {
    seconds: f64,
    detections: Vec<DetectionView>,
}

/// How much is asked of a detection.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Explained {
    /// Every frame of a camera counts: reasons in words only.
    InWords,
    /// With the places where picture and demonstration differ.
    WithPlaces,
}

/// Finds the part with the model in use.
pub fn detect(session: &Session, picture: &RgbImage, explained: Explained) -> Result<DetectionsView> {
    let model = session.taught_model()?;
    let size = [picture.width(), picture.height()];
    let start = Instant::now();
    let found = match explained {
        Explained::InWords => model.detect(picture),
        Explained::WithPlaces => model.detect_explained(picture),
    };
    let found = found.map_err(Error::Teacher)?;
    let seconds = start.elapsed().as_secs_f64();
    let view = |found: FoundGrasp| DetectionView {
        score: found.score,
        is_accepted: found.is_accepted,
        marks: Marks::of_found(&found, size),
        pose: found.pose,
        refusal: found.refusal,
        touches: found.touches,
    };
    Ok(DetectionsView { seconds, detections: found.into_iter().map(view).collect() })
}
