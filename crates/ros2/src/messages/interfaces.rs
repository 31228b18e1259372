//! sdg_interfaces; its definitions are in crates/ros2/sdg_interfaces.

use super::geometry::PoseStamped;
use super::structure;
use super::vision::Detection2DArray;

structure! {
    /// `sdg_interfaces/srv/Detect_Request`.
    DetectRequest {
        /// Minimum score of the returned detections; 0 for the node's own.
        min_score: f64,
        /// Time to wait for a picture taken after the call; 0 for 5 s.
        timeout_secs: f64,
    }
}

structure! {
    /// `sdg_interfaces/srv/Detect_Response`.
    DetectResponse {
        /// Whether a picture was searched; it may have no part.
        success: bool,
        /// The result, or the reason why nothing was searched.
        message: String,
        /// Best first.
        detections: Detection2DArray,
        /// For each detection, if the camera's pose is known: the tool centre point when closing.
        poses: Vec<PoseStamped>,
        /// For each pose: the width of the part between the fingers.
        openings_m: Vec<f64>,
    }
}

structure! {
    /// `sdg_interfaces/srv/Teach_Request`.
    TeachRequest {
        /// Files on the node's computer: the photo.
        photo_path: String,
        /// Its annotation; empty for the file beside the photo.
        annotation_path: String,
        /// The annotation itself, as COCO or LabelMe JSON, instead of a path.
        annotation: String,
        /// A to D or S; empty for C.
        model: String,
        /// The file for the grasp model.
        out_path: String,
        /// Height of the marks over the table; 0 for a model without lengths.
        mark_height_mm: f64,
        /// 0 for none.
        time_budget_secs: f64,
        /// The seed of the samples.
        seed: u64,
        /// Whether the node then detects with the model.
        use_it: bool,
    }
}

structure! {
    /// `sdg_interfaces/srv/Teach_Response`.
    TeachResponse {
        /// Whether a model was taught.
        success: bool,
        /// The reason, if not.
        message: String,
        /// The grasp model.
        model_path: String,
        /// The duration.
        seconds: f64,
    }
}

structure! {
    /// `sdg_interfaces/srv/Grasp_Request`.
    GraspRequest {
        /// Plan and check without motion.
        dry_run: bool,
        /// Share of the joints' velocity limits; 0 for the node's own.
        speed: f64,
    }
}

structure! {
    /// `sdg_interfaces/srv/Grasp_Response`.
    GraspResponse {
        /// Whether the part is held; for a dry run, whether it can be grasped.
        success: bool,
        /// The reason, if not.
        message: String,
        /// The last started step: detect, hover, approach, close, lift or hold.
        step: String,
        /// The pose at which the hand closed.
        pose: PoseStamped,
        /// Width between the fingers at the end.
        closed_width_m: f64,
    }
}
