//! The requests of a client to the robot, over TCP.

use super::codec::{Codec, Decoder, Encoder, Real};
use super::commands::Command;
use super::header::{Header, HeaderKind};
use super::modes::{ControllerMode, MotionGeneratorMode};
use super::state::{IDENTITY, Transform};
use super::version::Version;
use crate::wire_error::WireError;

/// Largest deviations from a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// Translation, m.
    pub translation: f64,
    /// Rotation, rad.
    pub rotation: f64,
    /// Elbow, rad.
    pub elbow: f64,
}

/// Parameters of a Move, which starts a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MoveRequest {
    /// The controller.
    pub controller: ControllerMode,
    /// The generator.
    pub generator: MotionGeneratorMode,
    /// Largest deviation along the path.
    pub max_path_deviation: Deviation,
    /// Largest deviation at the end.
    pub max_goal_deviation: Deviation,
}

/// Thresholds of external joint torques (N·m) and of the external wrench (N, N·m). Above the lower thresholds the robot
/// reports a contact; above the upper ones it reports a collision and stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CollisionBehavior {
    /// Thresholds of contacts while the arm accelerates.
    pub lower_torque_acceleration: [f64; 7],
    /// Thresholds of collisions while the arm accelerates.
    pub upper_torque_acceleration: [f64; 7],
    /// Thresholds of contacts at constant speed.
    pub lower_torque_nominal: [f64; 7],
    /// Thresholds of collisions at constant speed.
    pub upper_torque_nominal: [f64; 7],
    /// Thresholds of contacts while the arm accelerates.
    pub lower_force_acceleration: [f64; 6],
    /// Thresholds of collisions while the arm accelerates.
    pub upper_force_acceleration: [f64; 6],
    /// Thresholds of contacts at constant speed.
    pub lower_force_nominal: [f64; 6],
    /// Thresholds of collisions at constant speed.
    pub upper_force_nominal: [f64; 6],
}

impl CollisionBehavior {
    /// The same thresholds for acceleration and for constant speed.
    pub fn new(lower_torque: [f64; 7], upper_torque: [f64; 7], lower_force: [f64; 6], upper_force: [f64; 6]) -> Self {
        Self {
            lower_torque_acceleration: lower_torque,
            upper_torque_acceleration: upper_torque,
            lower_torque_nominal: lower_torque,
            upper_torque_nominal: upper_torque,
            lower_force_acceleration: lower_force,
            upper_force_acceleration: upper_force,
            lower_force_nominal: lower_force,
            upper_force_nominal: upper_force,
        }
    }
}

/// The load of the robot in addition to its end effector.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Load {
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass in the flange's frame, m.
    pub center: [f64; 3],
    /// Inertia about the centre of mass, kg·m², column by column.
    pub inertia: [f64; 9],
}

/// A request of the client, with its parameters.
#[allow(clippy::large_enum_variant, reason = "requests come one at a time, and none is kept")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Request {
    /// Opens a session; states go to the UDP port.
    Connect {
        /// The client's version.
        version: u16,
        /// The client's UDP port.
        udp_port: u16,
    },
    /// Starts a motion.
    Move(MoveRequest),
    /// Ends the running motion.
    StopMove,
    /// Reads a virtual wall (version 5).
    GetCartesianLimit(u32),
    /// Sets the thresholds for contacts and collisions.
    SetCollisionBehavior(CollisionBehavior),
    /// Sets the stiffness of the internal joint impedance, N·m/rad.
    SetJointImpedance([f64; 7]),
    /// Sets the stiffness of the internal Cartesian impedance, N/m and N·m/rad.
    SetCartesianImpedance([f64; 6]),
    /// Sets the directions for hand guiding: x, y, z, roll, pitch, yaw, elbow.
    SetGuidingMode([bool; 7]),
    /// Sets the stiffness frame relative to the end effector.
    SetEeToStiffness(Transform),
    /// Sets the end effector's frame relative to the nominal one.
    SetNeToEe(Transform),
    /// Sets the robot's load.
    SetLoad(Load),
    /// Sets cut-off frequencies of filters, Hz (version 5).
    SetFilters([f64; 5]),
    /// Clears errors.
    AutomaticErrorRecovery,
    /// Asks for a library with the robot's dynamics (version 5), for an architecture and an operating system.
    LoadModelLibrary([u8; 2]),
    /// Asks for the robot's description, a URDF (version 10).
    GetRobotModel,
}

