//! The limits that a robot holds its client to.

/// Velocity, acceleration and jerk of one kind of motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateLimits {
    /// m/s or rad/s.
    pub velocity: f64,
    /// m/s² or rad/s².
    pub acceleration: f64,
    /// m/s³ or rad/s³.
    pub jerk: f64,
}

/// The limits of a robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Lower ends of the joints' ranges, rad.
    pub q_min: [f64; 7],
    /// Upper ends of the joints' ranges, rad.
    pub q_max: [f64; 7],
    /// rad/s.
    pub velocity: [f64; 7],
    /// rad/s².
    pub acceleration: [f64; 7],
    /// rad/s³.
    pub jerk: [f64; 7],
    /// N·m.
    pub torque: [f64; 7],
    /// N·m/s.
    pub torque_rate: f64,
    /// Of the end effector.
    pub translation: RateLimits,
    /// Of the end effector.
    pub rotation: RateLimits,
    /// Of joint 3, where it is commanded as the elbow.
    pub elbow: RateLimits,
}

impl Limits {
    /// The Panda's, as libfranka 0.9.2 limits rates to them (`rate_limiting.h`); ranges and torques as Franka publishes them.
    pub const PANDA: Limits = Limits {
        q_min: [-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973],
        q_max: [2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973],
        velocity: [2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61],
        acceleration: [15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0],
        jerk: [7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0],
        torque: [87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0],
        torque_rate: 1000.0,
        translation: RateLimits { velocity: 2.0, acceleration: 13.0, jerk: 6500.0 },
        rotation: RateLimits { velocity: 2.5, acceleration: 25.0, jerk: 12500.0 },
        elbow: RateLimits { velocity: 2.175, acceleration: 10.0, jerk: 5000.0 },
    };
}
