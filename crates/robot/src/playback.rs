//! A checked motion, cycle by cycle, which can be stopped on its path.
//!
//! To stop, the motion's own time is slowed down to a standstill: `q(s(t))` with `ds/dt` from 1 to 0 along a smooth
//! step. The arm thus stays on the checked path, and its velocities do not exceed the motion's. The additional
//! acceleration is the velocity times `d²s/dt²`. This factor is at most `1.5 / STOP_SECS`, which gives 3.3 rad/s² for
//! joint 2 of a Panda at 60 % of its speed. Joint 2 has the lowest limit, 7.5 rad/s²; a free motion, including its
//! corners, uses at most 40 % of it.

use sdg_kinematics::JointVector;

use crate::arm_state::PERIOD_SECS;
use crate::safety::CheckedMotion;

/// Duration of a controlled stop, in seconds.
pub const STOP_SECS: f64 = 0.6;

/// The desired state of the arm at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointReference {
    /// Positions, rad.
    pub q: JointVector,
    /// Velocities, rad/s.
    pub dq: JointVector,
    /// Accelerations, rad/s².
    pub ddq: JointVector,
}

/// Plays a motion.
#[derive(Debug)]
pub struct Playback<'a> {
    motion: &'a CheckedMotion,
    num_cycles: u64,
    stopping: Option<Stopping>,
}

/// A stop in progress.
#[derive(Debug, Clone, Copy)]
struct Stopping {
    /// The motion's time when the stop began, in seconds.
    from_secs: f64,
    since_cycles: u64,
}

impl<'a> Playback<'a> {
    /// Starts before the first cycle.
    pub fn new(motion: &'a CheckedMotion) -> Self {
        Self { motion, num_cycles: 0, stopping: None }
    }

    /// The start of the motion, rad.
    pub fn start(&self) -> &JointVector {
        self.motion.start()
    }

    /// Starts a controlled stop; further calls change nothing.
    pub fn stop(&mut self) {
        if self.stopping.is_none() {
            let from_secs = self.num_cycles as f64 * PERIOD_SECS;
            self.stopping = Some(Stopping { from_secs, since_cycles: self.num_cycles });
        }
    }

    /// Whether a stop was started.
    pub fn is_stopping(&self) -> bool {
        self.stopping.is_some()
    }

