//! Straight Cartesian paths as smooth joint paths.
//!
//! The tcp's position moves along a line and its orientation rotates about one fixed axis (slerp), both linear in the
//! path parameter `s`. The joints follow the differential equation `dq/ds = J⁺ dx/ds - gain · (I - J⁺J) ∇H(q)`, whose
//! solutions are smooth. Inverse kinematics at each waypoint would not give a smooth path. The second term moves the
//! elbow away from joint limits without moving the tcp (H: sum of fourth powers of the joints' positions in their
//! ranges). Each step is corrected by Newton iterations on the pose itself, which prevents drift.
//!
//! `s` is a length, m. The total length is the larger of two values: the length of the line, and the rotation in rad
//! times [`LineOptions::metres_per_rad`].

use nalgebra::{Isometry3, SMatrix, Translation3, UnitQuaternion, Vector3, Vector6};

use crate::check::{check_joints, check_not_negative, check_pose, check_positive};
use crate::error::KinematicsError;
use crate::geometry::{ArmGeometry, Jacobian, pose_error};
use crate::joints::{JointVector, NUM_JOINTS};

/// Settings for following a straight path.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct LineOptions {
    /// Distance between waypoints in `s`, m.
    pub step_m: f64,
    /// Length in `s` that counts as much as a radian of rotation, m.
    pub metres_per_rad: f64,
    /// Strength of the elbow's motion away from joint limits, rad² per m; 0 disables it.
    pub limit_avoidance: f64,
    /// Maximum angle of a joint per metre of `s`, rad/m; a larger value means that a singularity is near.
    pub max_rate_rad_m: f64,
}

impl Default for LineOptions {
    fn default() -> Self {
        Self { step_m: 0.005, metres_per_rad: 0.25, limit_avoidance: 4.0, max_rate_rad_m: 40.0 }
    }
}

/// A point of a path: the configuration and its derivatives with respect to the path's parameter `s`. On a
/// [`JointPath`] `s` is in metres, as in the units below; on a [`crate::RoundedPath`] `s` is in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathPoint {
    /// Joint positions, rad.
    pub q: JointVector,
    /// First derivative, rad/m.
    pub dq: JointVector,
    /// Second derivative, rad/m².
    pub ddq: JointVector,
    /// Third derivative, rad/m³; jumps at waypoints.
    pub dddq: JointVector,
}

/// Joint positions along a straight Cartesian path, twice continuously differentiable in `s` from 0 to
/// [`JointPath::length_m`].
#[derive(Debug, Clone, PartialEq)]
pub struct JointPath {
    step_m: f64,
    knots: Vec<Knot>,
    line: Line,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Knot {
    q: JointVector,
    dq: JointVector,
    ddq: JointVector,
}

/// The tcp's straight motion.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Line {
    base_from_start: Isometry3<f64>,
    base_from_end: Isometry3<f64>,
    translation: Vector3<f64>,
    /// Rotation vector in the base frame from start to end orientation.
    turn: Vector3<f64>,
    length_m: f64,
}

impl Line {
    fn new(base_from_start: Isometry3<f64>, base_from_end: Isometry3<f64>, metres_per_rad: f64) -> Self {
        let error = pose_error(&base_from_start, &base_from_end);
        let translation = error.fixed_rows::<3>(0).into_owned();
        let turn = error.fixed_rows::<3>(3).into_owned();
        let length_m = translation.norm().max(metres_per_rad * turn.norm());
        Self { base_from_start, base_from_end, translation, turn, length_m }
    }

    fn at(&self, s: f64) -> Isometry3<f64> {
        let share = s / self.length_m;
        Isometry3::from_parts(
            Translation3::from(self.base_from_start.translation.vector + self.translation * share),
            UnitQuaternion::from_scaled_axis(self.turn * share) * self.base_from_start.rotation,
        )
    }

    /// Velocity of the tcp per metre of `s`, which is constant along the line.
    fn twist(&self) -> Vector6<f64> {
        let mut twist = Vector6::zeros();
        twist.fixed_rows_mut::<3>(0).copy_from(&self.translation);
        twist.fixed_rows_mut::<3>(3).copy_from(&self.turn);
        twist / self.length_m
    }
}

impl JointPath {
    /// Length in `s`, m; 0 for a path without motion.
    pub fn length_m(&self) -> f64 {
        self.line.length_m
    }

    /// Distance that the tcp moves, m.
    pub fn distance_m(&self) -> f64 {
        self.line.translation.norm()
    }

    /// Angle by which the tcp rotates, rad.
    pub fn angle_rad(&self) -> f64 {
        self.line.turn.norm()
    }

    /// The configuration at the start.
    pub fn start(&self) -> &JointVector {
        &self.knots[0].q
    }

    /// The configuration at the end.
    pub fn end(&self) -> &JointVector {
        &self.knots[self.knots.len() - 1].q
    }

    /// The pose of the tcp at `s`, exactly on the line.
    pub fn base_from_tcp(&self, s: f64) -> Isometry3<f64> {
        if self.line.length_m == 0.0 {
            return self.line.base_from_start;
        }
        self.line.at(s.clamp(0.0, self.line.length_m))
    }

