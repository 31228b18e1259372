//! The held part: its pose in the hand, and the space it occupies.

use nalgebra::Isometry3;
use sdg_kinematics::collision::Capsule;

use super::config::GraspConfig;
use crate::grasp_target::GraspTarget;
use crate::part_shape::PartShape;

/// The part that the hand holds, as known when the hand closed.
#[derive(Debug, Clone)]
pub(super) struct HeldPart {
    /// Pose of the tcp in the frame of the part's grasp as it was detected: x along the marked line, z down.
    pub(super) part_from_tcp: Isometry3<f64>,
    /// The grasp's height above the surface under the part, m.
    pub(super) height_m: f64,
    /// Extent of the part below the tcp, m.
    pub(super) hang_m: f64,
    /// The configured or assumed shape of the part; `None` if the detected values are impossible.
    pub(super) shape: Option<PartShape>,
    /// Capsules that contain the part, in the tcp's frame.
    pub(super) in_tcp: Vec<Capsule>,
}

/// Minimum extent of a part below the tcp, m.
const MIN_HANG_M: f64 = 0.010;

/// The configured shape of a detected part; without one, the shape assumed from the width between the fingers.
pub(super) fn shape_of(target: &GraspTarget, table_height_m: f64, config: &GraspConfig) -> Option<PartShape> {
    let height_m = target.base_from_tcp.translation.z - table_height_m;
    config.part.clone().or_else(|| PartShape::between_fingers(target.jaw_width_m, height_m.max(MIN_HANG_M)).ok())
}

impl HeldPart {
    pub(super) fn new(
        target: &GraspTarget,
        base_from_tcp: &Isometry3<f64>,
        table_height_m: f64,
        config: &GraspConfig,
    ) -> Self {
        let hang_m = (base_from_tcp.translation.z - table_height_m).max(MIN_HANG_M);
        let reach_m = (config.part_radius_m - hang_m).max(0.0);
        // The capsules form a disc around the tcp, because the part's orientation is not known.
        let in_tcp = (0..4)
            .map(|index| {
                let (sin, cos) = (f64::from(index) * std::f64::consts::FRAC_PI_4).sin_cos();
                let [x, y] = [reach_m * cos, reach_m * sin];
                Capsule::new([-x, -y, 0.0], [x, y, 0.0], hang_m)
            })
            .collect();
        Self {
            part_from_tcp: target.base_from_tcp.inverse() * base_from_tcp,
            height_m: target.base_from_tcp.translation.z - table_height_m,
            hang_m,
            shape: shape_of(target, table_height_m, config),
            in_tcp,
        }
    }
}
