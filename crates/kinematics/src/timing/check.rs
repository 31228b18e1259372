//! Checks whether a motion satisfies its limits at closely spaced times.

use nalgebra::Vector3;

use super::grid::{Grid, Tightening};
use super::limits::MotionLimits;
use super::profile::Profile;
use crate::dynamics::{GRAVITY_M_S2, TcpMotion};
use crate::joints::{JointVector, NUM_JOINTS};
use crate::rounded_path::RoundedPath;

/// The largest used fraction of each kind of limit.
#[derive(Debug, Clone, Copy)]
pub(super) struct Worst {
    velocity: f64,
    acceleration: f64,
    jerk: f64,
    /// The factor by which time must be stretched for the torques.
    torque_stretch: f64,
}

/// Violations up to this fraction are removed by stretching.
const TOLERANCE: f64 = 5e-4;
/// Limits are not lowered below this fraction of their values.
const MIN_SHARE: f64 = 0.2;

impl Worst {
    /// Checks a motion at points that are at most `max_secs` apart, and lowers the limits where it violates them.
    pub(super) fn of(
        path: &RoundedPath,
        profile: &Profile,
        limits: &MotionLimits<'_>,
        max_secs: f64,
        tightening: &mut Tightening,
        grid: &Grid,
    ) -> Self {
        let joints = limits.joints;
        let mut worst = Self { velocity: 0.0, acceleration: 0.0, jerk: 0.0, torque_stretch: 1.0 };
        let before = tightening.clone();
        let mut tcp_before: Option<(f64, TcpMotion)> = None;
        let mut jerk_before = 0.0;
        let times = places_in_time(path, profile, max_secs);
        for (index, &time) in times.iter().enumerate() {
            let at = profile.at(time);
            // The jerk jumps at the times of the list, so its values before and after both count.
            let jerk_after = times.get(index + 1).map_or(0.0, |next| profile.at(0.5 * (time + next)).jerk);
            let point = path.at(at.s);
            let qd = point.dq * at.velocity;
            let qdd = point.dq * at.acceleration + point.ddq * at.velocity.powi(2);
            let by_path = point.ddq * (3.0 * at.velocity * at.acceleration) + point.dddq * at.velocity.powi(3);
            let jerks = [jerk_before, jerk_after].map(|jerk| share(&(point.dq * jerk + by_path), &joints.jerk_max));
            let by_profile = point.dq * jerk_before.abs().max(jerk_after.abs());
            jerk_before = jerk_after;

            let (torques, tcp) = limits.dynamics.of_motion(&limits.dynamics.placed(&point.q), &qd, &qdd, GRAVITY_M_S2);
            let torque_stretch = torque_stretch(limits, &point.q, &qd, &torques);
            let cartesian = tcp_shares(limits, &tcp);
            let tcp_jerk = tcp_before.map_or(0.0, |(then, before)| tcp_jerk_share(limits, &before, &tcp, time - then));
            tcp_before = Some((time, tcp));

            let velocity = share(&qd, &joints.velocity_max).max(cartesian[0]);
            let acceleration = share(&qdd, &joints.acceleration_max).max(cartesian[1]);
            let jerk = jerks[0].max(jerks[1]).max(tcp_jerk);
            worst.velocity = worst.velocity.max(velocity);
            worst.acceleration = worst.acceleration.max(acceleration);
            worst.jerk = worst.jerk.max(jerk);
            worst.torque_stretch = worst.torque_stretch.max(torque_stretch);

            let too_much = acceleration.max(torque_stretch.powi(2)).max(1.0);
            let is_by_path = share(&by_path, &joints.jerk_max) > share(&by_profile, &joints.jerk_max);
            // If time is stretched by k, jerks are divided by k³, and ṡ² and s̈ by k².
            let (less, slower) = match jerk > 1.0 + TOLERANCE {
                true if is_by_path => (jerk.powf(2.0 / 3.0), jerk.powf(2.0 / 3.0)),
                true => (jerk, 1.0),
                false => (1.0, 1.0),
            };
            let (less, slower) = (less.max(too_much), slower.max(velocity.powi(2)));
            for phase in profile.phases_at(time) {
                if less > 1.0 + TOLERANCE {
                    let lowered = (before.shares[phase] / less).max(MIN_SHARE);
                    tightening.shares[phase] = tightening.shares[phase].min(lowered);
                }
                if slower > 1.0 + TOLERANCE {
                    for place in [phase, phase + 1] {
                        let lowered = at.velocity.powi(2) / slower;
                        let least = grid.places[place].max_squared * MIN_SHARE * MIN_SHARE;
                        let lowered = lowered.max(least);
                        tightening.max_squared[place] = tightening.max_squared[place].min(lowered);
                    }
                }
            }
        }
        worst
    }

