//! The limits that a robot applies to its client.

use crate::wire::Version;

/// Velocity, acceleration and jerk limits of one kind of motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateLimits {
    /// Velocity, m/s or rad/s.
    pub velocity: f64,
    /// Acceleration, m/s² or rad/s².
    pub acceleration: f64,
    /// Jerk, m/s³ or rad/s³.
    pub jerk: f64,
}

/// Decrease of a joint's largest velocity towards an end of its range: `sqrt(slope * distance) - offset`, at least 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VelocityNearEnd {
    /// Subtracted from the root, rad/s.
    pub offset: f64,
    /// Factor of the distance, rad/s².
    pub slope: f64,
}

impl VelocityNearEnd {
    /// The largest velocity (rad/s) towards an end of the range at a distance of `distance` (rad).
    fn at(self, distance: f64) -> f64 {
        ((self.slope * distance).max(0.0).sqrt() - self.offset).max(0.0)
    }
}

/// The limits of a robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Lower ends of the joints' ranges, rad.
    pub q_min: [f64; 7],
    /// Upper ends of the joints' ranges, rad.
    pub q_max: [f64; 7],
    /// Velocity, rad/s.
    pub velocity: [f64; 7],
    /// Additional velocity limits near the ends of the joints' ranges.
    pub velocity_near_ends: Option<[VelocityNearEnd; 7]>,
    /// Acceleration, rad/s².
    pub acceleration: [f64; 7],
    /// Jerk, rad/s³.
    pub jerk: [f64; 7],
    /// Torque, N·m.
    pub torque: [f64; 7],
    /// Rate of the torque, N·m/s.
    pub torque_rate: f64,
    /// Limits of the end effector's translation.
    pub translation: RateLimits,
    /// Limits of the end effector's rotation.
    pub rotation: RateLimits,
    /// Limits of joint 3, if it is commanded as the elbow.
    pub elbow: RateLimits,
}

impl Limits {
    /// Limits of a Panda: the rate limits of libfranka 0.9.2 (`rate_limiting.h`), and ranges and torques as published
    /// by Franka.
    pub const PANDA: Limits = Limits {
        q_min: [-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973],
        q_max: [2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973],
        velocity: [2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61],
        velocity_near_ends: None,
        acceleration: [15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0],
        jerk: [7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0],
        torque: [87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0],
        torque_rate: 1000.0,
        translation: RateLimits { velocity: 2.0, acceleration: 13.0, jerk: 6500.0 },
        rotation: RateLimits { velocity: 2.5, acceleration: 25.0, jerk: 12500.0 },
        elbow: RateLimits { velocity: 2.175, acceleration: 10.0, jerk: 5000.0 },
    };
    /// Limits of an FR3: the rate limits of libfranka 0.21 (`rate_limiting.h`, whose position-dependent functions also
    /// give the ranges), and torques as published by Franka.
    pub const FR3: Limits = Limits {
        q_min: [-2.7501, -1.7918, -2.9065, -3.0481, -2.8101, 0.54092, -3.0196],
        q_max: [2.7501, 1.7918, 2.9065, -0.1458, 2.8101, 4.5205, 3.0196],
        velocity: [2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26],
        velocity_near_ends: Some([
            VelocityNearEnd { offset: 0.30, slope: 12.0 },
            VelocityNearEnd { offset: 0.20, slope: 5.17 },
            VelocityNearEnd { offset: 0.20, slope: 7.0 },
            VelocityNearEnd { offset: 0.30, slope: 8.0 },
            VelocityNearEnd { offset: 0.35, slope: 34.0 },
            VelocityNearEnd { offset: 0.35, slope: 11.0 },
            VelocityNearEnd { offset: 0.35, slope: 34.0 },
        ]),
        acceleration: [10.0; 7],
        jerk: [5000.0; 7],
        torque: [87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0],
        torque_rate: 1000.0,
        translation: RateLimits { velocity: 3.0, acceleration: 9.0, jerk: 4500.0 },
        rotation: RateLimits { velocity: 2.5, acceleration: 17.0, jerk: 8500.0 },
        elbow: RateLimits { velocity: 1.5, acceleration: 10.0, jerk: 5000.0 },
    };

    /// The limits of the robot model that uses this version of the protocol.
    pub fn of(version: Version) -> &'static Limits {
        match version {
            Version::V5 => &Self::PANDA,
            Version::V10 => &Self::FR3,
        }
    }

    /// The smallest and the largest velocity (rad/s) of a joint (0 to 6) at a position (rad).
    pub fn velocity_range(&self, joint: usize, q: f64) -> [f64; 2] {
        let max = self.velocity[joint];
        match &self.velocity_near_ends {
            None => [-max, max],
            Some(near_ends) => {
                let towards = |distance| near_ends[joint].at(distance).min(max);
                [-towards(q - self.q_min[joint]), towards(self.q_max[joint] - q)]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_fr3_slows_down_before_the_ends_of_its_joints_and_a_panda_does_not() {
        assert_eq!(Limits::PANDA.velocity_range(0, 2.89), [-2.175, 2.175]);
        assert_eq!(Limits::FR3.velocity_range(0, 0.0), [-2.62, 2.62]);
        // 0.1 rad before the end of the range: sqrt(12 * 0.1) - 0.3 towards it, the full velocity away from it.
        let [away, towards] = Limits::FR3.velocity_range(0, 2.6501);
        assert!((towards - 0.795_445).abs() < 1e-6 && away == -2.62, "{away} {towards}");
        assert_eq!(Limits::FR3.velocity_range(5, 0.54092)[0], 0.0);
        assert_eq!(Limits::FR3.velocity_range(5, 5.0)[1], 0.0);
    }
}
