//! A picture searched: what was found, in pixels and over the table.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use image::RgbImage;
use nalgebra::Point2;
use sdg_grasp::{CameraOverTable, Device, GraspDetection, GraspModel, PlanDetector, Verification};
use sdg_ros2::found::FoundPart;
use sdg_ros2::messages::Header;

use super::pictures::Picture;
use crate::files;

/// A grasp model, and the camera behind which it was last used.
pub(super) struct Searcher {
    model: Option<GraspModel>,
    placed: Option<PlanDetector>,
    min_score: f64,
}

/// A picture's result.
pub(super) struct Searched {
    pub(super) header: Header,
    pub(super) arrived: Instant,
    /// Best first.
    pub(super) found: Vec<FoundPart>,
    /// The same as they are drawn.
    pub(super) detections: Vec<GraspDetection>,
    pub(super) picture: std::sync::Arc<RgbImage>,
    pub(super) search_secs: f64,
}

impl Searcher {
    pub(super) fn new(model: Option<GraspModel>, min_score: f64) -> Self {
        Self { model, placed: None, min_score }
    }

    /// Uses another model from now on.
    ///
    /// # Errors
    /// A file that is no model.
    pub(super) fn change_model(&mut self, path: &Path, device: &Device) -> Result<()> {
        self.model = Some(files::read_model(path, device)?);
        self.placed = None;
        Ok(())
    }

    pub(super) fn model(&self) -> Option<&GraspModel> {
        self.model.as_ref()
    }

    /// Searches a picture; `over_table` is where its camera was.
    ///
    /// # Errors
    /// No model, one without lengths behind a calibrated camera, a picture of another size than the camera's.
    pub(super) fn search(&mut self, picture: &Picture, over_table: Option<&CameraOverTable>) -> Result<Searched> {
        let model = self.model.as_ref().context("no grasp model yet: --grasp-model, or the service teach")?;
        let started = Instant::now();
        let part = |detection: &GraspDetection, grasp| FoundPart {
            name: model.object().to_owned(),
            score: detection.score,
            corners: [
                Point2::new(detection.bbox.x1, detection.bbox.y1),
                Point2::new(detection.bbox.x2, detection.bbox.y2),
            ],
            grasp,
        };
        let (found, detections) = match over_table {
            None => {
                let detections = model.detect(&picture.picture, Verification::ByShape)?;
                (detections.iter().map(|detection| part(detection, None)).collect(), detections)
            }
            Some(over_table) => {
                let camera = &over_table.camera;
                let (expected, found) =
                    ((camera.intrinsics.width, camera.intrinsics.height), picture.picture.dimensions());
                if expected != found {
                    let ((w, h), (width, height)) = (expected, found);
                    anyhow::bail!("expected pictures of {w} × {h} pixels, as the camera has, found {width} × {height}");
                }
                let detector = match self.placed.take() {
                    Some(detector) => detector.moved_to(over_table)?,
                    None => PlanDetector::new(model.clone(), over_table)?,
                };
                let placed = self.placed.insert(detector).detect(&picture.picture, Verification::ByShape)?;
                let camera_from_world = camera.world_from_camera.inverse();
                let found: Vec<FoundPart> = placed
                    .iter()
                    .map(|one| {
                        let camera_from_tcp = camera_from_world * one.pose.frame_from_tcp();
                        part(&one.detection, Some((camera_from_tcp, one.pose.opening_m)))
                    })
                    .collect();
                (found, placed.into_iter().map(|one| one.detection).collect())
            }
        };
        let is_kept = |score: f64| score >= self.min_score;
        Ok(Searched {
            header: picture.header.clone(),
            arrived: picture.arrived,
            found: found.into_iter().filter(|part| is_kept(part.score)).collect(),
            detections: detections.into_iter().filter(|detection| is_kept(detection.score)).collect(),
            picture: std::sync::Arc::clone(&picture.picture),
            search_secs: started.elapsed().as_secs_f64(),
        })
    }
}
