//! The simulated robot: it takes requests and commands and returns responses and states, cycle by cycle. It has no
//! socket, and its time advances only by calls.

use nalgebra::Isometry3;

use super::cartesian::{CartesianReference, MIN_SINGULAR_VALUE, elbow_of, smallest_singular_value};
use super::contact::Contacts;
use super::frames::{end_effector_at, shifted};
use super::motion::{Motion, References};
use super::plant::{Jacobian, JointVector, Observation, Plant};
use super::reference::{JointReference, PERIOD_SECS};
use super::settings::Settings;
use super::torque::{EndEffector, cartesian_impedance, joint_impedance, load_gravity};
use crate::limits::Limits;
use crate::wire::robot_error::{RobotError, RobotErrors};
use crate::wire::{
    Command, ControllerMode, MotionGeneratorMode, MoveRequest, Request, Response, RobotCommand, RobotMode, Status,
};

/// Number of cycles of a recovery during which the arm yields to contacts, so that the next motion does not start in a
/// collision.
const RECOVERY_CYCLES: u32 = 200;
/// In lockstep, the simulation pauses once the measured velocities are below this limit, rad/s, or after
/// [`MAX_SETTLING_CYCLES`] without a motion: an arm that presses on an object may never be completely at rest.
const STILL: f64 = 1e-3;
const MAX_SETTLING_CYCLES: u32 = 1000;
/// A measured joint velocity below this, rad/s, counts as rest.
const STANDING: f64 = 0.01;

/// A response to be sent.
#[derive(Debug, Clone, PartialEq)]
pub struct Outgoing {
    /// Number of the request.
    pub command_id: u32,
    /// The request's command.
    pub command: Command,
    /// Status and payload of the response.
    pub response: Response,
}

/// A robot with its settings, references and errors.
#[derive(Debug)]
pub struct RobotCore {
    pub(super) limits: Limits,
    pub(super) settings: Settings,
    pub(super) observation: Observation,
    pub(super) references: References,
    pub(super) contacts: Contacts,
    /// The collisions that led to a reflex, until the recovery.
    pub(super) collisions: Contacts,
    pub(super) motion: Option<Motion>,
    pub(super) mode: RobotMode,
    pub(super) errors: RobotErrors,
    pub(super) reflex_reason: RobotErrors,
    /// Whether the arm has been in self-collision since the start of the motion; such a motion may continue, to leave
    /// the collision.
    pub(super) began_in_self_collision: bool,
    pub(super) time_ms: u64,
    pub(super) torque: JointVector,
    pub(super) torque_rate: JointVector,
    /// Cycles since the last motion.
    idle_cycles: u32,
    /// Remaining cycles of the present recovery.
    recovery_cycles: u32,
    /// Answers that wait until the arm is at rest.
    waiting: Vec<Outgoing>,
    outbox: Vec<Outgoing>,
}

impl RobotCore {
    /// A robot at rest in the plant's configuration.
    pub fn new(plant: &mut dyn Plant, limits: Limits) -> Self {
        let observation = plant.observe();
        let settings = Settings::default();
        let q = observation.q;
        let torque = observation.gravity;
        let pose = plant.flange(&q).0 * settings.flange_from_ee();
        Self {
            limits,
            settings,
            observation,
            references: References {
                joints: JointReference::at_rest(q),
                cartesian: CartesianReference::at_rest(pose, &q),
                torque: JointVector::zeros(),
            },
            contacts: Contacts::default(),
            collisions: Contacts::default(),
            motion: None,
            mode: RobotMode::Idle,
            errors: RobotErrors::default(),
            reflex_reason: RobotErrors::default(),
            began_in_self_collision: false,
            time_ms: 1,
            torque,
            torque_rate: JointVector::zeros(),
            idle_cycles: 0,
            recovery_cycles: 0,
            waiting: Vec::new(),
            outbox: Vec::new(),
        }
    }

    /// Removes and returns the responses that are due.
    pub fn take_responses(&mut self) -> Vec<Outgoing> {
        std::mem::take(&mut self.outbox)
    }

    /// Whether the client of the running motion has answered a state; `None` without a motion.
    pub fn expects_commands(&self) -> Option<bool> {
        self.motion.as_ref().map(|motion| motion.communication.has_started())
    }

    /// Whether nothing moves (or no motion has run for [`MAX_SETTLING_CYCLES`]) and no request waits for an answer.
    pub fn is_settled(&self) -> bool {
        let is_still = self.observation.dq.amax() < STILL || self.idle_cycles > MAX_SETTLING_CYCLES;
        self.motion.is_none() && self.waiting.is_empty() && self.references.joints.is_at_rest() && is_still
    }

    /// Advances only the robot's clock by a millisecond.
    pub fn tick_clock(&mut self) {
        self.time_ms += 1;
    }

