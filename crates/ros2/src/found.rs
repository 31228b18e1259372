//! Detections in a picture, as messages.

use nalgebra::{Isometry3, Point2};

use crate::messages::{
    BoundingBox2D, Detection2D, Detection2DArray, Header, ObjectHypothesis, ObjectHypothesisWithPose, Point2D, Pose2D,
    PoseStamped, PoseWithCovariance, TransformStamped,
};

/// A part in a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundPart {
    /// The taught object.
    pub name: String,
    /// Score, 0 to 1; the default threshold is 0.5.
    pub score: f64,
    /// Upper left and lower right corner of the part's box, in pixels; the first pixel's centre is (0.5, 0.5).
    pub corners: [Point2<f64>; 2],
    /// Pose of the tool centre point when the hand closes, and width of the part between the fingers, m; `None` if the
    /// camera's pose is not known. The header of the published pose names its frame.
    pub grasp: Option<(Isometry3<f64>, f64)>,
}

/// Converts detections to a message with the picture's stamp and frame. Pixels in the message are in ROS's convention:
/// the first pixel's centre is (0, 0).
pub fn to_detections(header: &Header, found: &[FoundPart]) -> Detection2DArray {
    let detection = |part: &FoundPart| {
        let [from, to] = part.corners;
        let middle = nalgebra::center(&from, &to);
        let hypothesis = ObjectHypothesis { class_id: part.name.clone(), score: part.score };
        let pose = match &part.grasp {
            Some((pose, _)) => PoseWithCovariance { pose: (*pose).into(), ..PoseWithCovariance::default() },
            None => PoseWithCovariance::default(),
        };
        Detection2D {
            header: header.clone(),
            results: vec![ObjectHypothesisWithPose { hypothesis, pose }],
            bbox: BoundingBox2D {
                center: Pose2D { position: Point2D { x: middle.x - 0.5, y: middle.y - 0.5 }, theta: 0.0 },
                size_x: to.x - from.x,
                size_y: to.y - from.y,
            },
            id: String::new(),
        }
    };
    Detection2DArray { header: header.clone(), detections: found.iter().map(detection).collect() }
}

/// A part's grasp as a pose in the header's frame.
pub fn to_pose(header: &Header, frame_from_tcp: &Isometry3<f64>) -> PoseStamped {
    PoseStamped { header: header.clone(), pose: (*frame_from_tcp).into() }
}

/// A part's grasp as a frame of tf.
pub fn to_transform(header: &Header, child: &str, frame_from_tcp: &Isometry3<f64>) -> TransformStamped {
    TransformStamped { header: header.clone(), child_frame_id: child.to_owned(), transform: (*frame_from_tcp).into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_has_its_middle_in_pixels_of_ros() {
        let part = FoundPart {
            name: "rod".into(),
            score: 0.75,
            corners: [Point2::new(10.0, 20.0), Point2::new(14.0, 30.0)],
            grasp: Some((Isometry3::translation(0.4, 0.1, 0.02), 0.03)),
        };
        let header = Header { frame_id: "camera".into(), ..Header::default() };
        let message = to_detections(&header, &[part]);
        let [one] = &message.detections[..] else { panic!() };
        assert_eq!((one.bbox.center.position.x, one.bbox.center.position.y), (11.5, 24.5));
        assert_eq!((one.bbox.size_x, one.bbox.size_y), (4.0, 10.0));
        assert_eq!((one.results[0].hypothesis.class_id.as_str(), one.results[0].hypothesis.score), ("rod", 0.75));
        assert_eq!((one.results[0].pose.pose.position.x, one.results[0].pose.pose.orientation.w), (0.4, 1.0));
        assert_eq!(one.header, header);
    }
}
