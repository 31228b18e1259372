//! Matches detections to the true instances of a part in a picture.

use nalgebra::Isometry3;
use sdg_geometry::PosedCamera;
use sdg_grasp::GraspDetection;
use sdg_report::DetectionError;
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::views::Axis;

use super::records::{Answer, PlacedDetection};
use crate::against_truth::{grasp_error, grasp_pose};
use crate::trial::{RIGHT_DEGREES, RIGHT_MM};

/// Maximum position and angle error of a correct detection.
pub(crate) const TOLERANCE: DetectionError = DetectionError { distance_mm: RIGHT_MM, angle_deg: RIGHT_DEGREES };
/// Maximum errors on the axis of slants: a grasp with larger errors misses a narrow part.
pub(super) const SLANT_TOLERANCE: DetectionError = DetectionError { distance_mm: 3.0, angle_deg: 3.0 };

pub(super) fn tolerance_on(axis: Axis) -> DetectionError {
    if axis == Axis::Slant { SLANT_TOLERANCE } else { TOLERANCE }
}

/// Compares detections (best first) with the instances of a part.
///
/// If there is at most one instance, only the best detection counts, as in the paper's protocol, because a robot would
/// grasp there. Several instances are matched one to one: in order of decreasing score, each detection takes the
/// nearest free instance for which it is correct.
pub(super) fn place(
    object: &ObjectSpec,
    camera: &PosedCamera,
    detections: &[GraspDetection],
    instances: &[Isometry3<f64>],
    tolerance: DetectionError,
) -> Answer {
    let num_counted = if instances.len() <= 1 { 1 } else { usize::MAX };
    let counted: Vec<&GraspDetection> = detections
        .iter()
        .enumerate()
        .filter(|(rank, detection)| *rank == 0 || detection.is_accepted())
        .map(|(_, detection)| detection)
        .take(num_counted)
        .collect();
    let errors: Vec<Vec<Option<DetectionError>>> = counted
        .iter()
        .map(|detection| {
            let pose = grasp_pose(object, camera, &detection.grasp).ok();
            let error = |instance| pose.as_ref().map(|pose| grasp_error(object, instance, &pose.base_from_tcp));
            instances.iter().map(error).collect()
        })
        .collect();
    let accepted: Vec<bool> = counted.iter().map(|detection| detection.is_accepted()).collect();
    let found = match_one_to_one(&errors, &accepted, tolerance);
    let placed = counted.iter().zip(&errors).zip(found).map(|((detection, errors), found)| {
        let error = found.map_or_else(|| nearest(errors), |instance| errors[instance]);
        PlacedDetection {
            score: detection.score,
            network_score: detection.network_score,
            agreement: detection.agreement,
            error_mm: error.map(|error| error.distance_mm),
            error_deg: error.map(|error| error.angle_deg),
            found,
        }
    });
    Answer { detections: placed.collect() }
}

fn nearest(errors: &[Option<DetectionError>]) -> Option<DetectionError> {
    errors.iter().flatten().copied().min_by(|a, b| a.distance_mm.total_cmp(&b.distance_mm))
}

