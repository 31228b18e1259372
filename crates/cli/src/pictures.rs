//! Pictures with our marks on them.

use image::RgbImage;
use sdg_geometry::Keypoint;
use sdg_grasp::GraspDetection;
use sdg_report::{DetectionMark, Verdict, draw_detection};

/// The image with every detection drawn on it.
pub fn with_detections(image: &RgbImage, detections: &[GraspDetection]) -> RgbImage {
    let mut drawn = image.clone();
    // Worst first, so that the best is on top.
    for detection in detections.iter().rev() {
        let keypoints: Vec<Keypoint> = detection.keypoints.iter().map(|(point, _)| Keypoint::visible(*point)).collect();
        let verdict = match (detection.is_accepted(), detection.agreement) {
            (false, _) => Verdict::Refused,
            (true, Some(_)) => Verdict::Verified,
            (true, None) => Verdict::Unchecked,
        };
        let mark = DetectionMark {
            bounds: Some(detection.bbox),
            outline: detection.outline.as_ref(),
            keypoints: &keypoints,
            grasp: Some(detection.grasp),
            score: detection.score,
            verdict,
        };
        draw_detection(&mut drawn, &mark);
    }
    drawn
}
