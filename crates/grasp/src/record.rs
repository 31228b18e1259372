//! A detection for other programs: the output of `sdg detect --json`, and the input of the browser's page.

use serde::Serialize;

use crate::detection::GraspDetection;
use crate::{Contributions, ModelKind, TurnSource};

/// A [`GraspDetection`] with the field names that files and programs rely on; pixels and degrees.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DetectionRecord {
    /// Calibrated, in `[0, 1]`: at least 0.5 is accepted.
    pub score: f64,
    /// The network's score, in `[0, 1]`; null without a network (model S).
    pub network_score: Option<f64>,
    /// Agreement of demonstration and image, in `[0, 1]`; null without verification.
    pub agreement: Option<f64>,
    /// The box: left, top, right, bottom.
    #[serde(rename = "box")]
    pub bounds: [f64; 4],
    /// The keypoints: x, y and the network's score of each; empty for models without keypoints.
    pub keypoints: Vec<[f64; 3]>,
    /// The outline's corners; absent without verification.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polygon: Option<Vec<[f64; 2]>>,
    /// Grasp point, direction and width.
    pub grasp: GraspRecord,
    /// The source of the first estimate of the orientation.
    pub turn_source: TurnSource,
    /// The contributions to the score, in log-odds; absent without verification.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub evidence: Option<Contributions>,
    /// The reason for a refusal, in words; absent for an accepted detection.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<&'static str>,
}

/// A [`sdg_geometry::PlanarGrasp`] in pixels and degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GraspRecord {
    /// Position to the right, in pixels.
    pub x: f64,
    /// Position downwards, in pixels.
    pub y: f64,
    /// Direction of the marked line, in (-180, 180], y down; the jaws close across it.
    pub angle_deg: f64,
    /// The part's width between the jaws, in pixels.
    pub width_px: f64,
}

impl DetectionRecord {
    /// The record of a detection by a model of this kind.
    pub fn new(detection: &GraspDetection, kind: ModelKind) -> Self {
        let b = detection.bbox;
        let grasp = detection.grasp;
        Self {
            score: detection.score,
            network_score: (kind != ModelKind::S).then_some(detection.network_score),
            agreement: detection.agreement,
            bounds: [b.x1, b.y1, b.x2, b.y2],
            keypoints: detection.keypoints.iter().map(|(point, score)| [point.x, point.y, *score]).collect(),
            polygon: detection.outline.as_ref().map(|o| o.vertices.iter().map(|v| [v.x, v.y]).collect()),
            grasp: GraspRecord { x: grasp.x, y: grasp.y, angle_deg: grasp.angle.degrees(), width_px: grasp.width },
            turn_source: detection.turn_source,
            evidence: detection.evidence,
            refused: detection.refused(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;
    use sdg_geometry::{Angle, BoundingBox, PlanarGrasp, Polygon};

    #[test]
    fn names_and_units_are_as_documented() {
        let bbox = BoundingBox { x1: 1.0, y1: 2.0, x2: 3.0, y2: 4.0 };
        let detection = GraspDetection {
            demonstration_idx: 0,
            score: 0.75,
            network_score: 0.5,
            agreement: None,
            evidence: None,
            bbox,
            keypoints: vec![(Point2::new(1.5, 2.5), 0.25)],
            outline: None,
            grasp: PlanarGrasp { x: 2.0, y: 3.0, angle: Angle::from_degrees(90.0), width: 8.0 },
            turn_source: TurnSource::Keypoints,
            light: 1.0,
        };
        let json = serde_json::to_string(&DetectionRecord::new(&detection, ModelKind::C)).unwrap();
        let expected = r#"{"score":0.75,"network_score":0.5,"agreement":null,"box":[1.0,2.0,3.0,4.0],"#.to_owned()
            + r#""keypoints":[[1.5,2.5,0.25]],"grasp":{"x":2.0,"y":3.0,"angle_deg":90.0,"width_px":8.0},"#
            + r#""turn_source":"keypoints"}"#;
        assert_eq!(json, expected);
        let json = serde_json::to_string(&DetectionRecord::new(&detection, ModelKind::S)).unwrap();
        assert!(json.contains(r#""network_score":null"#), "{json}");
        let verified = GraspDetection { outline: Some(Polygon::from_box(&bbox)), agreement: Some(0.9), ..detection };
        let json = serde_json::to_string(&DetectionRecord::new(&verified, ModelKind::C)).unwrap();
        assert!(json.contains(r#""agreement":0.9"#) && json.contains(r#""polygon":[[1.0,2.0],"#), "{json}");
        let evidence = Contributions {
            network: None,
            edges: 1.5,
            surface: 0.5,
            hue: 0.0,
            visible: -2.5,
            size: 0.0,
            outside: -0.25,
            resemblance: 0.0,
            likeness: 0.0,
            details: 0.0,
            table: 0.0,
            rim: 0.0,
            added: 0.0,
            mirror: 0.0,
        };
        let refused = GraspDetection { evidence: Some(evidence), score: 0.25, ..verified };
        let json = serde_json::to_string(&DetectionRecord::new(&refused, ModelKind::C)).unwrap();
        assert!(json.contains(r#""evidence":{"edges":1.5,"surface":0.5,"#), "{json}");
        assert!(json.ends_with(r#""refused":"too little of it is visible"}"#), "{json}");
    }
}