    /// Milliseconds since the start, which is the number of the present state.
    pub fn time_ms(&self) -> u64 {
        self.time_ms
    }

    /// The errors for which the robot stopped, until the recovery.
    pub fn errors(&self) -> RobotErrors {
        self.errors
    }

    /// Executes a client's request, except Connect.
    pub fn request(&mut self, plant: &dyn Plant, command_id: u32, request: &Request) {
        let command = request.command();
        let mut rest = Vec::new();
        let status = match request {
            Request::Move(request) => match self.start(plant, command_id, request) {
                Ok(()) => Status::MotionStarted,
                Err(status) => status,
            },
            Request::StopMove => {
                if self.motion.is_some() {
                    self.end_motion(Status::Preempted);
                }
                self.answer_when_standing(command_id, command, Status::Success);
                return;
            }
            Request::AutomaticErrorRecovery => {
                if self.motion.is_some() || self.mode == RobotMode::UserStopped {
                    Status::NotPossible
                } else {
                    self.errors = RobotErrors::default();
                    self.collisions = Contacts::default();
                    self.mode = RobotMode::AutomaticErrorRecovery;
                    self.recovery_cycles = RECOVERY_CYCLES;
                    self.answer_when_standing(command_id, command, Status::Success);
                    return;
                }
            }
            // The simulation has no virtual walls: size, frame and activation are zero.
            Request::GetCartesianLimit(_) => {
                rest = vec![0; 3 * 8 + 16 * 8 + 1];
                Status::Success
            }
            // The library is machine code of Franka's, which this server does not have.
            Request::LoadModelLibrary(_) => Status::Error,
            Request::Connect { .. } | Request::GetRobotModel => Status::NotPossible,
            setter if self.motion.is_some() => {
                debug_assert!(setter.command() != Command::Move);
                Status::NotPossible
            }
            setter => self.settings.set(setter).unwrap_or(Status::NotPossible),
        };
        self.outbox.push(Outgoing { command_id, command, response: Response { status, rest } });
    }

    /// Records that the client is disconnected, which is a communication error of a running motion.
    pub fn disconnect(&mut self) {
        if self.motion.is_some() {
            self.abort(RobotError::CommunicationConstraintsViolation.into());
        }
        self.waiting.clear();
        self.outbox.clear();
    }

    /// Advances by a millisecond, with the client's answer to the present state, if any.
    ///
    /// # Errors
    /// The plant's errors.
    pub fn cycle(&mut self, plant: &mut dyn Plant, command: Option<&RobotCommand>) -> Result<(), String> {
        self.idle_cycles = if self.motion.is_some() { 0 } else { self.idle_cycles.saturating_add(1) };
        self.update_references(plant, command);
        let (flange, flange_jacobian) = plant.flange(&self.observation.q);
        self.references.torque = self.controller_torque(plant, &flange, &flange_jacobian);
        let load = self.load_torque(&flange, &flange_jacobian);
        let total = self.references.torque + self.observation.gravity + load;
        let total =
            JointVector::from_fn(|joint, _| total[joint].clamp(-self.limits.torque[joint], self.limits.torque[joint]));
        plant.step(&total)?;
        self.time_ms += 1;
        self.torque_rate = (total - self.torque) / PERIOD_SECS;
        self.torque = total;
        self.observation = plant.observe();
        self.monitor(plant);
        self.send_waiting();
        Ok(())
    }

    fn start(&mut self, plant: &dyn Plant, command_id: u32, request: &MoveRequest) -> Result<(), Status> {
        if self.motion.is_some() || self.mode != RobotMode::Idle || !self.waiting.is_empty() {
            return Err(Status::NotPossible);
        }
        for deviation in [request.max_path_deviation, request.max_goal_deviation] {
            if !(deviation.translation > 0.0 && deviation.rotation > 0.0 && deviation.elbow > 0.0) {
                return Err(Status::InvalidArgument);
            }
        }
        let is_cartesian = matches!(
            request.generator,
            MotionGeneratorMode::CartesianPosition | MotionGeneratorMode::CartesianVelocity
        );
        let q = self.references.joints.q;
        let (pose, jacobian) = end_effector_at(plant, &self.settings.flange_from_ee(), &q);
        if is_cartesian && smallest_singular_value(&jacobian) < MIN_SINGULAR_VALUE {
            return Err(Status::StartAtSingularPose);
        }
        self.references.joints = JointReference::at_rest(q);
        self.references.cartesian = CartesianReference::at_rest(pose, &q);
        self.motion = Some(Motion::new(command_id, request.controller, request.generator));
        self.reflex_reason = RobotErrors::default();
        self.began_in_self_collision = self.observation.self_collision;
        self.mode = RobotMode::Move;
        Ok(())
    }

