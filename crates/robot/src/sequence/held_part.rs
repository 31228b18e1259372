//! The held part: its pose in the hand, and the space it occupies.

use std::f64::consts::{FRAC_PI_2, PI};

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
        Self {
            part_from_tcp: target.base_from_tcp.inverse() * base_from_tcp,
            height_m: target.base_from_tcp.translation.z - table_height_m,
            hang_m,
            shape: shape_of(target, table_height_m, config),
            in_tcp: disc(config.part_radius_m, hang_m),
        }
    }
}

/// Capsules of radius `hang_m` that cover a disc around the tcp, because the part's orientation is not known. All cross
/// at the tcp; there are so many that halfway between two of them the rim is at most half of `hang_m` from their axes.
fn disc(radius_m: f64, hang_m: f64) -> Vec<Capsule> {
    const MIN_CAPSULES: f64 = 4.0;
    let max_half_angle_rad = (0.5 * hang_m / radius_m).min(1.0).asin();
    let num = (FRAC_PI_2 / max_half_angle_rad).ceil().max(MIN_CAPSULES);
    let (sin, cos) = (FRAC_PI_2 / num).sin_cos();
    // The ends of the axes are at most `hang_m` from the rim halfway to the next axis.
    let reach_m = radius_m * cos - (hang_m.powi(2) - (radius_m * sin).powi(2)).max(0.0).sqrt();
    let reach_m = reach_m.max(0.0);
    (0..num as u32)
        .map(|index| {
            let (sin, cos) = (f64::from(index) * PI / num).sin_cos();
            let [x, y] = [reach_m * cos, reach_m * sin];
            Capsule::new([-x, -y, 0.0], [x, y, 0.0], hang_m)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_capsules_cover_the_whole_disc() {
        const HANG_M: f64 = 0.012;
        let base_from_tcp = Isometry3::translation(0.5, 0.0, HANG_M);
        let target = GraspTarget { base_from_tcp, jaw_width_m: 0.02, score: 0.9 };
        for part_radius_m in [0.06, 0.1, 0.2] {
            let config = GraspConfig { part_radius_m, ..GraspConfig::default() };
            let capsules = HeldPart::new(&target, &base_from_tcp, 0.0, &config).in_tcp;
            for degrees in 0..360 {
                let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
                for share in [0.25, 0.5, 0.75, 1.0] {
                    let p = [share * part_radius_m * cos, share * part_radius_m * sin, 0.0];
                    let point = Capsule::new(p, p, 0.0);
                    let outside_m = capsules.iter().map(|one| one.distance_m(&point)).fold(f64::INFINITY, f64::min);
                    assert!(outside_m <= 1e-9, "{part_radius_m} m, {degrees}°, {share}: {outside_m} m");
                }
            }
            let extents_m = capsules.iter().map(|one| one.to.coords.norm() + one.radius_m);
            assert!(extents_m.fold(0.0, f64::max) <= part_radius_m + 0.15 * HANG_M);
        }
    }
}
