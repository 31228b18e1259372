//! A Franka arm with its hand, over the Franka Control Interface.
//!
//! ```text
//! CheckedMotion ─ Playback ─ Follower ─ one joint position a millisecond ─► robot's joint impedance
//!                    ▲           ▲ the robot's reference, which differs after lost commands
//!                    └ Watch receives every state, and may stop the motion on its path
//! ```
//! Tested against the simulated Panda of `sdg-fci`'s server, never on hardware.

mod correction;
mod follower;
mod hand_worker;
mod real_time;

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use sdg_fci::client::{Hand, HandConfig, InternalController, Robot, RobotConfig};
use sdg_fci::wire::{CollisionBehavior, RobotMode, RobotState, Status, Version};
use sdg_fci::{FciError, RobotErrors};
use sdg_kinematics::{ArmGeometry, JointVector};

use crate::arm::{Arm, CompliantArm};
use crate::arm_state::{ArmMode, ArmState, ContactSensitivity, HandCommand, HandState, Load, MotionEnd};
use crate::error::{Result, RobotError};
use crate::playback::Playback;
use crate::robot_address::RobotAddress;
use crate::safety::CheckedMotion;
use crate::touch::{Descent, TouchDown, Touched};
use crate::watch::{StopReason, Watch};
use crate::workcell::RobotModel;

use follower::{Follower, Next};
use hand_worker::HandWorker;
pub use real_time::{Scheduling, check_real_time};

/// Maximum duration of a wait for a state; the client waits longer for stop, recovery and motions of the hand. A real
/// robot stops by itself after 20 ms; a server in lockstep waits half a second for a lost packet and then continues.
const TIMEOUT: Duration = Duration::from_secs(3);
/// Maximum delay of a state behind an answer over TCP.
const MAX_LATE: Duration = Duration::from_secs(1);
/// External torques (N·m) and forces (N, N·m) at which the arm stops in free motion.
const FREE_TORQUE_NM: [f64; 7] = [20.0, 20.0, 18.0, 18.0, 16.0, 14.0, 12.0];
const FREE_FORCE: [f64; 6] = [20.0, 20.0, 20.0, 25.0, 25.0, 25.0];
/// Factor of these thresholds for [`ContactSensitivity::Contact`].
const CONTACT_FACTOR: f64 = 2.0;
/// Radius of the ball that determines a load's inertia, m.
const LOAD_RADIUS_M: f64 = 0.03;

/// A connected Franka arm.
#[derive(Debug)]
pub struct FrankaArm {
    geometry: ArmGeometry,
    robot: Robot,
    hand: HandWorker,
    address: RobotAddress,
    scheduling: Scheduling,
    sensitivity: Option<ContactSensitivity>,
}

impl FrankaArm {
    /// Connects to arm and hand.
    ///
    /// # Errors
    /// [`RobotError::Unreachable`] if arm or hand does not answer, [`RobotError::Device`] for another version of the
    /// protocol, [`RobotError::NoRealTime`] if the kernel refuses the requested real-time scheduling.
    pub fn connect(address: &RobotAddress, scheduling: Scheduling) -> Result<Self> {
        if scheduling == Scheduling::RealTime {
            check_real_time()?;
        }
        let config = RobotConfig { port: address.port, timeout: TIMEOUT, ..RobotConfig::default() };
        let robot = Robot::connect(&address.host, &config).map_err(|error| address.refused("robot", error))?;
        let config = HandConfig { port: address.hand_port, timeout: TIMEOUT };
        let hand = Hand::connect(&address.host, &config).map_err(|error| address.refused("hand", error))?;
        let hand = HandWorker::new(hand);
        let geometry = model_of(robot.version()).geometry();
        Ok(Self { geometry, robot, hand, address: address.clone(), scheduling, sensitivity: None })
    }

    /// Rejects a robot whose model differs from the one in the workcell file: motions would be checked against the
    /// limits of another model.
    ///
    /// # Errors
    /// [`RobotError::Configuration`].
    pub fn check_model(&self, expected: RobotModel) -> Result<()> {
        let found = model_of(self.robot.version());
        if found == expected {
            return Ok(());
        }
        Err(RobotError::Configuration {
            what: "model of the robot".to_owned(),
            expected: format!("\"{}\", as the workcell file says", expected.name()),
            found: format!("a robot that speaks the protocol of \"{}\" at {}", found.name(), self.address),
        })
    }