    fn update_references(&mut self, plant: &dyn Plant, command: Option<&RobotCommand>) {
        let flange_from_ee = self.settings.flange_from_ee();
        let at = |q: &JointVector| end_effector_at(plant, &flange_from_ee, q);
        if self.mode == RobotMode::AutomaticErrorRecovery {
            self.recovery_cycles = self.recovery_cycles.saturating_sub(1);
            self.references.joints = JointReference::at_rest(self.observation.q);
        }
        if let Some(motion) = &mut self.motion {
            match motion.follow(&self.references, command, &self.limits, &at) {
                Ok((references, is_finished)) => {
                    self.references = references;
                    if is_finished {
                        self.end_motion(Status::Success);
                    }
                    return;
                }
                // The arm brakes in this cycle already: a reference that stays in place for one cycle would be a jerk.
                Err(errors) => self.abort(errors),
            }
        }
        let measured = self.measured();
        let joints = &mut self.references.joints;
        *joints = if joints.is_at_rest() {
            JointReference::at_rest(joints.q)
        } else if is_collision(self.errors) {
            measured.yielding(&self.limits)
        } else {
            joints.braked(&self.limits)
        };
        self.references.cartesian = CartesianReference::at_rest(at(&joints.q).0, &joints.q);
    }

    /// Ends the motion. The Move is answered when the arm is at rest if `status` is a success, otherwise at once.
    fn end_motion(&mut self, status: Status) {
        let Some(motion) = self.motion.take() else { return };
        self.mode = RobotMode::Idle;
        if motion.controller == ControllerMode::External {
            self.follow_measurement();
        }
        match status {
            Status::Success => self.answer_when_standing(motion.command_id, Command::Move, status),
            _ => self.outbox.push(outgoing(motion.command_id, Command::Move, status)),
        }
    }

    /// Stops because of errors: the motion ends and the arm brakes. Braking starts from the measured motion after a
    /// collision or if the client controlled the torques, otherwise from the reference. No motion can start until the
    /// recovery.
    pub(super) fn abort(&mut self, errors: RobotErrors) {
        self.errors = errors;
        self.reflex_reason = errors;
        self.collisions = self.contacts;
        let is_external = self.motion.as_ref().is_some_and(|motion| motion.controller == ControllerMode::External);
        if is_collision(errors) || is_external {
            // The arm is not at the reference, and must not move to it.
            self.follow_measurement();
        }
        if let Some(motion) = self.motion.take() {
            self.outbox.push(outgoing(motion.command_id, Command::Move, Status::ReflexAborted));
        }
        self.mode = RobotMode::Reflex;
    }

    /// The measured motion as a reference.
    fn measured(&self) -> JointReference {
        let Observation { q, dq, .. } = self.observation;
        JointReference { q, dq, ddq: JointVector::zeros() }
    }

    fn follow_measurement(&mut self) {
        self.references.joints = self.measured();
    }

    fn controller_torque(&self, plant: &dyn Plant, flange: &Isometry3<f64>, flange_jacobian: &Jacobian) -> JointVector {
        let controller = self.motion.as_ref().map_or(ControllerMode::JointImpedance, |motion| motion.controller);
        let joints = &self.references.joints;
        // Until the first command of a torque motion, the internal controller holds the arm.
        let has_started = self.motion.as_ref().is_some_and(|motion| motion.communication.has_started());
        match controller {
            ControllerMode::External if has_started => self.references.torque,
            ControllerMode::CartesianImpedance => {
                let flange_from_ee = self.settings.flange_from_ee();
                let (pose_desired, jacobian_desired) = end_effector_at(plant, &flange_from_ee, &joints.q);
                let end_effector = EndEffector {
                    base_from_ee: flange * flange_from_ee,
                    jacobian: shifted(flange_jacobian, flange, &flange_from_ee),
                    base_from_ee_desired: pose_desired,
                    twist_desired: jacobian_desired * joints.dq,
                };
                cartesian_impedance(&self.observation, &end_effector, joints, &self.settings.cartesian_stiffness)
            }
            _ => joint_impedance(&self.observation, joints, &self.settings.joint_stiffness),
        }
    }

    pub(super) fn load_torque(&self, flange: &Isometry3<f64>, flange_jacobian: &Jacobian) -> JointVector {
        let load = &self.settings.load;
        let lever = flange.rotation * nalgebra::Vector3::from(load.center);
        load_gravity(load.mass, flange_jacobian, &lever)
    }

    fn answer_when_standing(&mut self, command_id: u32, command: Command, status: Status) {
        self.waiting.push(outgoing(command_id, command, status));
    }

