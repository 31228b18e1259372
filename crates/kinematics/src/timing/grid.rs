//! Limits along a path, as linear constraints on s̈ and ṡ² at points of the path.
//!
//! Because of `q̈ = q' s̈ + q'' ṡ²`, accelerations are linear in (s̈, ṡ²), and so are torques without friction: `τ = M
//! q' s̈ + (M q'' + C(q, q') q') ṡ² + g`. Speeds only bound ṡ².

use super::limits::MotionLimits;
use crate::dynamics::GRAVITY_M_S2;
use crate::error::KinematicsError;
use crate::joints::{JointVector, NUM_JOINTS};
use crate::path::PathPoint;
use crate::rounded_path::RoundedPath;

/// Maximum length of a part of a piece, s at full speed.
const MAX_PART: f64 = 0.025;
/// Minimum number of parts of a piece.
const MIN_CORNER_PARTS: usize = 32;
const MIN_STRAIGHT_PARTS: usize = 6;
/// Fraction of the jerk limits that the path's third derivative may use.
const CURVATURE_JERK_SHARE: f64 = 0.9;

/// Upper bound of ṡ where all joints reverse at the same point and no other limit applies.
const MAX_SPEED: f64 = 100.0;

/// `low ≤ slope · s̈ + curvature · ṡ² ≤ high` at one point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row {
    pub(super) slope: f64,
    pub(super) curvature: f64,
    pub(super) low: f64,
    pub(super) high: f64,
}

/// Accelerations and torques of all joints.
pub(super) const NUM_ROWS: usize = 2 * NUM_JOINTS;

#[derive(Debug, Clone)]
pub(super) struct Place {
    /// Position on the path.
    pub(super) s: f64,
    pub(super) rows: [Row; NUM_ROWS],
    /// Upper bound of ṡ² from the speeds of joints and tcp and from the path's third derivative.
    pub(super) max_squared: f64,
}

/// Points along a path, from its start to its end.
#[derive(Debug, Clone)]
pub(super) struct Grid {
    pub(super) places: Vec<Place>,
}

/// Limits that are lowered on parts of the path where a pass violated them.
#[derive(Debug, Clone)]
pub(super) struct Tightening {
    /// Remaining fraction of accelerations and torques between a point and the next.
    pub(super) shares: Vec<f64>,
    /// Upper bound of ṡ² at a point.
    pub(super) max_squared: Vec<f64>,
}

impl Grid {
    pub(super) fn new(path: &RoundedPath, limits: &MotionLimits<'_>) -> Result<Self, KinematicsError> {
        Self::finer(path, limits, 1)
    }

    /// Like [`Grid::new`], with `times` as many parts.
    pub(super) fn finer(path: &RoundedPath, limits: &MotionLimits<'_>, times: usize) -> Result<Self, KinematicsError> {
        let mut places: Vec<Place> = Vec::new();
        for piece in path.pieces() {
            let min_parts = if piece.is_straight() { MIN_STRAIGHT_PARTS } else { MIN_CORNER_PARTS };
            let num_parts = times * ((piece.length / MAX_PART).ceil() as usize).max(min_parts);
            for part in 0..=num_parts {
                let along = piece.length * part as f64 / num_parts as f64;
                let place = Place::new(piece.from + along, &piece.at(along), limits)?;
                match places.last_mut() {
                    // Where two pieces meet, only the third derivative differs.
                    Some(last) if part == 0 => last.max_squared = last.max_squared.min(place.max_squared),
                    _ => places.push(place),
                }
            }
        }
        Ok(Self { places })
    }
}

impl Place {
    fn new(s: f64, point: &PathPoint, limits: &MotionLimits<'_>) -> Result<Self, KinematicsError> {
        let (joints, cartesian, dynamics) = (limits.joints, limits.cartesian, limits.dynamics);
        let PathPoint { q, dq, ddq, dddq } = point;
        let placed = dynamics.placed(q);
        let zero = JointVector::zeros();
        // If q' is treated as an acceleration from rest, the results are M q' and J q' of the tcp.
        let (torque_slope, tcp) = dynamics.of_motion(&placed, &zero, dq, 0.0);
        let (torque_curvature, _) = dynamics.of_motion(&placed, dq, ddq, 0.0);
        let (gravity, _) = dynamics.of_motion(&placed, &zero, &zero, GRAVITY_M_S2);

        let quotient = |limit: &JointVector, rate: &JointVector| {
            (0..NUM_JOINTS).map(|joint| limit[joint] / rate[joint].abs()).fold(f64::INFINITY, f64::min)
        };
        let speed = quotient(&joints.velocity_max, dq)
            .min(cartesian.velocity_m_s / tcp.acceleration.norm())
            .min(cartesian.angular_velocity_rad_s / tcp.angular_acceleration.norm())
            .min((CURVATURE_JERK_SHARE * quotient(&joints.jerk_max, dddq)).cbrt())
            .min(MAX_SPEED);

        let mut rows = [Row { slope: 0.0, curvature: 0.0, low: 0.0, high: 0.0 }; NUM_ROWS];
        for joint in 0..NUM_JOINTS {
            let acceleration = joints.acceleration_max[joint];
            rows[joint] = Row { slope: dq[joint], curvature: ddq[joint], low: -acceleration, high: acceleration };
            let friction = (dynamics.damping()[joint] * dq[joint] * speed).abs();
            let left = joints.torque_max[joint] - friction;
            let (low, high) = (-left - gravity[joint], left - gravity[joint]);
            if low >= 0.0 || high <= 0.0 {
                let (max, found) = (joints.torque_max[joint], gravity[joint].abs());
                let reason = format!(
                    "joint {} has {max:.0} N·m, but needs {found:.1} N·m to hold arm and load, and {friction:.1} N·m \
                     for its friction",
                    joint + 1
                );
                return Err(KinematicsError::Trajectory { reason });
            }
            rows[NUM_JOINTS + joint] =
                Row { slope: torque_slope[joint], curvature: torque_curvature[joint], low, high };
        }
        Ok(Self { s, rows, max_squared: speed * speed })
    }
}

impl Tightening {
    /// No lowered limits.
    pub(super) fn none(grid: &Grid) -> Self {
        Self {
            shares: vec![1.0; grid.places.len() - 1],
            max_squared: grid.places.iter().map(|place| place.max_squared).collect(),
        }
    }
}