    /// The waypoints, evenly spaced in `s`, with start and end.
    pub fn waypoints(&self) -> impl ExactSizeIterator<Item = &JointVector> {
        self.knots.iter().map(|knot| &knot.q)
    }

    /// The configuration and its derivatives at `s`, which is clamped to the path.
    pub fn at(&self, s: f64) -> PathPoint {
        let num_pieces = self.knots.len() - 1;
        if num_pieces == 0 {
            let zero = JointVector::zeros();
            return PathPoint { q: self.knots[0].q, dq: zero, ddq: zero, dddq: zero };
        }
        let place = (s / self.step_m).clamp(0.0, num_pieces as f64);
        let piece = (place as usize).min(num_pieces - 1);
        hermite(&self.knots[piece], &self.knots[piece + 1], self.step_m, place - piece as f64)
    }
}

impl ArmGeometry {
    /// Follows the straight line from the tcp's pose at `start` to `base_from_tcp_end`.
    ///
    /// # Units and frames
    /// `start` in rad, inside the limits; the end pose in m in the base frame.
    ///
    /// # Errors
    /// [`KinematicsError::PathJointLimit`] if a joint would leave its range; [`KinematicsError::PathBlocked`] at a
    /// singularity or if the arm is too short. Both contain the position along the path. Other errors are for invalid
    /// input.
    pub fn straight_path(
        &self,
        start: &JointVector,
        base_from_tcp_end: &Isometry3<f64>,
        options: &LineOptions,
    ) -> Result<JointPath, KinematicsError> {
        check_joints("start", start)?;
        check_pose("base_from_tcp_end", base_from_tcp_end)?;
        check_line_options(options)?;
        if let Some(violation) = self.limits.worst_violation(start, LIMIT_ROUNDING_RAD) {
            return Err(KinematicsError::JointOutOfRange { what: "start", violation });
        }

        let line = Line::new(self.forward(start), *base_from_tcp_end, options.metres_per_rad);
        if line.length_m < MIN_LENGTH_M {
            let zero = JointVector::zeros();
            return Ok(JointPath {
                step_m: options.step_m,
                knots: vec![Knot { q: *start, dq: zero, ddq: zero }],
                line: Line { length_m: 0.0, ..line },
            });
        }
        let num_pieces = ((line.length_m / options.step_m).ceil() as usize).max(MIN_PIECES);
        if num_pieces > MAX_PIECES {
            return Err(KinematicsError::InvalidOption {
                option: "step_m",
                expected: "large enough for at most 100000 waypoints on the path",
                found: options.step_m,
            });
        }
        let step_m = line.length_m / num_pieces as f64;
        let follower = Follower { arm: self, line: &line, options };

        let mut knots = Vec::with_capacity(num_pieces + 1);
        let mut q = *start;
        for piece in 0..=num_pieces {
            let s = step_m * piece as f64;
            let dq = follower.rate(s, &q)?;
            knots.push(Knot { q, dq, ddq: JointVector::zeros() });
            if piece < num_pieces {
                q = follower.step(s, &q, &dq, step_m)?;
            }
        }
        fill_second_derivatives(&mut knots, step_m);
        Ok(JointPath { step_m, knots, line })
    }
}

/// Positions up to this far beyond a limit are rounding errors, rad.
const LIMIT_ROUNDING_RAD: f64 = 1e-9;
/// A line shorter than this is no motion.
const MIN_LENGTH_M: f64 = 1e-9;
/// Minimum number of pieces; the five-point formula of the second derivative needs at least four.
const MIN_PIECES: usize = 8;
const MAX_PIECES: usize = 100_000;
const MAX_CORRECTIONS: usize = 8;
const CORRECTED: f64 = 1e-11;

struct Follower<'a> {
    arm: &'a ArmGeometry,
    line: &'a Line,
    options: &'a LineOptions,
}

