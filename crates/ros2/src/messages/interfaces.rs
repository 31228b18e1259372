//! Messages of sdg_interfaces, which is defined in crates/ros2/sdg_interfaces.

use super::geometry::PoseStamped;
use super::structure;
use super::vision::Detection2DArray;

structure! {
    /// `sdg_interfaces/srv/Detect_Request`.
    DetectRequest {
        /// Minimum score of the returned detections; it may be below the node's setting. 0 is the node's setting.
        min_score: f64,
        /// Maximum wait for a picture that arrives after the call; 0 for 5 s.
        timeout_secs: f64,
    }
}

structure! {
    /// `sdg_interfaces/srv/Detect_Response`.
    DetectResponse {
        /// Whether a picture was searched, with or without a part.
        success: bool,
        /// The result, or the reason why nothing was searched.
        message: String,
        /// The detections, best first.
        detections: Detection2DArray,
        /// The pose of the tool centre point when the hand closes, for each detection, if the camera's pose is known.
        poses: Vec<PoseStamped>,
        /// The width of the part between the fingers, for each pose.
        openings_m: Vec<f64>,
    }
}

structure! {
    /// `sdg_interfaces/srv/Teach_Request`.
    TeachRequest {
        /// Path of the photo on the node's computer.
        photo_path: String,
        /// Path of the annotation; empty for the file beside the photo.
        annotation_path: String,
        /// The annotation itself, as COCO or LabelMe JSON, instead of a path.
        annotation: String,
        /// Kind of the grasp model: A to D or S; empty for C.
        model: String,
        /// The file for the grasp model.
        out_path: String,
        /// Height of the marks above the table; 0 for a model without lengths.
        mark_height_mm: f64,
        /// Maximum time for training; 0 for no limit.
        time_budget_secs: f64,
        /// Seed of the training samples; 0 means 1.
        seed: u64,
        /// Whether the node then uses the model for detection.
        use_it: bool,
    }
}

structure! {
    /// `sdg_interfaces/srv/Teach_Response`.
    TeachResponse {
        /// Whether a model was taught.
        success: bool,
        /// The result, or the reason for a failure.
        message: String,
        /// Path of the grasp model.
        model_path: String,
        /// Duration of teaching.
        seconds: f64,
    }
}

structure! {
    /// `sdg_interfaces/srv/Grasp_Request`.
    GraspRequest {
        /// Plan and check without motion.
        dry_run: bool,
        /// Fraction of the joints' velocity limits; 0 for the node's setting.
        speed: f64,
    }
}

structure! {
    /// `sdg_interfaces/srv/Grasp_Response`.
    GraspResponse {
        /// Whether the part is held; for a dry run, whether it can be grasped.
        success: bool,
        /// The result, or the reason for a failure.
        message: String,
        /// The last started step: detect, hover, approach, close, lift or hold.
        step: String,
        /// The pose of the tool centre point at which the hand closes, in the base frame; zeros if no part was found.
        pose: PoseStamped,
        /// Width between the fingers after closing, in metres; for a dry run, the expected width. 0 if the hand did not
        /// close.
        closed_width_m: f64,
    }
}
