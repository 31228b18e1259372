//! The simulated Panda as an arm for the grasp sequence.

use sdg_kinematics::ArmGeometry;
use sdg_robot::{
    Arm, ArmMode, ArmState, CheckedMotion, ContactSensitivity, HandCommand, HandState, Load, MotionEnd, PERIOD_SECS,
    Playback, RobotError, StopReason, Watch, held_widths_m,
};

use crate::attempt_errors::{ArmFault, ArmFaultKind};
use crate::controller::ArmReference;
use crate::error::SimulationError;
use crate::panda::ArmVector;
use crate::workcell::Workcell;

type Result<T> = sdg_robot::Result<T>;

/// Distance of a joint from its reference above which the arm counts as blocked, in radians.
const BLOCKED_RAD: f64 = 0.03;
/// Interval of checks of a moving hand, in seconds.
const HAND_PERIOD_SECS: f64 = 0.05;
/// Time without movement after which the fingers count as closed, in seconds.
const HAND_STILL_SECS: f64 = 0.2;
/// Movement between two checks below which fingers count as not moving, in metres.
const HAND_STILL_M: f64 = 1e-4;
/// Maximum duration of a motion of the hand, in seconds: time for each finger to move by up to 0.04 m at 0.05 m/s, and
/// for the force to increase.
const MAX_HAND_SECS: f64 = 1.6;
/// Tolerance of the hand's opening, in metres.
const HAND_THERE_M: f64 = 1e-3;
/// Fraction of the commanded force above which the hand counts as pressing.
const PRESSING_SHARE: f64 = 0.8;
/// Error of the reported joint position during a [`ArmFaultKind::Jump`] fault, in radians.
const JUMP_RAD: f64 = 1.0;

impl From<SimulationError> for RobotError {
    fn from(error: SimulationError) -> Self {
        Self::Device(Box::new(error))
    }
}

impl Workcell {
    /// The fault that is due, if there is one.
    fn fault(&self) -> Option<ArmFaultKind> {
        let ArmFault { at_secs, kind } = self.config().errors.arm_fault?;
        (self.data.time_secs() >= at_secs).then_some(kind)
    }

    fn arm_state(&self, mode: ArmMode) -> ArmState {
        let mut q = self.panda_ids.position(&self.data);
        match self.fault() {
            Some(ArmFaultKind::NotANumber) => q[3] = f64::NAN,
            Some(ArmFaultKind::Jump) => q[3] += JUMP_RAD,
            Some(ArmFaultKind::Reflex | ArmFaultKind::HandStuck) | None => {}
        }
        ArmState {
            time_secs: self.data.time_secs(),
            q,
            dq: self.panda_ids.velocity(&self.data),
            q_commanded: self.commanded(),
            tau_external_nm: ArmVector::zeros(),
            mode: if self.is_in_reflex { ArmMode::Reflex } else { mode },
        }
    }

    /// Advances one cycle, in motion or at rest; returns the reason if the arm must stop.
    fn cycle(&mut self, watch: &mut Watch) -> Result<Option<StopReason>> {
        self.tick()?;
        self.observe_moving(watch)
    }

    /// Passes the state of a cycle to `watch`, and returns the reason if the arm must stop. A reflex fault that is due
    /// stops the arm and is returned as an error.
    pub(crate) fn observe_moving(&mut self, watch: &mut Watch) -> Result<Option<StopReason>> {
        if self.fault() == Some(ArmFaultKind::Reflex) && !self.is_in_reflex {
            self.is_in_reflex = true;
            self.set_reference(ArmReference::at_rest(self.panda_ids.position(&self.data)));
            watch.observe(&self.arm_state(ArmMode::Reflex));
            return Err(RobotError::Reflex("an injected reflex".to_owned()));
        }
        Ok(watch.observe(&self.arm_state(ArmMode::Moving)).cloned())
    }

    fn hand_force_n(&self) -> f64 {
        let motors = self.panda_ids.finger_motors;
        // Closing forces are negative.
        motors.iter().map(|motor| -self.data.ctrl()[motor.index()]).fold(f64::INFINITY, f64::min)
    }
}

impl Arm for Workcell {
    fn geometry(&self) -> &ArmGeometry {
        &self.panda
    }

    fn state(&mut self) -> Result<ArmState> {
        Ok(self.arm_state(ArmMode::Idle))
    }