    /// Finds the fingers' range; needed once after the hand was switched on. `watch` may stop the fingers.
    ///
    /// # Errors
    /// [`RobotError::Hand`], and as for [`Arm::start_hand`] and [`Arm::finish_hand`].
    pub fn home_hand(&mut self, watch: &mut Watch) -> Result<()> {
        self.check_hand_may_move()?;
        self.hand.start_homing()?;
        self.finish_hand(watch).map(drop)
    }

    /// Fails after a stop of the arm. The hand alone would move, and release a held part.
    fn check_hand_may_move(&mut self) -> Result<()> {
        match self.state()?.mode {
            ArmMode::Idle | ArmMode::Moving | ArmMode::Guiding => Ok(()),
            mode => Err(RobotError::in_mode(mode)),
        }
    }

    fn error(&self, error: FciError) -> RobotError {
        match error {
            FciError::Motion { status: Status::Preempted, .. } => RobotError::Stopped(StopReason::Interrupted),
            FciError::Motion { status, errors, success_rate } => RobotError::Reflex(format!(
                "{errors} ({status}; {:.0} % of the last commands arrived in time)",
                100.0 * success_rate
            )),
            FciError::Closed { .. } | FciError::Timeout { .. } | FciError::Socket { .. } | FciError::Wire { .. } => {
                self.address.lost("robot", &error)
            }
            other => RobotError::Device(Box::new(other)),
        }
    }

    /// Runs a control loop, in its own thread if it is scheduled in real time.
    fn in_control<T: Send>(&mut self, control: impl FnOnce(&mut Self) -> Result<T> + Send) -> Result<T> {
        let ended = match self.scheduling {
            Scheduling::Ordinary => control(self),
            Scheduling::RealTime => std::thread::scope(|scope| {
                let controlled = scope.spawn(|| {
                    real_time::enter()?;
                    control(self)
                });
                controlled.join().unwrap_or_else(|_| Err(RobotError::Device("the control loop panicked".into())))
            }),
        };
        if ended.is_err() {
            // The fingers may have been opening during the motion.
            self.hand.stop_motion();
        }
        ended
    }

    /// The loop of a motion.
    fn play(&mut self, motion: &CheckedMotion, watch: &mut Watch) -> Result<MotionEnd> {
        let mut follower = Follower::new(Playback::new(motion), self.robot.version());
        let mut stopped: Option<StopReason> = None;
        let played = self.robot.control_joint_positions(InternalController::JointImpedance, |state, elapsed| {
            if let Some(reason) = watch.observe(&arm_state(state)) {
                stopped.get_or_insert_with(|| reason.clone());
                follower.stop();
            }
            match follower.next(state, elapsed.as_millis() as u64) {
                Next::Position(q) => ControlFlow::Continue(q.into()),
                Next::Last(q) => ControlFlow::Break(q.into()),
            }
        });
        match (played, stopped) {
            (Err(error), _) => Err(self.error(error)),
            (Ok(_), Some(reason)) => Err(RobotError::Stopped(reason)),
            (Ok(_), None) => Ok(MotionEnd::Arrived),
        }
    }

    /// The loop of a touch-down.
    fn come_down(&mut self, touch_down: &TouchDown, watch: &mut Watch) -> Result<Touched> {
        let arm = &self.geometry;
        let mut descent: Option<Descent> = None;
        let mut stopped: Option<StopReason> = None;
        let controlled = self.robot.control_torques(|state, _| {
            let (q, dq) = (JointVector::from(state.q), JointVector::from(state.dq));
            let descent = descent
                .get_or_insert_with(|| Descent::new(*touch_down, arm, q, JointVector::from(state.torque_desired)));
            if let Some(reason) = watch.observe(&arm_state(state)) {
                stopped = Some(reason.clone());
                // At this speed the robot's own control holds the arm in place.
                return ControlFlow::Break((*descent.last_torque()).into());
            }
            match descent.next(arm, &q, &dq, state.external_wrench_in_base[2]) {
                (torque, false) => ControlFlow::Continue(torque.into()),
                (torque, true) => ControlFlow::Break(torque.into()),
            }
        });
        match (controlled, stopped, descent) {
            (Err(error), ..) => Err(self.error(error)),
            (Ok(_), Some(reason), _) => Err(RobotError::Stopped(reason)),
            (Ok(_), None, Some(descent)) => Ok(descent.touched()),
            (Ok(_), None, None) => Err(RobotError::Device("the control loop did not begin".into())),
        }
    }