impl Follower<'_> {
    /// dq/ds at `s`.
    fn rate(&self, s: f64, q: &JointVector) -> Result<JointVector, KinematicsError> {
        let jacobian = self.arm.jacobian(q);
        let inverse = self.pseudo_inverse(s, &jacobian)?;
        let away = self.away_from_limits(q);
        let rate = inverse * self.line.twist() + away - inverse * (jacobian * away);
        if rate.amax() > self.options.max_rate_rad_m {
            return Err(self.blocked(s, "the arm is fully stretched or at another singularity"));
        }
        Ok(rate)
    }

    fn pseudo_inverse(&self, s: f64, jacobian: &Jacobian) -> Result<SMatrix<f64, NUM_JOINTS, 6>, KinematicsError> {
        (jacobian * jacobian.transpose())
            .cholesky()
            .map(|factor| jacobian.transpose() * factor.inverse())
            .ok_or_else(|| self.blocked(s, "the arm is fully stretched or at another singularity"))
    }

    fn away_from_limits(&self, q: &JointVector) -> JointVector {
        let limits = &self.arm.limits;
        let half_range = (limits.position_max - limits.position_min) * 0.5;
        let place = (q - limits.middle()).component_div(&half_range);
        let away = -place.map(|u| u.powi(3)).component_div(&half_range) * self.options.limit_avoidance;
        // A joint that the arm lacks has an empty range.
        away.zip_map(&half_range, |rate, half| if half > 0.0 { rate } else { 0.0 })
    }

    /// One step of the fourth-order Runge–Kutta method, followed by Newton steps to the exact pose.
    fn step(&self, s: f64, q: &JointVector, rate: &JointVector, step_m: f64) -> Result<JointVector, KinematicsError> {
        let half = step_m * 0.5;
        let second = self.rate(s + half, &(q + rate * half))?;
        let third = self.rate(s + half, &(q + second * half))?;
        let fourth = self.rate(s + step_m, &(q + third * step_m))?;
        let mut next = q + (rate + (second + third) * 2.0 + fourth) * (step_m / 6.0);

        let target = self.line.at(s + step_m);
        let mut is_corrected = false;
        for _ in 0..MAX_CORRECTIONS {
            let (pose, jacobian) = self.arm.forward_and_jacobian(&next);
            let error = pose_error(&pose, &target);
            if error.amax() < CORRECTED {
                is_corrected = true;
                break;
            }
            next += self.pseudo_inverse(s + step_m, &jacobian)? * error;
        }
        if !is_corrected {
            return Err(self.blocked(s + step_m, "the arm does not reach further"));
        }
        if let Some(violation) = self.arm.limits.worst_violation(&next, LIMIT_ROUNDING_RAD) {
            return Err(KinematicsError::PathJointLimit { at_share: (s + step_m) / self.line.length_m, violation });
        }
        if (next - q).amax() > 2.0 * self.options.max_rate_rad_m * step_m {
            return Err(self.blocked(s + step_m, "the joints would have to jump"));
        }
        Ok(next)
    }

    fn blocked(&self, s: f64, reason: &'static str) -> KinematicsError {
        KinematicsError::PathBlocked { at_share: (s / self.line.length_m).min(1.0), reason }
    }
}

/// Second derivatives from differences of the first derivatives; the formulas are of fourth order, also at the ends.
fn fill_second_derivatives(knots: &mut [Knot], step_m: f64) {
    let last = knots.len() - 1;
    let scale = 1.0 / (12.0 * step_m);
    let weighted = |knots: &[Knot], at: usize, direction: isize, weights: [f64; 5]| {
        let mut sum = JointVector::zeros();
        for (i, weight) in weights.into_iter().enumerate() {
            let idx = at.wrapping_add_signed(direction * i as isize);
            sum += knots[idx].dq * weight;
        }
        sum * (direction as f64 * scale)
    };
    const INSIDE: [f64; 5] = [1.0, -8.0, 0.0, 8.0, -1.0];
    const AT_END: [f64; 5] = [-25.0, 48.0, -36.0, 16.0, -3.0];
    const BESIDE_END: [f64; 5] = [-3.0, -10.0, 18.0, -6.0, 1.0];
    for i in 0..=last {
        knots[i].ddq = match i {
            0 => weighted(knots, 0, 1, AT_END),
            1 => weighted(knots, 0, 1, BESIDE_END),
            _ if i == last => weighted(knots, last, -1, AT_END),
            _ if i == last - 1 => weighted(knots, last, -1, BESIDE_END),
            _ => weighted(knots, i - 2, 1, INSIDE),
        };
    }
}

/// The quintic with the given position, first and second derivative at both ends, at a fraction `share` of the piece.
fn hermite(from: &Knot, to: &Knot, step_m: f64, share: f64) -> PathPoint {
    let c1 = from.dq * step_m;
    let c2 = from.ddq * (0.5 * step_m * step_m);
    let position = to.q - from.q - c1 - c2;
    let slope = to.dq * step_m - c1 - c2 * 2.0;
    let bend = to.ddq * (step_m * step_m) - c2 * 2.0;
    let c3 = position * 10.0 - slope * 4.0 + bend * 0.5;
    let c4 = position * -15.0 + slope * 7.0 - bend;
    let c5 = position * 6.0 - slope * 3.0 + bend * 0.5;
    let x = share;
    PathPoint {
        q: from.q + (c1 + (c2 + (c3 + (c4 + c5 * x) * x) * x) * x) * x,
        dq: (c1 + (c2 * 2.0 + (c3 * 3.0 + (c4 * 4.0 + c5 * (5.0 * x)) * x) * x) * x) / step_m,
        ddq: (c2 * 2.0 + (c3 * 6.0 + (c4 * 12.0 + c5 * (20.0 * x)) * x) * x) / step_m.powi(2),
        dddq: (c3 * 6.0 + (c4 * 24.0 + c5 * (60.0 * x)) * x) / step_m.powi(3),
    }
}

fn check_line_options(options: &LineOptions) -> Result<(), KinematicsError> {
    check_positive("step_m", options.step_m)?;
    check_positive("metres_per_rad", options.metres_per_rad)?;
    check_positive("max_rate_rad_m", options.max_rate_rad_m)?;
    check_not_negative("limit_avoidance", options.limit_avoidance)
}

#[cfg(test)]
mod tests;
