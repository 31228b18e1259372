//! Motions in time: joint positions, velocities and accelerations within the robot's limits.
//!
//! - Point to point from rest: all joints move in proportion along a straight line in joint space, so the path does not
//!   depend on the speed, and a clearance computed for it holds at any speed.
//! - Along a straight Cartesian path: `s(t)` is a jerk-limited profile (rsruckig, one degree of freedom), stretched in
//!   time by the smallest factor that keeps velocity, acceleration and jerk of every joint and of the tcp within their
//!   limits.
//! - Along a rounded path in joint space: nearly the fastest motion within all limits, including torques (timing/).

use rsruckig::prelude::{InputParameter, Ruckig, ThrowErrorHandler};

use crate::check::check_joints;
use crate::dynamics::ArmDynamics;
use crate::error::KinematicsError;
use crate::joints::JointVector;
use crate::limits::{CartesianLimits, JointLimits};
use crate::path::{JointPath, PathPoint};
use crate::rounded_path::RoundedPath;
use crate::timing::{self, MotionLimits, Timing};

/// A motion in time that ends at rest.
#[derive(Debug, Clone)]
pub struct Trajectory {
    motion: Motion,
    duration_secs: f64,
    start: JointVector,
    end: JointVector,
}

/// Joint positions (rad), velocities (rad/s) and accelerations (rad/s²).
type State = (JointVector, JointVector, JointVector);

#[derive(Debug, Clone)]
enum Motion {
    Still,
    /// `q = start + direction · s`.
    StraightInJointSpace {
        direction: JointVector,
        profile: Box<Profile>,
    },
    AlongPath(Box<TimedPath>),
    AlongRoundedPath(Box<(RoundedPath, Timing)>),
}

#[derive(Debug, Clone)]
struct TimedPath {
    path: JointPath,
    profile: Profile,
    /// Trajectory time divided by profile time.
    stretch: f64,
}

/// A jerk-limited `s(t)` from rest to rest.
#[derive(Debug, Clone)]
struct Profile(rsruckig::trajectory::Trajectory<1>);

/// `s` and its derivatives with respect to time.
#[derive(Debug, Clone, Copy)]
struct Progress {
    s: f64,
    velocity: f64,
    acceleration: f64,
    jerk: f64,
}

impl Trajectory {
    /// The fastest straight motion in joint space from rest at `start` to rest at `end`.
    ///
    /// # Errors
    /// [`KinematicsError::NotFinite`]; [`KinematicsError::JointOutOfRange`] for a start or an end outside `limits`;
    /// [`KinematicsError::Trajectory`] if the generator fails.
    pub fn point_to_point(
        start: &JointVector,
        end: &JointVector,
        limits: &JointLimits,
    ) -> Result<Self, KinematicsError> {
        check_in_range("start", start, limits)?;
        check_in_range("end", end, limits)?;
        let distance = (end - start).amax();
        if distance < MIN_DISTANCE_RAD {
            return Ok(Self { motion: Motion::Still, duration_secs: 0.0, start: *start, end: *end });
        }
        // The joint that moves furthest has |direction| = 1. A joint that hardly moves gives no bound.
        let direction = (end - start) / distance;
        let steepness = direction.abs().add_scalar(f64::MIN_POSITIVE);
        let bound = |limit: &JointVector| limit.component_div(&steepness).min();
        let profile = Profile::new(
            distance,
            bound(&limits.velocity_max),
            bound(&limits.acceleration_max),
            bound(&limits.jerk_max),
        )?;
        Ok(Self {
            duration_secs: profile.duration(),
            motion: Motion::StraightInJointSpace { direction, profile: Box::new(profile) },
            start: *start,
            end: *end,
        })
    }

