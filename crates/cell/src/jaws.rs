//! Detects whether the jaws of a grasp would touch another part in the picture.
//!
//! ```text
//!    ┌─────┐         jaw: from half the opening outwards, as long as a finger is wide
//!    └─────┘
//!   ═══════════      the part between them
//!    ┌─────┐
//!    └───╱─┘
//!       ╱ neighbour  its outline reaches under a jaw
//! ```
//! The opening is the part's marked width. A hand that opens wider needs more space, and objects that the model was not
//! taught are not detected: the absence of a warning is no guarantee.

use nalgebra::{Point2, Vector2};
use sdg_geometry::{PlanarGrasp, Polygon};
use sdg_grasp::{GraspDetection, TaughtDemonstration};
use sdg_kinematics::{FINGER_HALF_WIDTH_M, finger_thickness_m};

use crate::perception::Perception;

/// Minimum covered fraction of a jaw's area that counts as contact; outlines are accurate to about a pixel. Chosen by
/// hand.
const MIN_COVERED: f64 = 0.03;
/// Minimum overlap of two detections of the same part. Chosen by hand.
const SAME_PART: f64 = 0.5;

/// A jaw seen from above, in pixels.
#[derive(Debug, Clone, Copy)]
struct Jaw {
    /// Extent along the marked line.
    length: f64,
    /// Extent across the marked line.
    thickness: f64,
}

impl Jaw {
    /// A jaw of this length along the line, with the proportions of the Franka hand's fingertips.
    fn of_length(length: f64) -> Self {
        Self { length, thickness: length * finger_thickness_m(0.0) / (2.0 * FINGER_HALF_WIDTH_M) }
    }

    /// Whether one of the two jaws of a grasp overlaps a part.
    fn touches(&self, grasp: &PlanarGrasp, part: &Polygon) -> bool {
        let (sin, cos) = grasp.angle.radians().sin_cos();
        let (along, across) = (Vector2::new(cos, sin), Vector2::new(-sin, cos));
        [-1.0, 1.0].into_iter().any(|side| {
            // In the jaw's frame, the jaw covers (0, 0) to (length, thickness); `clip` clips to that area.
            let in_jaw = |p: &Point2<f64>| {
                let from_middle = p - grasp.center();
                let out = side * across.dot(&from_middle) - 0.5 * grasp.width;
                Point2::new(along.dot(&from_middle) + 0.5 * self.length, out)
            };
            let part = Polygon { vertices: part.vertices.iter().map(in_jaw).collect() };
            part.clip(self.length, self.thickness).area() > MIN_COVERED * self.length * self.thickness
        })
    }
}

fn region(detection: &GraspDetection) -> Polygon {
    detection.outline.clone().unwrap_or_else(|| Polygon::from_box(&detection.bbox))
}

impl Perception {
    /// As [`Self::touched_by_jaws`] for the accepted detections, which `is_accepted` tells by their index; the other
    /// detections touch nothing and are not touched.
    pub fn touched_among_accepted(
        &self,
        detections: &[&GraspDetection],
        is_accepted: impl Fn(usize) -> bool,
    ) -> Vec<Vec<usize>> {
        let accepted: Vec<usize> = (0..detections.len()).filter(|&idx| is_accepted(idx)).collect();
        let among: Vec<&GraspDetection> = accepted.iter().map(|&idx| detections[idx]).collect();
        let mut touched = vec![Vec::new(); detections.len()];
        for (&idx, others) in accepted.iter().zip(self.touched_by_jaws(&among)) {
            touched[idx] = others.into_iter().map(|other| accepted[other]).collect();
        }
        touched
    }

    /// For each detection in a picture, in order, the indices of the detections whose parts the jaws touch at its
    /// grasp. If the camera's pose is known, fingers have the size of the Franka hand's; otherwise they are as wide as
    /// the marked line is long.
    pub fn touched_by_jaws(&self, detections: &[&GraspDetection]) -> Vec<Vec<usize>> {
        let regions: Vec<Polygon> = detections.iter().map(|detection| region(detection)).collect();
        let touched = |(idx, detection): (usize, &&GraspDetection)| {
            let finger_px = self.metres_per_pixel(&detection.grasp.center()).map(|m| 2.0 * FINGER_HALF_WIDTH_M / m);
            let jaw = Jaw::of_length(finger_px.unwrap_or_else(|| self.marked_length(detection)));
            let is_touched = |&other: &usize| {
                other != idx
                    && jaw.touches(&detection.grasp, &regions[other])
                    && regions[other].share_inside(&regions[idx]) < SAME_PART
            };
            (0..detections.len()).filter(is_touched).collect()
        };
        detections.iter().enumerate().map(touched).collect()
    }