    /// Sends the waiting answers if the arm is at rest.
    fn send_waiting(&mut self) {
        let is_standing = self.references.joints.is_at_rest() && self.observation.dq.amax() < STANDING;
        if self.motion.is_some() || !is_standing || self.recovery_cycles > 0 {
            return;
        }
        if self.mode == RobotMode::AutomaticErrorRecovery {
            self.mode = RobotMode::Idle;
        }
        self.outbox.append(&mut self.waiting);
    }

    /// Joint 3 and the sign of joint 4, measured.
    pub(super) fn elbow(&self) -> [f64; 2] {
        elbow_of(&self.observation.q)
    }
}

fn outgoing(command_id: u32, command: Command, status: Status) -> Outgoing {
    Outgoing { command_id, command, response: Response { status, rest: Vec::new() } }
}

fn is_collision(errors: RobotErrors) -> bool {
    errors.contains(RobotError::JointReflex) || errors.contains(RobotError::CartesianReflex)
}

#[cfg(test)]
mod tests {
    use nalgebra::SMatrix;

    use super::*;
    use crate::wire::{Deviation, MotionCommand};

    /// Joints that do not influence each other, with the inertia of a wrist and its motor, without gravity.
    struct Wrists {
        q: JointVector,
        dq: JointVector,
    }

    /// kg·m².
    const INERTIA: f64 = 0.1;

    impl Plant for Wrists {
        fn observe(&mut self) -> Observation {
            let zero = JointVector::zeros();
            Observation {
                q: self.q,
                dq: self.dq,
                mass: SMatrix::identity() * INERTIA,
                gravity: zero,
                coriolis: zero,
                contact_torque: zero,
                self_collision: false,
            }
        }

        fn flange(&self, _: &JointVector) -> (Isometry3<f64>, Jacobian) {
            (Isometry3::identity(), Jacobian::zeros())
        }

        fn step(&mut self, torque: &JointVector) -> Result<(), String> {
            self.dq += torque * (PERIOD_SECS / INERTIA);
            self.q += self.dq * PERIOD_SECS;
            Ok(())
        }

        fn move_hand(&mut self, _: f64, _: f64, _: f64) {}

        fn hand_width(&self) -> (f64, f64) {
            (0.04, 0.0)
        }
    }

    #[test]
    fn an_aborted_motion_brakes_within_the_limit_of_acceleration() {
        let robot = stops_within_the_limit_of_acceleration(|_| {});
        assert!(robot.errors().contains(RobotError::CommunicationConstraintsViolation));
    }

    #[test]
    fn after_a_collision_the_arm_brakes_within_the_limit_of_acceleration() {
        stops_within_the_limit_of_acceleration(|robot| robot.abort(RobotError::JointReflex.into()));
    }

    /// Moves the last joint at 1.5 rad/s, then calls `stop` and sends no further commands; checks the acceleration of
    /// braking.
    fn stops_within_the_limit_of_acceleration(stop: impl Fn(&mut RobotCore)) -> RobotCore {
        const JOINT: usize = 6;
        const ACCELERATION: f64 = 5.0;
        let mut plant =
            Wrists { q: JointVector::from([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.0]), dq: JointVector::zeros() };
        let mut robot = RobotCore::new(&mut plant, Limits::PANDA);
        let deviation = Deviation { translation: 10.0, rotation: 3.12, elbow: 6.0 };
        let request = Request::Move(MoveRequest {
            controller: ControllerMode::JointImpedance,
            generator: MotionGeneratorMode::JointPosition,
            max_path_deviation: deviation,
            max_goal_deviation: deviation,
        });
        robot.request(&plant, 1, &request);
        let (mut q, mut velocity) = (plant.q, 0.0_f64);
        let mut largest = 0.0_f64;
        let mut cycle = |robot: &mut RobotCore, command: Option<&RobotCommand>| {
            let before = plant.dq;
            robot.cycle(&mut plant, command).unwrap();
            largest = largest.max(((plant.dq - before) / PERIOD_SECS)[JOINT].abs());
            plant.dq[JOINT]
        };
        for _ in 0..400 {
            velocity = (velocity + ACCELERATION * PERIOD_SECS).min(1.5);
            q[JOINT] += velocity * PERIOD_SECS;
            let motion = MotionCommand { q: q.into(), ..MotionCommand::default() };
            cycle(&mut robot, Some(&RobotCommand { motion, ..RobotCommand::default() }));
        }
        assert_eq!(robot.mode, RobotMode::Move);
        stop(&mut robot);
        let last = (0..300).map(|_| cycle(&mut robot, None)).last().unwrap();
        assert!(last.abs() < STANDING, "{last} rad/s");
        let limit = Limits::PANDA.acceleration[JOINT];
        assert!(largest <= limit * 1.05, "{largest} rad/s² of at most {limit}");
        robot
    }
}
