//! Messages of vision_msgs 4, which is used from Humble on.

use super::geometry::PoseWithCovariance;
use super::{Header, message, structure};

structure! {
    /// `vision_msgs/msg/Point2D`, pixels.
    Point2D {
        /// x, to the right.
        x: f64,
        /// y, down.
        y: f64,
    }
}

structure! {
    /// `vision_msgs/msg/Pose2D`.
    Pose2D {
        /// Position.
        position: Point2D,
        /// Angle from x to y, rad.
        theta: f64,
    }
}

structure! {
    /// `vision_msgs/msg/BoundingBox2D`.
    BoundingBox2D {
        /// Centre and rotation of the box.
        center: Pose2D,
        /// Width before the rotation, in pixels.
        size_x: f64,
        /// Height before the rotation, in pixels.
        size_y: f64,
    }
}

structure! {
    /// `vision_msgs/msg/ObjectHypothesis`.
    ObjectHypothesis {
        /// Name of the class.
        class_id: String,
        /// Score, 0 to 1.
        score: f64,
    }
}

structure! {
    /// `vision_msgs/msg/ObjectHypothesisWithPose`.
    ObjectHypothesisWithPose {
        /// The class and the score.
        hypothesis: ObjectHypothesis,
        /// Pose of the object.
        pose: PoseWithCovariance,
    }
}

structure! {
    /// `vision_msgs/msg/Detection2D`.
    Detection2D {
        /// Header of the picture.
        header: Header,
        /// The possible classes of the object.
        results: Vec<ObjectHypothesisWithPose>,
        /// Box of the object in the picture.
        bbox: BoundingBox2D,
        /// Number of the track.
        id: String,
    }
}

message! { "vision_msgs",
    /// `vision_msgs/msg/Detection2DArray`.
    Detection2DArray {
        /// Header of the picture.
        header: Header,
        /// The detections, best first.
        detections: Vec<Detection2D>,
    }
}
