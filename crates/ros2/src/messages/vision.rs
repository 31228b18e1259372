//! vision_msgs 4, as from Humble on.

use super::geometry::PoseWithCovariance;
use super::{Header, message, structure};

structure! {
    /// `vision_msgs/msg/Point2D`, pixels.
    Point2D {
        /// To the right.
        x: f64,
        /// Down.
        y: f64,
    }
}

structure! {
    /// `vision_msgs/msg/Pose2D`.
    Pose2D {
        /// Position.
        position: Point2D,
        /// rad, from x to y.
        theta: f64,
    }
}

structure! {
    /// `vision_msgs/msg/BoundingBox2D`.
    BoundingBox2D {
        /// Its centre and its turn.
        center: Pose2D,
        /// Width before the turn, pixels.
        size_x: f64,
        /// Height before the turn, pixels.
        size_y: f64,
    }
}

structure! {
    /// `vision_msgs/msg/ObjectHypothesis`.
    ObjectHypothesis {
        /// Its class.
        class_id: String,
        /// 0 to 1.
        score: f64,
    }
}

structure! {
    /// `vision_msgs/msg/ObjectHypothesisWithPose`.
    ObjectHypothesisWithPose {
        /// The class and the score.
        hypothesis: ObjectHypothesis,
        /// Its pose.
        pose: PoseWithCovariance,
    }
}

structure! {
    /// `vision_msgs/msg/Detection2D`.
    Detection2D {
        /// Header of the picture.
        header: Header,
        /// Its possible classes.
        results: Vec<ObjectHypothesisWithPose>,
        /// Its box in the picture.
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
        /// Best first.
        detections: Vec<Detection2D>,
    }
}
