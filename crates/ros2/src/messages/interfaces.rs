//! sdg_interfaces, whose definitions stand in crates/ros2/sdg_interfaces.

use super::geometry::PoseStamped;
use super::structure;
use super::vision::Detection2DArray;

structure! {
    /// `sdg_interfaces/srv/Detect_Request`.
    DetectRequest {
        /// Detections below it are left out; 0 stands for the node's own.
        min_score: f64,
        /// How long a picture is waited for that is taken after the call; 0 stands for 5 s.
        timeout_secs: f64,
    }
}

structure! {
    /// `sdg_interfaces/srv/Detect_Response`.
    DetectResponse {
        /// Whether a picture was searched; it may have no part.
        success: bool,
        /// What was found, or why nothing was searched.
        message: String,
        /// Best first.
        detections: Detection2DArray,
        /// Of each detection, where the camera is known: the tool centre point when closing.
        poses: Vec<PoseStamped>,
        /// Of each pose: the width of the part between the fingers.
        openings_m: Vec<f64>,
    }
}

structure! {
    /// `sdg_interfaces/srv/Teach_Request`.
    TeachRequest {
        /// Files on the node's computer: the photo.
        photo_path: String,
        /// Its marks; empty: beside the photo.
        annotation_path: String,
        /// The marks themselves, as COCO or LabelMe JSON, instead of a path.
        annotation: String,
        /// A to D or S; empty for C.
        model: String,
        /// Where the grasp model is written.
        out_path: String,
        /// Height of the marks over the table; 0 for a model without lengths.
        mark_height_mm: f64,
        /// 0 for none.
        time_budget_secs: f64,
        /// Decides the samples.
        seed: u64,
        /// Whether the node detects with the model from then on.
        use_it: bool,
    }
}

structure! {
    /// `sdg_interfaces/srv/Teach_Response`.
    TeachResponse {
        /// Whether a model was taught.
        success: bool,
        /// Why not.
        message: String,
        /// The grasp model.
        model_path: String,
        /// How long it took.
        seconds: f64,
    }
}

structure! {
    /// `sdg_interfaces/srv/Grasp_Request`.
    GraspRequest {
        /// Plan and check, and move nothing.
        dry_run: bool,
        /// Share of the joints' velocity limits; 0 for the node's own.
        speed: f64,
    }
}

structure! {
    /// `sdg_interfaces/srv/Grasp_Response`.
    GraspResponse {
        /// Whether the part is held; of a dry run, whether it can be grasped.
        success: bool,
        /// Why not.
        message: String,
        /// The last step that was begun: detect, hover, approach, close, lift or hold.
        step: String,
        /// Where the hand closed.
        pose: PoseStamped,
        /// Between the fingers at the end.
        closed_width_m: f64,
    }
}
