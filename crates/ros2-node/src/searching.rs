//! Searches pictures; the detections are in pixels and, with a camera pose, on the table.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use image::RgbImage;
use nalgebra::Point2;
use sdg_cell::{Found, Perception, drawing};
use sdg_grasp::{CameraOverTable, Device, GraspDetection, GraspError, GraspModel, Verification};
use sdg_ros2::found::FoundPart;
use sdg_ros2::messages::Header;

use crate::pictures::Picture;

/// A grasp model, and its perception with a camera.
pub(super) struct Searcher {
    /// The model as read from its file, for grasps by the arm.
    model: Option<GraspModel>,
    perception: Option<Perception>,
    min_score: f64,
    /// Whether the pictures have camera poses or an arm grasps, for which a model without lengths cannot be used.
    needs_lengths: bool,
}

/// A picture's result.
pub(super) struct Searched {
    pub(super) header: Header,
    pub(super) arrived: Instant,
    /// The node's minimum score.
    pub(super) min_score: f64,
    /// The parts that were found, best first.
    pub(super) found: Vec<FoundPart>,
    /// The same detections in the form for drawing.
    pub(super) detections: Vec<GraspDetection>,
    pub(super) picture: std::sync::Arc<RgbImage>,
    pub(super) search_secs: f64,
}

impl Searched {
    /// Removes the parts below the node's minimum score.
    pub(super) fn keep_by_setting(&mut self) {
        self.found.retain(|part| part.score >= self.min_score);
        self.detections.retain(|detection| detection.score >= self.min_score);
    }

    /// The picture with its detections drawn; those with at least the node's minimum score are accepted.
    pub(super) fn overlay(&self) -> RgbImage {
        let mut drawn = RgbImage::clone(&self.picture);
        drawing::draw_detections(&mut drawn, self.detections.iter(), self.min_score, &[], Vec::new());
        drawn
    }
}

impl Searcher {
    pub(super) fn new(model: Option<GraspModel>, min_score: f64, needs_lengths: bool) -> Self {
        let perception = model.clone().map(Perception::of_any_camera);
        Self { model, perception, min_score, needs_lengths }
    }

    /// Replaces the model.
    ///
    /// # Errors
    /// An error if the file is not a model, or if the model has no lengths although the node needs them; the previous
    /// model then remains.
    pub(super) fn change_model(&mut self, path: &Path, device: &Device) -> Result<()> {
        let model = sdg_inputs::read_model(path, device)?;
        if self.needs_lengths && model.facts().lengths.is_none() {
            return Err(GraspError::NoLengths.into());
        }
        *self = Self::new(Some(model), self.min_score, self.needs_lengths);
        Ok(())
    }

    pub(super) fn model(&self) -> Option<&GraspModel> {
        self.model.as_ref()
    }

    /// Searches a picture. `over_table` is the camera with its pose, which a node has for all pictures or for none.
    ///
    /// # Errors
    /// An error if there is no model, if the model has no lengths although the camera is calibrated, or if the
    /// picture's size differs from the camera's.
    pub(super) fn search(&mut self, picture: &Picture, over_table: Option<&CameraOverTable>) -> Result<Searched> {
        const NO_MODEL: &str = "no grasp model yet: start the node with one, or call the service teach";
        let perception = self.perception.as_mut().context(NO_MODEL)?;
        let started = Instant::now();
        if let Some(over_table) = over_table {
            perception.move_to(over_table)?;
        }
        let name = perception.model().object();
        let part = |Found { detection, pose }: &Found| FoundPart {
            name: name.to_owned(),
            score: detection.score,
            corners: [
                Point2::new(detection.bbox.x1, detection.bbox.y1),
                Point2::new(detection.bbox.x2, detection.bbox.y2),
            ],
            grasp: pose.zip(over_table).map(|(pose, over_table)| {
                (over_table.camera.world_from_camera.inverse() * pose.frame_from_tcp(), pose.opening_m)
            }),
        };
        let seen = perception.detect(&picture.picture, Verification::ByShape)?;
        let found = seen.iter().map(part).collect();
        Ok(Searched {
            header: picture.header.clone(),
            arrived: picture.arrived,
            min_score: self.min_score,
            found,
            detections: seen.into_iter().map(|found| found.detection).collect(),
            picture: std::sync::Arc::clone(&picture.picture),
            search_secs: started.elapsed().as_secs_f64(),
        })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use sdg_geometry::{Angle, BoundingBox, PlanarGrasp};
    use sdg_grasp::TurnSource;

    use super::*;

    #[test]
    fn an_overlay_accepts_detections_from_the_minimum_score_of_the_node() {
        let detection = GraspDetection {
            demonstration_idx: 0,
            score: 0.4,
            network_score: 0.0,
            agreement: Some(0.4),
            evidence: None,
            bbox: BoundingBox { x1: 100.0, y1: 100.0, x2: 200.0, y2: 180.0 },
            keypoints: Vec::new(),
            outline: None,
            grasp: PlanarGrasp { x: 150.0, y: 140.0, angle: Angle::ZERO, width: 30.0 },
            turn_source: TurnSource::Search,
            light: 1.0,
        };
        let overlay = |min_score: f64| {
            let searched = Searched {
                header: Header::default(),
                arrived: Instant::now(),
                min_score,
                found: Vec::new(),
                detections: vec![detection.clone()],
                picture: Arc::new(RgbImage::new(400, 300)),
                search_secs: 0.1,
            };
            searched.overlay()
        };
        assert!(overlay(0.3) == overlay(0.4));
        assert!(overlay(0.3) != overlay(0.5), "a refused detection is drawn in another colour");
    }
}