const NO_DEVIATION: Deviation = Deviation { translation: 0.0, rotation: 0.0, elbow: 0.0 };

impl Request {
    /// The command of this request.
    pub fn command(&self) -> Command {
        match self {
            Request::Connect { .. } => Command::Connect,
            Request::Move(_) => Command::Move,
            Request::StopMove => Command::StopMove,
            Request::GetCartesianLimit(_) => Command::GetCartesianLimit,
            Request::SetCollisionBehavior(_) => Command::SetCollisionBehavior,
            Request::SetJointImpedance(_) => Command::SetJointImpedance,
            Request::SetCartesianImpedance(_) => Command::SetCartesianImpedance,
            Request::SetGuidingMode(_) => Command::SetGuidingMode,
            Request::SetEeToStiffness(_) => Command::SetEeToStiffness,
            Request::SetNeToEe(_) => Command::SetNeToEe,
            Request::SetLoad(_) => Command::SetLoad,
            Request::SetFilters(_) => Command::SetFilters,
            Request::AutomaticErrorRecovery => Command::AutomaticErrorRecovery,
            Request::LoadModelLibrary(_) => Command::LoadModelLibrary,
            Request::GetRobotModel => Command::GetRobotModel,
        }
    }

    /// The message, including its header; `None` for a command or generator that the version does not have.
    pub fn encode(&self, command_id: u32, version: Version) -> Option<Vec<u8>> {
        let number = self.command().number(version)?;
        let mut encoder = Encoder::new(Real::F64);
        let mut request = *self;
        request.fields(&mut encoder, version).ok()?;
        Some(Header::message(HeaderKind::Robot, number, command_id, &encoder.into_bytes()))
    }

    /// Reads the payload of a request.
    ///
    /// # Errors
    /// [`WireError`] for an unknown command or mode, or a wrong size.
    pub fn decode(header: &Header, payload: &[u8], version: Version) -> Result<Self, WireError> {
        let mut request = Self::blank(Command::from_number(header.command, version)?);
        let mut decoder = Decoder::new("request", payload, Real::F64);
        request.fields(&mut decoder, version)?;
        decoder.finish()?;
        Ok(request)
    }

    fn blank(command: Command) -> Self {
        match command {
            Command::Connect => Request::Connect { version: 0, udp_port: 0 },
            Command::Move => Request::Move(MoveRequest {
                controller: ControllerMode::JointImpedance,
                generator: MotionGeneratorMode::JointPosition,
                max_path_deviation: NO_DEVIATION,
                max_goal_deviation: NO_DEVIATION,
            }),
            Command::StopMove => Request::StopMove,
            Command::GetCartesianLimit => Request::GetCartesianLimit(0),
            Command::SetCollisionBehavior => {
                Request::SetCollisionBehavior(CollisionBehavior::new([0.0; 7], [0.0; 7], [0.0; 6], [0.0; 6]))
            }
            Command::SetJointImpedance => Request::SetJointImpedance([0.0; 7]),
            Command::SetCartesianImpedance => Request::SetCartesianImpedance([0.0; 6]),
            Command::SetGuidingMode => Request::SetGuidingMode([false; 7]),
            Command::SetEeToStiffness => Request::SetEeToStiffness(IDENTITY),
            Command::SetNeToEe => Request::SetNeToEe(IDENTITY),
            Command::SetLoad => Request::SetLoad(Load::default()),
            Command::SetFilters => Request::SetFilters([0.0; 5]),
            Command::AutomaticErrorRecovery => Request::AutomaticErrorRecovery,
            Command::LoadModelLibrary => Request::LoadModelLibrary([0; 2]),
            Command::GetRobotModel => Request::GetRobotModel,
        }
    }

