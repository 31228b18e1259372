//! Detections of a taught model in a picture, for the page.

use std::time::Instant;

use image::RgbImage;
use serde::Serialize;

use crate::advice::part_cut;
use crate::error::{Error, Result};
use crate::marks::Marks;
use crate::session::Session;
use crate::teacher::{FoundGrasp, GraspPose, Refusal};

/// One detection; `marks` are the marks that accepting it would create.
#[derive(Serialize)]
struct DetectionView {
    score: f64,
    is_accepted: bool,
    marks: Marks,
    pose: Option<GraspPose>,
    refusal: Option<Refusal>,
    touches: Vec<usize>,
    /// A warning if the part touches the border of the picture: it would be a poor demonstration.
    cut: Option<String>,
}

/// All detections of a picture, and the search's duration.
#[derive(Serialize)]
pub struct DetectionsView {
    seconds: f64,
    detections: Vec<DetectionView>,
}

/// Level of detail of a detection's explanation.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Explained {
    /// Reasons in words only, which is fast enough for every frame of a camera.
    InWords,
    /// Also the positions at which picture and demonstration differ.
    WithPlaces,
}

/// Detects the part with the model in use.
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
    let view = |found: FoundGrasp| {
        let marks = Marks::of_found(&found, size);
        let cut = part_cut(&marks, size);
        let FoundGrasp { score, is_accepted, pose, refusal, touches, .. } = found;
        DetectionView { score, is_accepted, marks, pose, refusal, touches, cut }
    };
    Ok(DetectionsView { seconds, detections: found.into_iter().map(view).collect() })
}