    /// A fast motion from rest to rest along a straight Cartesian path.
    ///
    /// A few cruising speeds are tried, and the one with the shortest duration is used. This is not the time optimum,
    /// which would brake and accelerate along the path.
    ///
    /// # Errors
    /// [`KinematicsError::Trajectory`] if the generator fails; for a path without motion, the errors of
    /// [`Self::point_to_point`].
    pub fn along_path(
        path: JointPath,
        limits: &JointLimits,
        cartesian_limits: &CartesianLimits,
    ) -> Result<Self, KinematicsError> {
        if path.length_m() == 0.0 {
            let q = *path.start();
            return Self::point_to_point(&q, &q, limits);
        }
        let bounds = Bounds::new(&path, limits, cartesian_limits);
        let fastest = bounds.fastest(&path);
        let mut best: Option<(Profile, f64)> = None;
        for speed_share in CRUISING_SPEED_SHARES {
            let profile =
                Profile::new(path.length_m(), fastest.velocity * speed_share, fastest.acceleration, fastest.jerk)?;
            let stretch = bounds.stretch(&path, &profile);
            let is_better = best.as_ref().is_none_or(|(p, s)| profile.duration() * stretch < p.duration() * s);
            if is_better {
                best = Some((profile, stretch));
            }
        }
        let (profile, stretch) = best.expect("there is at least one cruising speed");
        Ok(Self {
            duration_secs: profile.duration() * stretch,
            start: *path.start(),
            end: *path.end(),
            motion: Motion::AlongPath(Box::new(TimedPath { path, profile, stretch })),
        })
    }

    /// Nearly the fastest motion from rest to rest along a rounded path, within the limits of joints and tcp and within
    /// the torques of an arm with its load.
    ///
    /// # Errors
    /// [`KinematicsError::NotFinite`]; [`KinematicsError::JointOutOfRange`] for a start or an end outside the limits;
    /// [`KinematicsError::Trajectory`] if the joints cannot hold the weight of arm and load somewhere on the path, or
    /// the arm cannot continue there within its limits.
    pub fn along_rounded_path(
        path: RoundedPath,
        limits: &JointLimits,
        cartesian_limits: &CartesianLimits,
        dynamics: &ArmDynamics,
    ) -> Result<Self, KinematicsError> {
        check_in_range("start", path.start(), limits)?;
        check_in_range("end", path.end(), limits)?;
        let limits = MotionLimits { joints: limits, cartesian: cartesian_limits, dynamics };
        let timing = timing::time(&path, &limits)?;
        Ok(Self {
            duration_secs: timing.profile.duration_secs() * timing.stretch,
            start: *path.start(),
            end: *path.end(),
            motion: Motion::AlongRoundedPath(Box::new((path, timing))),
        })
    }

    /// For a motion along a rounded path: its duration without a jerk limit, s. The other limits are satisfied at the
    /// points of the timing's grid.
    pub fn without_jerk_limit_secs(&self) -> Option<f64> {
        match &self.motion {
            Motion::AlongRoundedPath(timed) => Some(timed.1.jerkless_secs),
            _ => None,
        }
    }

    /// The duration of the motion, s.
    pub fn duration_secs(&self) -> f64 {
        self.duration_secs
    }

    /// The start of the motion.
    pub fn start(&self) -> &JointVector {
        &self.start
    }

    /// The end of the motion.
    pub fn end(&self) -> &JointVector {
        &self.end
    }

    /// Joint positions (rad), velocities (rad/s) and accelerations (rad/s²) at `time_secs`.
    ///
    /// Before the start and after the end the arm is at rest. A time that is NaN counts as the start.
    pub fn sample(&self, time_secs: f64) -> (JointVector, JointVector, JointVector) {
        if time_secs.is_nan() || time_secs <= 0.0 {
            return at_rest(&self.start);
        }
        if time_secs >= self.duration_secs {
            return at_rest(&self.end);
        }
        match &self.motion {
            Motion::Still => at_rest(&self.start),
            Motion::StraightInJointSpace { direction, profile } => {
                let progress = profile.at(time_secs);
                (self.start + direction * progress.s, direction * progress.velocity, direction * progress.acceleration)
            }
            Motion::AlongPath(timed) => {
                let Progress { s, velocity, acceleration, .. } = timed.profile.at(time_secs / timed.stretch);
                at_progress(&timed.path.at(s), velocity, acceleration, timed.stretch)
            }
            Motion::AlongRoundedPath(timed) => {
                let (path, Timing { profile, stretch, .. }) = timed.as_ref();
                let progress = profile.at(time_secs / stretch);
                at_progress(&path.at(progress.s), progress.velocity, progress.acceleration, *stretch)
            }
        }
    }
}

