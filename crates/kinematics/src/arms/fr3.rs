//! Franka Research 3.
//!
//! # Source
//! Lengths: equal to the Panda's, see franka_description (commit 566ba44), robots/fr3/kinematics.yaml, which equals
//! robots/fer/kinematics.yaml. Limits: libfranka 0.21, `rate_limiting.h`, whose position-dependent functions also give
//! the ranges; torques as published by Franka. Shape and masses are the Panda's; they were not measured on an FR3.

use crate::geometry::ArmGeometry;
use crate::limits::{CartesianLimits, JointLimits};

impl ArmGeometry {
    /// The FR3 with Franka's hand and a small camera on it.
    pub fn fr3() -> Self {
        Self { limits: JointLimits::fr3(), cartesian_limits: CartesianLimits::fr3(), ..Self::panda() }
    }
}

impl JointLimits {
    /// The FR3's limits, without the lower velocities near the ends of its ranges.
    pub fn fr3() -> Self {
        Self {
            position_min: [-2.7501, -1.7918, -2.9065, -3.0481, -2.8101, 0.54092, -3.0196].into(),
            position_max: [2.7501, 1.7918, 2.9065, -0.1458, 2.8101, 4.5205, 3.0196].into(),
            velocity_max: [2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26].into(),
            acceleration_max: [10.0; 7].into(),
            jerk_max: [5000.0; 7].into(),
            torque_max: [87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0].into(),
        }
    }
}

impl CartesianLimits {
    /// The FR3's limits; the speed limit of the tcp is that of a Panda.
    pub const fn fr3() -> Self {
        Self {
            velocity_m_s: Self::panda().velocity_m_s,
            acceleration_m_s2: 9.0,
            jerk_m_s3: 4500.0,
            angular_velocity_rad_s: 2.5,
            angular_acceleration_rad_s2: 17.0,
            angular_jerk_rad_s3: 8500.0,
        }
    }
}