    /// Passes the states of a duration to `watch`.
    fn observe_for(&mut self, duration_secs: f64, watch: &mut Watch) -> Result<()> {
        let begun_secs = self.observe(watch)?.time_secs;
        while self.observe(watch)?.time_secs < begun_secs + duration_secs {}
        Ok(())
    }

    /// The next state, checked by `watch`.
    fn observe(&mut self, watch: &mut Watch) -> Result<ArmState> {
        let state = self.state()?;
        if let Some(reason) = watch.observe(&state) {
            return Err(RobotError::Stopped(reason.clone()));
        }
        match state.mode {
            ArmMode::Reflex => Err(RobotError::Reflex(self.robot.state().reflex_reason.to_string())),
            ArmMode::UserStopped => Err(RobotError::Stopped(StopReason::Mode(state.mode))),
            _ => Ok(state),
        }
    }
}

impl Arm for FrankaArm {
    fn geometry(&self) -> &ArmGeometry {
        &self.geometry
    }

    fn state(&mut self) -> Result<ArmState> {
        match self.robot.read_state() {
            Ok(state) => Ok(arm_state(state)),
            Err(error) => Err(self.error(error)),
        }
    }

    fn follow(&mut self, motion: &CheckedMotion, watch: &mut Watch) -> Result<MotionEnd> {
        self.in_control(|arm| arm.play(motion, watch))
    }

    fn wait(&mut self, duration_secs: f64, watch: &mut Watch) -> Result<()> {
        let waited = self.observe_for(duration_secs, watch);
        if waited.is_err() {
            self.hand.stop_motion();
        }
        waited
    }

    fn hand(&mut self) -> Result<HandState> {
        self.hand.state(&self.address)
    }

    fn start_hand(&mut self, command: HandCommand) -> Result<()> {
        self.check_hand_may_move()?;
        self.hand.start(command)
    }

    fn finish_hand(&mut self, watch: &mut Watch) -> Result<HandState> {
        while self.hand.is_moving() {
            if let Err(error) = self.observe(watch) {
                self.hand.stop_motion();
                return Err(error);
            }
        }
        self.hand.finish()?;
        self.hand.state(&self.address)
    }

    fn set_contact_sensitivity(&mut self, sensitivity: ContactSensitivity) -> Result<()> {
        if self.sensitivity == Some(sensitivity) {
            return Ok(());
        }
        self.robot.set_collision_behavior(&collision_behavior(sensitivity)).map_err(|error| self.error(error))?;
        self.sensitivity = Some(sensitivity);
        Ok(())
    }

    fn set_load(&mut self, load: Load) -> Result<()> {
        let moment = 0.4 * load.mass_kg * LOAD_RADIUS_M * LOAD_RADIUS_M;
        let load = sdg_fci::wire::Load {
            mass: load.mass_kg,
            center: load.center_in_flange_m,
            inertia: [moment, 0.0, 0.0, 0.0, moment, 0.0, 0.0, 0.0, moment],
        };
        self.robot.set_load(&load).map_err(|error| self.error(error))
    }

    fn stop(&mut self) -> Result<()> {
        self.hand.stop_motion();
        match self.robot.state().robot_mode {
            RobotMode::Move => self.robot.stop().map_err(|error| self.error(error)),
            _ => Ok(()),
        }
    }

