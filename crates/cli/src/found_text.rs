//! A detection as a line of text.

use sdg_calibration::Frame;

use crate::picture_detector::Found;

/// A detection in words, in metres as well where positions are in `frame`.
pub fn in_words(found: &Found, frame: Option<Frame>) -> String {
    let Found { detection, pose } = found;
    let grasp = detection.grasp;
    let metric = pose.zip(frame).map(|(pose, frame)| {
        let name = frame.name();
        let [x, y, z] = pose.position_m.coords.map(|length| 1e3 * length).into();
        format!(
            " = {name} ({x:.1}, {y:.1}, {z:.1}) ± {:.1} mm, yaw {:.1} ± {:.1}°, open {:.1} mm",
            1e3 * pose.uncertainty.position_m,
            pose.yaw.degrees(),
            pose.uncertainty.yaw_rad.to_degrees(),
            1e3 * pose.opening_m
        )
    });
    let metric = metric.unwrap_or_default();
    let agreement = detection.agreement.map(|a| format!(", agreement {a:.2}")).unwrap_or_default();
    let refused = detection.refused().map(|why| format!("; refused: {why}")).unwrap_or_default();
    format!(
        "grasp at ({:.1}, {:.1}), {:.1}°, {:.1} px wide{metric}; score {:.2} (network {:.2}{agreement}; turn by {}){refused}",
        grasp.x,
        grasp.y,
        grasp.angle.degrees(),
        grasp.width,
        detection.score,
        detection.network_score,
        detection.turn_source.name(),
    )
}