    /// The factor, at least 1, by which time must be stretched so that every limit holds: it divides velocities; its
    /// square divides accelerations, its cube jerks.
    pub(super) fn stretch(&self) -> f64 {
        self.velocity.max(self.acceleration.sqrt()).max(self.jerk.cbrt()).max(self.torque_stretch)
    }

    /// Whether the acceleration changes too fast from one extreme to the other.
    pub(super) fn is_jump(&self) -> bool {
        self.jerk > JUMP_JERK
    }
}

/// Jerk, as a fraction of the limit, that is not reached where an acceleration only begins or ends. Where the
/// acceleration changes from one extreme to the other, the jerk is twice the limit.
const JUMP_JERK: f64 = 1.3;

/// Times that are at most `max_secs` apart, including those of each jump of the profile's jerk, and those just before
/// and just after a jump of the path's third derivative.
fn places_in_time(path: &RoundedPath, profile: &Profile, max_secs: f64) -> Vec<f64> {
    /// Time from a jump of the third derivative at which that derivative is evaluated, s.
    const BESIDE_SECS: f64 = 1e-7;
    let mut times = profile.times(max_secs);
    for piece in path.pieces().iter().filter(|piece| !piece.is_straight()) {
        for edge in [piece.from, piece.from + piece.length] {
            let time = profile.time_at(edge);
            times.extend([time - BESIDE_SECS, time + BESIDE_SECS]);
        }
    }
    times.sort_by(f64::total_cmp);
    times
}

fn share(values: &JointVector, limits: &JointVector) -> f64 {
    values.abs().component_div(limits).max()
}

fn tcp_shares(limits: &MotionLimits<'_>, tcp: &TcpMotion) -> [f64; 2] {
    let cartesian = limits.cartesian;
    [
        (tcp.velocity.norm() / cartesian.velocity_m_s)
            .max(tcp.angular_velocity.norm() / cartesian.angular_velocity_rad_s),
        (tcp.acceleration.norm() / cartesian.acceleration_m_s2)
            .max(tcp.angular_acceleration.norm() / cartesian.angular_acceleration_rad_s2),
    ]
}

/// The tcp's jerk as a fraction of its limit, by the difference between two points in time.
fn tcp_jerk_share(limits: &MotionLimits<'_>, before: &TcpMotion, now: &TcpMotion, secs: f64) -> f64 {
    if secs < MIN_DIFFERENCE_SECS {
        return 0.0;
    }
    let rate = |before: &Vector3<f64>, now: &Vector3<f64>| (now - before).norm() / secs;
    (rate(&before.acceleration, &now.acceleration) / limits.cartesian.jerk_m_s3)
        .max(rate(&before.angular_acceleration, &now.angular_acceleration) / limits.cartesian.angular_jerk_rad_s3)
}

/// Minimum time between two points for a difference; with less time, differences are only rounding errors.
const MIN_DIFFERENCE_SECS: f64 = 1e-6;

/// The factor by which time must be stretched for the torques at one point; 1 if they are within their limits.
fn torque_stretch(limits: &MotionLimits<'_>, q: &JointVector, qd: &JointVector, torques: &JointVector) -> f64 {
    /// Step of the search for the factor.
    const STEP: f64 = 1.002;
    const MAX_STRETCH: f64 = 10.0;
    let friction = limits.dynamics.damping().component_mul(qd);
    let max = &limits.joints.torque_max;
    if share(&(torques + friction), max) <= 1.0 {
        return 1.0;
    }
    let gravity = limits.dynamics.gravity_nm(q);
    let moving = torques - gravity;
    let mut stretch = 1.0;
    for joint in 0..NUM_JOINTS {
        let at = |k: f64| (gravity[joint] + moving[joint] / (k * k) + friction[joint] / k).abs();
        while at(stretch) > max[joint] && stretch < MAX_STRETCH {
            stretch *= STEP;
        }
    }
    stretch
}