/// The state at a point of a path, for `ds/dt` and `d²s/dt²` of a profile that is stretched in time by a factor.
fn at_progress(point: &PathPoint, velocity: f64, acceleration: f64, stretch: f64) -> State {
    let (velocity, acceleration) = (velocity / stretch, acceleration / stretch.powi(2));
    (point.q, point.dq * velocity, point.dq * acceleration + point.ddq * velocity.powi(2))
}

fn at_rest(q: &JointVector) -> State {
    (*q, JointVector::zeros(), JointVector::zeros())
}

fn check_in_range(what: &'static str, q: &JointVector, limits: &JointLimits) -> Result<(), KinematicsError> {
    check_joints(what, q)?;
    match limits.worst_violation(q, LIMIT_ROUNDING_RAD) {
        None => Ok(()),
        Some(violation) => Err(KinematicsError::JointOutOfRange { what, violation }),
    }
}

/// Motions shorter than this are no motion, rad.
const MIN_DISTANCE_RAD: f64 = 1e-12;
/// Positions up to this far beyond a limit are rounding errors, rad.
const LIMIT_ROUNDING_RAD: f64 = 1e-9;
/// Cruising speeds that are tried on a path, as fractions of the speed that the most limiting joint or the tcp allows.
const CRUISING_SPEED_SHARES: [f64; 4] = [1.0, 0.75, 0.55, 0.4];
/// Margin between the maximum of the samples and the limit, for values between samples.
const HEADROOM: f64 = 1.002;
const SAMPLES_PER_PHASE: usize = 160;

fn calculate<const DOF: usize>(
    input: &InputParameter<DOF>,
) -> Result<rsruckig::trajectory::Trajectory<DOF>, KinematicsError> {
    // The control cycle only matters for online use, so its value has no effect.
    const CYCLE_SECS: f64 = 0.001;
    let mut trajectory = rsruckig::trajectory::Trajectory::<DOF>::new(None);
    Ruckig::<DOF, ThrowErrorHandler>::new(None, CYCLE_SECS)
        .calculate(input, &mut trajectory)
        .map_err(|error| KinematicsError::Trajectory { reason: error.to_string() })?;
    Ok(trajectory)
}

impl Profile {
    fn new(length_m: f64, velocity: f64, acceleration: f64, jerk: f64) -> Result<Self, KinematicsError> {
        let mut input = InputParameter::<1>::new(None);
        input.target_position[0] = length_m;
        input.max_velocity[0] = velocity;
        input.max_acceleration[0] = acceleration;
        input.max_jerk[0] = jerk;
        calculate(&input).map(Self)
    }

    fn duration(&self) -> f64 {
        self.0.duration
    }

    fn at(&self, time: f64) -> Progress {
        let mut progress = Progress { s: 0.0, velocity: 0.0, acceleration: 0.0, jerk: 0.0 };
        self.0.state_to_integrate_from(time, &mut 0, |_, t, position, velocity, acceleration, jerk| {
            let (s, v, a) = rsruckig::util::integrate(t, position, velocity, acceleration, jerk);
            progress = Progress { s, velocity: v, acceleration: a, jerk };
        });
        progress
    }

