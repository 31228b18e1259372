//! Records of the pictures of an axis, as the store keeps them.

use sdg_simulation::views::Axis;
use serde::{Deserialize, Serialize};

use super::way::Way;

/// A detection beside the instance of the part that it lies nearest to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PlacedDetection {
    /// Its score: accepted from 0.5 on.
    pub score: f64,
    /// The network's own score.
    pub network_score: f64,
    /// How well the demonstration agrees there, where it was asked.
    pub agreement: Option<f64>,
    /// Place beside the instance, in millimetres; `None` without an instance or a place on the table.
    pub error_mm: Option<f64>,
    /// Turn beside the instance, in degrees, modulo the part's symmetry.
    pub error_deg: Option<f64>,
    /// The instance that it found: within 10 mm and 10°, and found by no better detection.
    pub found: Option<usize>,
}

/// A model's detections in a picture: all that it accepts, best first; the best that it refuses where it accepts nothing.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// Where there is at most one instance, the best alone.
    pub detections: Vec<PlacedDetection>,
}

impl PlacedDetection {
    /// Whether the part was detected.
    pub fn is_accepted(&self) -> bool {
        self.score >= 0.5
    }
}

impl Answer {
    /// Whether anything is accepted.
    pub fn is_accepted(&self) -> bool {
        self.detections.iter().any(PlacedDetection::is_accepted)
    }

    /// Whether an instance was found.
    pub fn has_found(&self, instance: usize) -> bool {
        self.detections.iter().any(|detection| detection.found == Some(instance))
    }

    /// Detections that are accepted and not right.
    pub fn num_wrong(&self) -> usize {
        self.detections.iter().filter(|detection| detection.is_accepted() && detection.found.is_none()).count()
    }
}

/// In what a look-alike differs from the part.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LookAlike {
    /// Which kind, in words.
    pub kind: String,
    /// Whether size alone tells the two apart, which no picture shows without a camera.
    pub differs_in_size_alone: bool,
}

/// A picture of an axis and a model's detections in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AxisPicture {
    /// Which of the axis' pictures.
    pub number: u64,
    /// How much the axis changed.
    pub parameter: f64,
    /// What the parameter counts.
    pub unit: String,
    /// The share of each instance of the part that is seen; empty where the part is not there.
    pub visible: Vec<f64>,
    /// What lies there instead of the part.
    pub look_alike: Option<LookAlike>,
    /// With the check against the demonstration.
    pub verified: Answer,
    /// The network alone; `None` for a model without one.
    pub alone: Option<Answer>,
}

/// A model on the pictures of one part and axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AxisRecord {
    /// One each, in their order.
    pub pictures: Vec<AxisPicture>,
    /// Time for this model's detections, and its part of the time for drawing, in seconds of a worker.
    pub seconds: f64,
}

/// A case that two models can both be asked for: a picture's number, and the instance of the part in it.
pub type Case = (u64, usize);

impl AxisPicture {
    /// The detections made in one way.
    fn answer(&self, way: Way) -> Option<&Answer> {
        match way {
            Way::WithCheck => Some(&self.verified),
            Way::NetworkAlone => self.alone.as_ref(),
        }
    }
}

impl AxisRecord {
    /// The detections in each picture made in one way; none for a model without that way.
    pub fn answers(&self, way: Way) -> impl Iterator<Item = &Answer> {
        self.pictures.iter().filter_map(move |picture| picture.answer(way))
    }

    /// Each case and whether it was answered right: an instance found, a look-alike refused.
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