    fn fields(&mut self, codec: &mut impl Codec, version: Version) -> Result<(), WireError> {
        match self {
            Request::Connect { version, udp_port } => {
                codec.u16(version)?;
                codec.u16(udp_port)
            }
            Request::Move(request) => request.fields(codec, version),
            Request::GetCartesianLimit(id) => codec.u32(id),
            Request::SetCollisionBehavior(behavior) => behavior.fields(codec),
            Request::SetJointImpedance(stiffness) => codec.f64s(stiffness),
            Request::SetCartesianImpedance(stiffness) => codec.f64s(stiffness),
            Request::SetGuidingMode(axes) => axes.iter_mut().try_for_each(|axis| codec.bool(axis)),
            Request::SetEeToStiffness(transform) | Request::SetNeToEe(transform) => codec.f64s(transform),
            Request::SetLoad(load) => {
                codec.f64(&mut load.mass)?;
                codec.f64s(&mut load.center)?;
                codec.f64s(&mut load.inertia)
            }
            Request::SetFilters(frequencies) => codec.f64s(frequencies),
            Request::LoadModelLibrary(platform) => codec.bytes(platform),
            Request::StopMove | Request::AutomaticErrorRecovery | Request::GetRobotModel => Ok(()),
        }
    }
}

impl MoveRequest {
    fn fields(&mut self, codec: &mut impl Codec, version: Version) -> Result<(), WireError> {
        let mut controller = u32::from(self.controller as u8);
        codec.u32(&mut controller)?;
        self.controller = match controller {
            0 => ControllerMode::JointImpedance,
            1 => ControllerMode::CartesianImpedance,
            2 => ControllerMode::External,
            found => return Err(WireError::Value { field: "controller mode", found }),
        };
        // In a Move, generator 0 is joint positions; in a state, it is idle.
        let mut generator = u32::from(self.generator as u8).wrapping_sub(1);
        codec.u32(&mut generator)?;
        self.generator = match (generator, version) {
            (0, _) => MotionGeneratorMode::JointPosition,
            (1, _) => MotionGeneratorMode::JointVelocity,
            (2, _) => MotionGeneratorMode::CartesianPosition,
            (3, _) => MotionGeneratorMode::CartesianVelocity,
            (4, Version::V10) => MotionGeneratorMode::None,
            (found, _) => return Err(WireError::Value { field: "motion generator mode", found }),
        };
        for deviation in [&mut self.max_path_deviation, &mut self.max_goal_deviation] {
            codec.f64(&mut deviation.translation)?;
            codec.f64(&mut deviation.rotation)?;
            codec.f64(&mut deviation.elbow)?;
        }
        if version == Version::V10 {
            // Fields of the generator for clients slower than 1 kHz, which this client does not use.
            codec.bool(&mut false)?;
            codec.f64s(&mut [0.0; 7])?;
        }
        Ok(())
    }
}

impl CollisionBehavior {
    fn fields(&mut self, codec: &mut impl Codec) -> Result<(), WireError> {
        codec.f64s(&mut self.lower_torque_acceleration)?;
        codec.f64s(&mut self.upper_torque_acceleration)?;
        codec.f64s(&mut self.lower_torque_nominal)?;
        codec.f64s(&mut self.upper_torque_nominal)?;
        codec.f64s(&mut self.lower_force_acceleration)?;
        codec.f64s(&mut self.upper_force_acceleration)?;
        codec.f64s(&mut self.lower_force_nominal)?;
        codec.f64s(&mut self.upper_force_nominal)
    }
}