    /// Evenly spaced states in each phase of constant jerk, with both ends: the short phases of full jerk must not lie
    /// between samples.
    fn states(&self) -> impl Iterator<Item = Progress> + '_ {
        let phases = &self.0.profiles[0][0];
        (0..phases.t.len()).filter(|i| phases.t[*i] > 0.0).flat_map(move |i| {
            (0..=SAMPLES_PER_PHASE).map(move |k| {
                let time = phases.t[i] * k as f64 / SAMPLES_PER_PHASE as f64;
                let (s, velocity, acceleration) =
                    rsruckig::util::integrate(time, phases.p[i], phases.v[i], phases.a[i], phases.j[i]);
                Progress { s, velocity, acceleration, jerk: phases.j[i] }
            })
        })
    }
}

/// Limits of velocity, acceleration and jerk along a path: those of the joints, and those of the tcp's position and
/// orientation, which are treated as two more joints that are linear in `s`.
struct Bounds<'a> {
    limits: &'a JointLimits,
    /// Limits of `s` itself, from the Cartesian limits.
    velocity: f64,
    acceleration: f64,
    jerk: f64,
}

impl<'a> Bounds<'a> {
    fn new(path: &JointPath, limits: &'a JointLimits, cartesian: &CartesianLimits) -> Self {
        let linear = path.length_m() / path.distance_m();
        let angular = path.length_m() / path.angle_rad();
        // Without translation or rotation this divides by zero, and the resulting infinity is the correct bound.
        Self {
            limits,
            velocity: (cartesian.velocity_m_s * linear).min(cartesian.angular_velocity_rad_s * angular),
            acceleration: (cartesian.acceleration_m_s2 * linear).min(cartesian.angular_acceleration_rad_s2 * angular),
            jerk: (cartesian.jerk_m_s3 * linear).min(cartesian.angular_jerk_rad_s3 * angular),
        }
    }

    /// The limits of `s` if the path were also straight in joint space.
    fn fastest(&self, path: &JointPath) -> Progress {
        let mut steepest = JointVector::repeat(f64::MIN_POSITIVE);
        let num_samples = 2 * path.waypoints().len();
        for i in 0..=num_samples {
            let point = path.at(path.length_m() * i as f64 / num_samples as f64);
            steepest = steepest.sup(&point.dq.abs());
        }
        Progress {
            s: 0.0,
            velocity: self.limits.velocity_max.component_div(&steepest).min().min(self.velocity),
            acceleration: self.limits.acceleration_max.component_div(&steepest).min().min(self.acceleration),
            jerk: self.limits.jerk_max.component_div(&steepest).min().min(self.jerk),
        }
    }

    /// The smallest factor by which the profile must be stretched in time so that every limit holds.
    ///
    /// Stretching by k divides velocities by k, accelerations by k², jerks by k³.
    fn stretch(&self, path: &JointPath, profile: &Profile) -> f64 {
        let mut velocity: f64 = 0.0;
        let mut acceleration: f64 = 0.0;
        let mut jerk: f64 = 0.0;
        for at in profile.states() {
            let point = path.at(at.s);
            let qd = point.dq * at.velocity;
            let qdd = point.dq * at.acceleration + point.ddq * at.velocity.powi(2);
            let qddd = point.dq * at.jerk
                + point.ddq * (3.0 * at.velocity * at.acceleration)
                + point.dddq * at.velocity.powi(3);
            velocity = velocity.max(share(&qd, &self.limits.velocity_max)).max(at.velocity.abs() / self.velocity);
            acceleration = acceleration
                .max(share(&qdd, &self.limits.acceleration_max))
                .max(at.acceleration.abs() / self.acceleration);
            jerk = jerk.max(share(&qddd, &self.limits.jerk_max)).max(at.jerk.abs() / self.jerk);
        }
        velocity.max(acceleration.sqrt()).max(jerk.cbrt()) * HEADROOM
    }
}

/// The largest used fraction of the limits of the joints.
fn share(values: &JointVector, limits: &JointVector) -> f64 {
    values.abs().component_div(limits).max()
}

#[cfg(test)]
mod tests;