    fn recover(&mut self) -> Result<()> {
        self.robot.automatic_error_recovery().map_err(|error| self.error(error))?;
        // States from before the answer may still be on their way; the next motion must not begin with one of them.
        let deadline = Instant::now() + MAX_LATE;
        let mut mode = self.state()?.mode;
        while matches!(mode, ArmMode::Reflex | ArmMode::Recovering) && Instant::now() < deadline {
            mode = self.state()?.mode;
        }
        check_recovered(mode, self.robot.state().reflex_reason)
    }
}

impl CompliantArm for FrankaArm {
    fn touch_down(&mut self, touch_down: &TouchDown, watch: &mut Watch) -> Result<Touched> {
        self.in_control(|arm| {
            arm.set_contact_sensitivity(ContactSensitivity::Contact)?;
            arm.come_down(touch_down, watch)
        })
    }
}

/// Checks the mode after a recovery.
fn check_recovered(mode: ArmMode, reflex_reason: RobotErrors) -> Result<()> {
    match mode {
        ArmMode::Idle | ArmMode::Moving | ArmMode::Guiding => Ok(()),
        ArmMode::Reflex => Err(RobotError::Reflex(reflex_reason.to_string())),
        ArmMode::UserStopped | ArmMode::Recovering => Err(RobotError::Stopped(StopReason::Mode(mode))),
    }
}

fn model_of(version: Version) -> RobotModel {
    match version {
        Version::V5 => RobotModel::Panda,
        Version::V10 => RobotModel::Fr3,
    }
}

fn arm_state(state: &RobotState) -> ArmState {
    ArmState {
        time_secs: state.message_id as f64 * 1e-3,
        q: JointVector::from(state.q),
        dq: JointVector::from(state.dq),
        q_commanded: JointVector::from(state.q_desired),
        tau_external_nm: JointVector::from(state.external_torque),
        mode: match state.robot_mode {
            RobotMode::Idle => ArmMode::Idle,
            RobotMode::Move => ArmMode::Moving,
            RobotMode::Guiding => ArmMode::Guiding,
            RobotMode::Reflex => ArmMode::Reflex,
            RobotMode::AutomaticErrorRecovery => ArmMode::Recovering,
            RobotMode::UserStopped | RobotMode::Other => ArmMode::UserStopped,
        },
    }
}

/// The thresholds at which a Franka stops by itself.
fn collision_behavior(sensitivity: ContactSensitivity) -> CollisionBehavior {
    let factor = match sensitivity {
        ContactSensitivity::Free => 1.0,
        ContactSensitivity::Contact => CONTACT_FACTOR,
    };
    let (torque, force) = (FREE_TORQUE_NM.map(|value| value * factor), FREE_FORCE.map(|value| value * factor));
    CollisionBehavior::new(torque, torque, force, force)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_franka_stops_at_20_n_in_free_motion_and_at_40_n_where_it_may_touch() {
        for (sensitivity, max_n, max_nm) in
            [(ContactSensitivity::Free, 20.0, 20.0), (ContactSensitivity::Contact, 40.0, 40.0)]
        {
            let behavior = collision_behavior(sensitivity);
            for force in [behavior.upper_force_nominal, behavior.upper_force_acceleration] {
                assert!(force[..3].iter().all(|value| *value > 0.0 && *value <= max_n), "{sensitivity:?}: {force:?}");
            }
            for torque in [behavior.upper_torque_nominal, behavior.upper_torque_acceleration] {
                assert!(torque.iter().all(|value| *value > 0.0 && *value <= max_nm), "{sensitivity:?}: {torque:?}");
            }
        }
    }

    #[test]
    fn an_arm_that_remains_in_reflex_is_not_recovered() {
        let none = RobotErrors::default();
        assert!(check_recovered(ArmMode::Idle, none).is_ok());
        assert!(matches!(check_recovered(ArmMode::Reflex, none), Err(RobotError::Reflex(_))));
        for mode in [ArmMode::UserStopped, ArmMode::Recovering] {
            let found = check_recovered(mode, none);
            assert!(
                matches!(found, Err(RobotError::Stopped(StopReason::Mode(in_mode))) if in_mode == mode),
                "{found:?}"
            );
        }
    }
}