    /// Length of the marked line on a detected part, in pixels. A detection has only the line's midpoint.
    pub fn marked_length(&self, detection: &GraspDetection) -> f64 {
        marked_length(self.model().demonstrations(), detection)
    }
}

/// As [`Perception::marked_length`], for a model's demonstrations, whose lines may have different lengths.
fn marked_length(demonstrations: &[TaughtDemonstration], detection: &GraspDetection) -> f64 {
    let taught = &demonstrations[detection.demonstration_idx].marks;
    let scale = if taught.width_px > 0.0 { detection.grasp.width / taught.width_px } else { 1.0 };
    taught.grasp.length() * scale
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdg_geometry::{Angle, BoundingBox};
    use sdg_grasp::{GraspModel, TeachOptions, TurnSource};
    use std::path::Path;

    /// Jaws of 22 x 15 pixels that close on a part of 20 pixels, from above and from below at an angle of zero.
    fn touches(angle_deg: f64, part: [f64; 4]) -> bool {
        let grasp = PlanarGrasp { x: 100.0, y: 100.0, angle: Angle::from_degrees(angle_deg), width: 20.0 };
        let [x1, y1, x2, y2] = part;
        Jaw::of_length(22.0).touches(&grasp, &Polygon::from_box(&BoundingBox { x1, y1, x2, y2 }))
    }

    #[test]
    fn a_part_under_a_jaw_is_touched_and_one_beside_it_is_not() {
        // The jaws cover y from 75 to 90 and from 110 to 125, x from 89 to 111.
        assert!(touches(0.0, [60.0, 115.0, 140.0, 135.0]));
        assert!(touches(0.0, [60.0, 60.0, 140.0, 85.0]));
        assert!(!touches(0.0, [60.0, 126.0, 140.0, 146.0]));
        assert!(!touches(0.0, [112.0, 60.0, 140.0, 140.0]));
        // The space between the jaws is not part of them.
        assert!(!touches(0.0, [60.0, 92.0, 140.0, 108.0]));
        // A neighbour that is smaller than a jaw, completely below it.
        assert!(touches(0.0, [98.0, 114.0, 104.0, 119.0]));
    }

    #[test]
    fn the_marked_line_is_that_of_the_found_demonstration() {
        let path = "../../datasets/models/pendulum-shape-format-3.sdg";
        let bytes = std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap();
        let model = GraspModel::from_bytes(&bytes, &TeachOptions::new(0).device).unwrap();
        let first = model.demonstrations()[0].clone();
        // The photo from half the distance, with a line of the same length in pixels.
        let mut marks = first.marks.clone();
        marks.width_px *= 2.0;
        let second = TaughtDemonstration::from_parts(first.cutout.clone(), marks).unwrap();
        let detection = |demonstration_idx: usize| GraspDetection {
            demonstration_idx,
            score: 0.9,
            network_score: 0.0,
            agreement: None,
            evidence: None,
            bbox: BoundingBox { x1: 0.0, y1: 0.0, x2: 50.0, y2: 50.0 },
            keypoints: Vec::new(),
            outline: None,
            grasp: PlanarGrasp { x: 25.0, y: 25.0, angle: Angle::from_degrees(0.0), width: first.marks.width_px },
            turn_source: TurnSource::Keypoints,
            light: 1.0,
        };
        let taught = [first.clone(), second];
        let length_px = first.marks.grasp.length();
        for (demonstration_idx, expected_px) in [(0, length_px), (1, 0.5 * length_px)] {
            let found_px = marked_length(&taught, &detection(demonstration_idx));
            assert!((found_px - expected_px).abs() < 1e-9, "{found_px} instead of {expected_px}");
        }
    }

    #[test]
    fn jaws_turn_with_the_grasp() {
        // Rotated by 90 degrees: x from 75 to 90 and from 110 to 125.
        assert!(touches(90.0, [112.0, 60.0, 140.0, 140.0]));
        assert!(!touches(90.0, [60.0, 126.0, 140.0, 146.0]));
    }

    #[test]
    fn a_graze_of_less_than_a_pixel_does_not_count() {
        assert!(!touches(0.0, [60.0, 124.7, 140.0, 146.0]));
        assert!(touches(0.0, [60.0, 123.0, 140.0, 146.0]));
    }
}
