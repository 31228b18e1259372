//! Stored records of the pictures of an axis.

use sdg_simulation::views::Axis;
use serde::{Deserialize, Serialize};

use super::way::Way;

/// A detection compared with the instance that it found, or else with the nearest one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PlacedDetection {
    /// Score of the detection; accepted from 0.5.
    pub score: f64,
    /// The network's own score.
    pub network_score: f64,
    /// Agreement with the demonstration at the detection, if it was checked.
    pub agreement: Option<f64>,
    /// Position error, in millimetres; `None` without an instance or a position on the table.
    pub error_mm: Option<f64>,
    /// Angle error, in degrees, modulo the part's symmetry.
    pub error_deg: Option<f64>,
    /// The instance that the detection found: within 10 mm and 10° (slants: 3 mm and 3°), and not found by a better
    /// detection.
    pub found: Option<usize>,
}

/// A model's detections in a picture: all accepted ones, best first, or the best refused one if none is accepted.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The detections; only the best one if there is at most one instance.
    pub detections: Vec<PlacedDetection>,
}

impl PlacedDetection {
    /// Whether the detection is accepted.
    pub fn is_accepted(&self) -> bool {
        self.score >= 0.5
    }
}

impl Answer {
    /// Whether any detection is accepted.
    pub fn is_accepted(&self) -> bool {
        self.detections.iter().any(PlacedDetection::is_accepted)
    }

    /// Whether this instance was found.
    pub fn has_found(&self, instance: usize) -> bool {
        self.detections.iter().any(|detection| detection.found == Some(instance))
    }

    /// Number of accepted detections that found no instance.
    pub fn num_wrong(&self) -> usize {
        self.detections.iter().filter(|detection| detection.is_accepted() && detection.found.is_none()).count()
    }
}

/// The difference between a look-alike and the part.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LookAlike {
    /// Its kind, in words.
    pub kind: String,
    /// Whether only the size differs, which is not visible in a picture without a calibrated camera.
    pub differs_in_size_alone: bool,
}

/// A picture of an axis, and a model's detections in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AxisPicture {
    /// Index among the pictures of the axis.
    pub number: u64,
    /// Value of the parameter of the axis.
    pub parameter: f64,
    /// Unit of the parameter.
    pub unit: String,
    /// Visible fraction of each instance; empty without the part.
    pub visible: Vec<f64>,
    /// The look-alike that replaces the part.
    pub look_alike: Option<LookAlike>,
    /// Detections with the check against the demonstration.
    pub verified: Answer,
    /// Detections of the network alone; `None` for a model without a network.
    pub alone: Option<Answer>,
}

/// The results of a model in the pictures of one part and axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AxisRecord {
    /// One record per picture, in order.
    pub pictures: Vec<AxisPicture>,
    /// Worker time in seconds: this model's detections, and its portion of the rendering.
    pub seconds: f64,
}

/// A case for comparing two models: a picture's number, and the instance of the part in it.
pub type Case = (u64, usize);

impl AxisPicture {
    /// A picture with one instance, which was found or for which another place was accepted.
    #[cfg(test)]
    pub(super) fn for_test(number: u64, found: bool) -> Self {
        let detection = PlacedDetection {
            score: 0.9,
            network_score: 0.9,
            agreement: None,
            error_mm: Some(if found { 1.0 } else { 30.0 }),
            error_deg: Some(1.0),
            found: found.then_some(0),
        };
        let answer = Answer { detections: vec![detection] };
        Self {
            number,
            parameter: 1.0,
            unit: "degrees".into(),
            visible: vec![1.0],
            look_alike: None,
            verified: answer.clone(),
            alone: Some(answer),
        }
    }

    /// The detections of one way.
    fn answer(&self, way: Way) -> Option<&Answer> {
        match way {
            Way::WithCheck => Some(&self.verified),
            Way::NetworkAlone => self.alone.as_ref(),
        }
    }
}

impl AxisRecord {
    /// The detections in each picture for one way; empty for a model that does not have this way.
    pub fn answers(&self, way: Way) -> impl Iterator<Item = &Answer> {
        self.pictures.iter().filter_map(move |picture| picture.answer(way))
    }

    /// Each case, and whether the model was correct: an instance found, or a look-alike refused.
    pub fn outcomes(&self, axis: Axis, way: Way) -> Vec<(Case, bool)> {
        let mut outcomes = Vec::new();
        for picture in &self.pictures {
            let Some(answer) = picture.answer(way) else { continue };
            if axis == Axis::LookAlikes {
                outcomes.push(((picture.number, 0), !answer.is_accepted()));
            } else {
                let instances = 0..picture.visible.len();
                outcomes.extend(instances.map(|instance| ((picture.number, instance), answer.has_found(instance))));
            }
        }
        outcomes
    }
}