    /// The reference of the next cycle; `None` at the end of the motion or of a stop.
    pub fn next_reference(&mut self) -> Option<JointReference> {
        let Some(stopping) = self.stopping else {
            if self.num_cycles >= (self.motion.duration_secs() / PERIOD_SECS).ceil() as u64 {
                return None;
            }
            self.num_cycles += 1;
            let (q, dq, ddq) = self.motion.sample(self.num_cycles as f64 * PERIOD_SECS);
            return Some(JointReference { q, dq, ddq });
        };
        let elapsed_secs = (self.num_cycles - stopping.since_cycles) as f64 * PERIOD_SECS;
        if elapsed_secs >= STOP_SECS {
            return None;
        }
        self.num_cycles += 1;
        let u = ((elapsed_secs + PERIOD_SECS) / STOP_SECS).min(1.0);
        // The rate 1 - 3u² + 2u³, its integral and its derivative.
        let time_secs = stopping.from_secs + STOP_SECS * (u - u.powi(3) + 0.5 * u.powi(4));
        let rate = 1.0 - 3.0 * u * u + 2.0 * u.powi(3);
        let slowing = 6.0 * (u * u - u) / STOP_SECS;
        let (q, dq, ddq) = self.motion.sample(time_secs);
        Some(JointReference { q, dq: dq * rate, ddq: ddq * rate * rate + dq * slowing })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::safety::SafetyLimits;
    use sdg_kinematics::dynamics::ArmDynamics;
    use sdg_kinematics::{ArmGeometry, CartesianLimits, JointLimits, RoundedPath, Trajectory, ready_pose};

    fn motion() -> CheckedMotion {
        let end = ready_pose() + JointVector::from([0.8, 0.2, -0.3, 0.3, 0.4, -0.2, 0.9]);
        let limits = JointLimits::panda().scaled(0.6, 0.4, 0.2).unwrap();
        let trajectory = Trajectory::point_to_point(&ready_pose(), &end, &limits).unwrap();
        SafetyLimits::default().check(trajectory).unwrap()
    }

    /// A motion around two corners at the pace of rehearsals, nowhere at rest between start and end.
    fn curved() -> (RoundedPath, CheckedMotion) {
        let steps = [
            [0.9, 0.5, -0.3, 0.3, 0.4, -0.2, 0.9],
            [-0.5, 0.6, 0.4, -0.4, 1.2, 0.3, -0.8],
            [0.7, -0.5, 0.3, 0.2, -0.4, 0.6, 0.2],
        ];
        let mut waypoints = vec![ready_pose()];
        for step in steps {
            waypoints.push(waypoints[waypoints.len() - 1] + JointVector::from(step));
        }
        let path = RoundedPath::new(&waypoints, &[0.12, 0.03]);
        let limits = JointLimits::panda().scaled(0.6, 0.4, 0.2).unwrap();
        let dynamics = ArmDynamics::new(&ArmGeometry::panda(), 0.08);
        let trajectory =
            Trajectory::along_rounded_path(path.clone(), &limits, &CartesianLimits::panda(), &dynamics).unwrap();
        (path, SafetyLimits::default().check(trajectory).unwrap())
    }

    #[test]
    fn a_stop_in_a_corner_stays_on_the_path_and_within_the_limits() {
        // More than half of the distance between two successive positions in `places`.
        const ON_PATH_RAD: f64 = 1e-3;
        let (path, motion) = curved();
        let dynamics = ArmDynamics::new(&ArmGeometry::panda(), 0.08);
        let places: Vec<JointVector> =
            (0..=4000).map(|place| path.at(path.length_secs() * f64::from(place) / 4000.0).q).collect();
        let num_cycles = (motion.duration_secs() * 1e3) as usize;
        let mut largest = [0.0_f64; 2];
        for stop_at in (0..num_cycles).step_by(17) {
            let mut playback = Playback::new(&motion);
            let mut before: Option<JointReference> = None;
            for cycle in 0.. {
                if cycle == stop_at {
                    playback.stop();
                }
                let Some(reference) = playback.next_reference() else { break };
                let torques = dynamics.torques_nm(&reference.q, &reference.dq, &reference.ddq);
                for joint in 0..7 {
                    let acceleration = reference.ddq[joint].abs() / JointLimits::panda().acceleration_max[joint];
                    let torque = torques[joint].abs() / JointLimits::panda().torque_max[joint];
                    largest = [largest[0].max(acceleration), largest[1].max(torque)];
                    if let Some(before) = &before {
                        let jerk = (reference.ddq[joint] - before.ddq[joint]) / PERIOD_SECS;
                        assert!(jerk.abs() <= JointLimits::panda().jerk_max[joint], "stopped at {stop_at}: {jerk}");
                    }
                }
                before = Some(reference);
            }
            let last = before.unwrap();
            assert!(last.dq.amax() < 1e-9, "stopped at {stop_at}: {}", last.dq);
            let off_path = places.iter().map(|place| (place - last.q).amax()).fold(f64::INFINITY, f64::min);
            assert!(off_path < ON_PATH_RAD, "stopped at {stop_at}: {off_path} rad off the path");
        }
        println!(
            "the largest fractions of the limits during a stop: {:.2} of the acceleration, {:.2} of the torque",
            largest[0], largest[1]
        );
        assert!(largest.iter().all(|share| *share <= 1.0), "{largest:?}");
        // Braking adds to the accelerations of the corner, so that the fraction exceeds the 0.4 of the motion alone.
        assert!(largest[0] > 0.45, "{largest:?}");
    }

    #[test]
    fn without_a_stop_it_is_the_motion_itself() {
        let motion = motion();
        let mut playback = Playback::new(&motion);
        let references: Vec<_> = std::iter::from_fn(|| playback.next_reference()).collect();
        assert_eq!(references.len(), (motion.duration_secs() * 1e3).ceil() as usize);
        assert_eq!(references[99].q, motion.sample(100.0 * PERIOD_SECS).0);
        let last = references.last().unwrap();
        assert_eq!((last.q, last.dq), (*motion.end(), JointVector::zeros()));
    }

    #[test]
    fn a_stop_at_any_time_ends_at_rest_on_the_path_and_within_the_limits() {
        let motion = motion();
        for stop_at in [0, 1, 150, 400, 700, (motion.duration_secs() * 1e3) as usize - 1] {
            let mut playback = Playback::new(&motion);
            let mut references = Vec::new();
            for cycle in 0.. {
                if cycle == stop_at {
                    playback.stop();
                }
                let Some(reference) = playback.next_reference() else { break };
                references.push(reference);
            }
            assert!(references.len() <= stop_at + (STOP_SECS * 1e3) as usize + 1, "{stop_at}");
            let last = references.last().unwrap();
            assert!(last.dq.amax() < 1e-9, "stopped at {stop_at}: {}", last.dq);
            // The path is straight in joint space: every joint has completed the same fraction of its distance.
            let (start, way) = (motion.start(), motion.end() - motion.start());
            let shares = (last.q - start).component_div(&way);
            assert!((shares.max() - shares.min()).abs() < 1e-9, "{shares}");
            for pair in references.windows(2) {
                for joint in 0..7 {
                    let velocity = (pair[1].q[joint] - pair[0].q[joint]) / PERIOD_SECS;
                    assert!((velocity - pair[1].dq[joint]).abs() < 0.02, "{velocity} {}", pair[1].dq[joint]);
                    assert!(pair[1].ddq[joint].abs() <= JointLimits::panda().acceleration_max[joint]);
                    let jerk = (pair[1].ddq[joint] - pair[0].ddq[joint]) / PERIOD_SECS;
                    assert!(jerk.abs() <= JointLimits::panda().jerk_max[joint], "stopped at {stop_at}: {jerk}");
                }
            }
        }
    }
}