    fn follow(&mut self, motion: &CheckedMotion, watch: &mut Watch) -> Result<MotionEnd> {
        let mut playback = Playback::new(motion);
        let mut stopped = None;
        while let Some(reference) = playback.next_reference() {
            self.set_reference(ArmReference {
                position: reference.q,
                velocity: reference.dq,
                acceleration: reference.ddq,
            });
            if let Some(reason) = self.cycle(watch)? {
                playback.stop();
                stopped.get_or_insert(reason);
            }
            if (self.panda_ids.position(&self.data) - reference.q).amax() > BLOCKED_RAD {
                let obstacle = self.describe_arm_contacts();
                self.set_reference(ArmReference::at_rest(self.panda_ids.position(&self.data)));
                return Ok(MotionEnd::Blocked(obstacle));
            }
        }
        match stopped {
            Some(reason) => Err(RobotError::Stopped(reason)),
            None => Ok(MotionEnd::Arrived),
        }
    }

    fn wait(&mut self, duration_secs: f64, watch: &mut Watch) -> Result<()> {
        self.set_reference(ArmReference::at_rest(self.commanded()));
        for _ in 0..(duration_secs / PERIOD_SECS).round() as usize {
            if let Some(reason) = self.cycle(watch)? {
                return Err(RobotError::Stopped(reason));
            }
        }
        Ok(())
    }

    fn hand(&mut self) -> Result<HandState> {
        let (opening_m, force_n) = (self.opening_m(), self.hand_force_n());
        let is_grasping = match self.hand_command {
            Some(HandCommand::Grasp { width_m, tolerance_m, force_n: told_n, .. }) => {
                held_widths_m(width_m, tolerance_m).contains(&opening_m)
                    && force_n >= PRESSING_SHARE * told_n.min(crate::MAX_FINGER_FORCE_N)
            }
            Some(HandCommand::Move { .. }) | None => false,
        };
        Ok(HandState { opening_m, is_grasping, force_n: Some(force_n) })
    }

    fn start_hand(&mut self, command: HandCommand) -> Result<()> {
        match command {
            _ if self.fault() == Some(ArmFaultKind::HandStuck) => {}
            HandCommand::Move { opening_m, speed_m_s } => self.gripper.move_to(opening_m, speed_m_s),
            HandCommand::Grasp { force_n, .. } => self.gripper.grasp(force_n),
        }
        self.hand_command = Some(command);
        Ok(())
    }

    fn finish_hand(&mut self, watch: &mut Watch) -> Result<HandState> {
        let (mut still_secs, mut elapsed_secs) = (0.0, 0.0);
        let is_there = |opening_m: f64, still_secs: f64, command: Option<HandCommand>| match command {
            Some(HandCommand::Move { opening_m: told_m, .. }) => (opening_m - told_m).abs() < HAND_THERE_M,
            Some(HandCommand::Grasp { .. }) => still_secs >= HAND_STILL_SECS,
            None => true,
        };
        while elapsed_secs < MAX_HAND_SECS && !is_there(self.opening_m(), still_secs, self.hand_command) {
            let before = self.opening_m();
            self.wait(HAND_PERIOD_SECS, watch)?;
            elapsed_secs += HAND_PERIOD_SECS;
            still_secs =
                if (self.opening_m() - before).abs() < HAND_STILL_M { still_secs + HAND_PERIOD_SECS } else { 0.0 };
        }
        if let Some(HandCommand::Move { opening_m: told_m, .. }) = self.hand_command {
            let found_m = self.opening_m();
            if (found_m - told_m).abs() >= HAND_THERE_M {
                let (given_mm, found_mm) = (told_m * 1e3, found_m * 1e3);
                return Err(RobotError::Hand(format!(
                    "the opening should be {given_mm:.0} mm, but is {found_mm:.0} mm"
                )));
            }
        }
        self.hand()
    }

    /// Does nothing: the simulated arm stops if a joint is more than `BLOCKED_RAD` from its reference.
    fn set_contact_sensitivity(&mut self, _sensitivity: ContactSensitivity) -> Result<()> {
        Ok(())
    }

    /// Stores the load for torque control. Position control does not need it: at its stiffness a part causes an error
    /// of a fraction of a millimetre.
    fn set_load(&mut self, load: Load) -> Result<()> {
        self.load = load;
        Ok(())
    }

    fn stop(&mut self) -> Result<()> {
        self.set_reference(ArmReference::at_rest(self.panda_ids.position(&self.data)));
        Ok(())
    }

    fn recover(&mut self) -> Result<()> {
        if self.fault() == Some(ArmFaultKind::Reflex) {
            return Err(RobotError::Reflex("its cause is still present".to_owned()));
        }
        self.is_in_reflex = false;
        Ok(())
    }
}
