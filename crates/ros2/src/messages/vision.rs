//! vision_msgs 4, as it is from Humble on.

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
        /// Where.
        position: Point2D,
        /// rad, from x to y.
        theta: f64,
    }
}

structure! {
    /// `vision_msgs/msg/BoundingBox2D`.
    BoundingBox2D {
        /// Its middle and its turn.
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
        /// What it is.
        class_id: String,
        /// 0 to 1.
        score: f64,
    }
}

structure! {
    /// `vision_msgs/msg/ObjectHypothesisWithPose`.
    ObjectHypothesisWithPose {
        /// What it is.
        hypothesis: ObjectHypothesis,
        /// Where it is.
        pose: PoseWithCovariance,
    }
}

structure! {
    /// `vision_msgs/msg/Detection2D`.
    Detection2D {
        /// The picture's.
        header: Header,
        /// What it may be.
        results: Vec<ObjectHypothesisWithPose>,
        /// Where it is in the picture.
        bbox: BoundingBox2D,
        /// Of a track.
        id: String,
    }
}

message! { "vision_msgs",
    /// `vision_msgs/msg/Detection2DArray`.
    Detection2DArray {
        /// The picture's.
        header: Header,
        /// Best first.
        detections: Vec<Detection2D>,
    }
}