/// The instance that each detection finds; `errors` has the errors of every detection, best first, relative to every
/// instance.
pub(crate) fn match_one_to_one(
    errors: &[Vec<Option<DetectionError>>],
    accepted: &[bool],
    tolerance: DetectionError,
) -> Vec<Option<usize>> {
    let is_right =
        |error: &DetectionError| error.distance_mm <= tolerance.distance_mm && error.angle_deg <= tolerance.angle_deg;
    let mut is_taken = vec![false; errors.first().map_or(0, Vec::len)];
    errors
        .iter()
        .zip(accepted)
        .map(|(errors, &accepted)| {
            let free_and_right = errors.iter().enumerate().filter_map(|(instance, error)| {
                let error = error.filter(|error| accepted && !is_taken[instance] && is_right(error))?;
                Some((instance, error.distance_mm))
            });
            let (instance, _) = free_and_right.min_by(|a, b| a.1.total_cmp(&b.1))?;
            is_taken[instance] = true;
            Some(instance)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;
    use sdg_geometry::{Angle, BoundingBox, PlanarGrasp};
    use sdg_grasp::TurnSource;
    use sdg_robot::camera_looking_down;

    fn error(distance_mm: f64, angle_deg: f64) -> Option<DetectionError> {
        Some(DetectionError { distance_mm, angle_deg })
    }

    #[test]
    fn each_instance_is_found_once_and_by_the_best() {
        // The second detection is nearer, but the first has a higher score; the third is rotated; the fourth has no
        // position.
        let errors = [
            vec![error(4.0, 1.0), error(80.0, 1.0)],
            vec![error(1.0, 1.0), error(79.0, 1.0)],
            vec![error(80.0, 2.0), error(3.0, 11.0)],
            vec![None, None],
            vec![error(81.0, 2.0), error(9.9, 9.9)],
        ];
        assert_eq!(match_one_to_one(&errors, &[true; 5], TOLERANCE), [Some(0), None, None, None, Some(1)]);
        assert_eq!(match_one_to_one(&errors, &[true; 5], SLANT_TOLERANCE), [None, Some(0), None, None, None]);
        assert_eq!(match_one_to_one(&errors, &[false; 5], TOLERANCE), [None; 5]);
        assert_eq!(match_one_to_one(&[], &[], TOLERANCE), []);
    }

    #[test]
    fn of_two_right_instances_the_nearer_is_taken() {
        let errors = [vec![error(6.0, 1.0), error(2.0, 1.0)], vec![error(5.0, 1.0), error(3.0, 1.0)]];
        assert_eq!(match_one_to_one(&errors, &[true; 2], TOLERANCE), [Some(1), Some(0)]);
    }

    /// A detection with the grasp of the part at a pose, as seen by the camera.
    fn detection(object: &ObjectSpec, camera: &PosedCamera, at: &Isometry3<f64>, score: f64) -> GraspDetection {
        let [start, end] = object.marks_in_base(at).map(|mark| camera.project(&mark).unwrap());
        let middle: Point2<f64> = nalgebra::center(&start, &end);
        let along = end - start;
        GraspDetection {
            demonstration_idx: 0,
            score,
            network_score: score,
            agreement: None,
            evidence: None,
            light: 1.0,
            bbox: BoundingBox { x1: 0.0, y1: 0.0, x2: 1.0, y2: 1.0 },
            keypoints: Vec::new(),
            outline: None,
            grasp: PlanarGrasp {
                x: middle.x,
                y: middle.y,
                angle: Angle::from_direction(along.x, along.y),
                width: 20.0,
            },
            turn_source: TurnSource::Keypoints,
        }
    }

    #[test]
    fn a_detection_on_each_of_three_instances_finds_three() {
        let object = ObjectSpec::by_name("pendulum").unwrap();
        let camera = PosedCamera {
            intrinsics: sdg_geometry::PinholeCamera::WRIST,
            world_from_camera: camera_looking_down(0.5, 0.0, 0.58, 0.0),
        };
        let instances = [(0.42, -0.1, 0.3), (0.5, 0.1, 2.0), (0.56, 0.0, -1.0)]
            .map(|(x, y, yaw)| object.base_from_object(x, y, yaw));
        let elsewhere = object.base_from_object(0.45, 0.05, 0.0);
        let seen = |at: &Isometry3<f64>, score| detection(&object, &camera, at, score);
        let detections =
            [seen(&instances[2], 0.9), seen(&elsewhere, 0.8), seen(&instances[0], 0.7), seen(&instances[1], 0.4)];
        let answer = place(&object, &camera, &detections, &instances, TOLERANCE);
        assert_eq!((0..3).map(|i| answer.has_found(i)).collect::<Vec<_>>(), [true, false, true]);
        assert_eq!((answer.detections.len(), answer.num_wrong()), (3, 1));
        assert!(answer.detections[0].error_mm.unwrap() < 1e-6 && answer.detections[1].error_mm.unwrap() > 20.0);

        // With one instance, the best detection decides, and its position is wrong.
        let answer = place(&object, &camera, &detections[1..], &instances[..1], TOLERANCE);
        assert_eq!((answer.detections.len(), answer.num_wrong(), answer.has_found(0)), (1, 1, false));
        // Without the part, every accepted detection is wrong.
        let answer = place(&object, &camera, &detections, &[], TOLERANCE);
        assert!(answer.is_accepted() && answer.num_wrong() == 1 && answer.detections[0].error_mm.is_none());
        let refused = place(&object, &camera, &detections[3..], &instances, TOLERANCE);
        assert!(!refused.is_accepted() && refused.detections.len() == 1 && refused.num_wrong() == 0);
    }
}
