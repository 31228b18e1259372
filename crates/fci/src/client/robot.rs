//! A connection to a robot: its state, its settings, stop and recovery.

use std::collections::VecDeque;
use std::net::{SocketAddr, ToSocketAddrs};
use std::time::{Duration, Instant};

use super::session::{Sending, Session};
use super::statistics::ControlStatistics;
use crate::error::{FciError, Result};
use crate::wire::{
    CollisionBehavior, Command, HeaderKind, Load, ROBOT_PORT, Request, Response, RobotState, STATE_SIZE_V5,
    STATE_SIZE_V10, Status, Transform, Version,
};

/// Number of stored past states: one second.
const NUM_RECENT_STATES: usize = 1000;
/// Maximum duration of a recovery or a stop.
const RECOVERY_TIMEOUT: Duration = Duration::from_secs(10);

/// Parameters of a connection to a robot.
#[derive(Debug, Clone)]
pub struct RobotConfig {
    /// TCP port of the robot.
    pub port: u16,
    /// The protocol version. With `None`, the client tries version 5, and then version 10 if the robot answers that it
    /// uses version 10.
    pub version: Option<Version>,
    /// Maximum duration of a wait for a response or a state; for stop and recovery it is 10 s.
    pub timeout: Duration,
}

impl Default for RobotConfig {
    fn default() -> Self {
        Self { port: ROBOT_PORT, version: None, timeout: Duration::from_secs(1) }
    }
}

/// A connected robot. Motions are in `control`: [`Robot::control_joint_positions`] and the related functions.
///
/// Dropping a `Robot` closes the connection, and the robot stops a running motion.
#[derive(Debug)]
pub struct Robot {
    pub(super) session: Session,
    pub(super) version: Version,
    pub(super) state: RobotState,
    pub(super) recent: VecDeque<RobotState>,
    pub(super) statistics: ControlStatistics,
}

/// Stops a motion from another thread.
#[derive(Debug, Clone)]
pub struct StopHandle {
    sending: Sending,
    version: Version,
}

impl StopHandle {
    /// Asks the robot to stop; the running control loop ends with [`Status::Preempted`].
    ///
    /// # Errors
    /// [`FciError::Socket`] if the robot is disconnected.
    pub fn stop(&self) -> Result<()> {
        self.sending.send(|id| Request::StopMove.encode(id, self.version).unwrap_or_default()).map(drop)
    }
}

impl Robot {
    /// Connects to a robot by name or IP address (`HOST` or `HOST:PORT`) and waits for its first state. Of several
    /// addresses of a name, the first that accepts the connection is used.
    ///
    /// # Errors
    /// [`FciError::Socket`]; [`FciError::Version`] for a robot with an unsupported protocol version;
    /// [`FciError::Timeout`] if no response or no state arrives (the latter often because a firewall blocks UDP);
    /// [`FciError::Closed`]; [`FciError::Wire`] for an invalid message.
    pub fn connect(host: &str, config: &RobotConfig) -> Result<Self> {
        let addresses = resolve(host, config.port)?;
        match config.version {
            Some(version) => Self::connect_as(&addresses, version, config.timeout),
            None => match Self::connect_as(&addresses, Version::V5, config.timeout) {
                Err(FciError::Version { found, .. }) if found == Version::V10.number() => {
                    Self::connect_as(&addresses, Version::V10, config.timeout)
                }
                other => other,
            },
        }
    }

    fn connect_as(addresses: &[SocketAddr], version: Version, timeout: Duration) -> Result<Self> {
        let mut session = Session::connect(addresses, HeaderKind::Robot, timeout)?;
        let request = Request::Connect { version: version.number(), udp_port: session.udp_port()? };
        let response = execute(&mut session, &request, version, Some(timeout))?;
        let found = match response.rest[..] {
            [low, high, ..] => u16::from_le_bytes([low, high]),
            _ => 0,
        };
        // Some servers accept every version and then use their own.
        if response.status != Status::Success || found != version.number() {
            return Err(FciError::Version { peer: "robot", expected: "5 (Panda) or 10 (FR3)".into(), found });
        }
        let mut robot = Self {
            session,
            version,
            state: RobotState::default(),
            recent: VecDeque::with_capacity(NUM_RECENT_STATES),
            statistics: ControlStatistics::default(),
        };
        robot.receive(false)?;
        Ok(robot)
    }

    /// The protocol version in use.
    pub fn version(&self) -> Version {
        self.version
    }

    /// The last received state.
    pub fn state(&self) -> &RobotState {
        &self.state
    }

    /// The states of the last second of control and reading, oldest first.
    pub fn recent_states(&self) -> impl Iterator<Item = &RobotState> {
        self.recent.iter()
    }

    /// The timing of the last motion's loop.
    pub fn statistics(&self) -> &ControlStatistics {
        &self.statistics
    }

    /// Waits for the next state.
    ///
    /// # Errors
    /// [`FciError::Timeout`], [`FciError::Closed`] or [`FciError::Socket`] if the robot is disconnected,
    /// [`FciError::Wire`] for an invalid state.
    pub fn read_state(&mut self) -> Result<&RobotState> {
        self.receive(true)?;
        Ok(&self.state)
    }

    /// A handle with which another thread can stop the motion that this one controls.
    pub fn stop_handle(&self) -> StopHandle {
        StopHandle { sending: self.session.sending.clone(), version: self.version }
    }

    /// Stops the running motion.
    ///
    /// # Errors
    /// [`FciError::Refused`] and the errors of the connection.
    pub fn stop(&mut self) -> Result<()> {
        self.execute(&Request::StopMove, Some(RECOVERY_TIMEOUT))
    }

    /// Clears the errors after a reflex, at a person's request, without moving the arm.
    ///
    /// # Errors
    /// [`FciError::Refused`] and the errors of the connection.
    pub fn automatic_error_recovery(&mut self) -> Result<()> {
        self.execute(&Request::AutomaticErrorRecovery, Some(RECOVERY_TIMEOUT))
    }

    /// Sets the thresholds at which contacts are reported and collisions stop the robot; not during a motion.
    ///
    /// # Errors
    /// [`FciError::Refused`] and the errors of the connection.
    pub fn set_collision_behavior(&mut self, behavior: &CollisionBehavior) -> Result<()> {
        self.set(&Request::SetCollisionBehavior(*behavior))
    }

    /// Sets the stiffness of the internal joint impedance, N·m/rad (0 to 14250).
    ///
    /// # Errors
    /// [`FciError::Refused`] and the errors of the connection.
    pub fn set_joint_impedance(&mut self, stiffness: &[f64; 7]) -> Result<()> {
        self.set(&Request::SetJointImpedance(*stiffness))
    }

    /// Sets the stiffness of the internal Cartesian impedance, N/m (10 to 3000) and N·m/rad (1 to 300).
    ///
    /// # Errors
    /// [`FciError::Refused`] and the errors of the connection.
    pub fn set_cartesian_impedance(&mut self, stiffness: &[f64; 6]) -> Result<()> {
        self.set(&Request::SetCartesianImpedance(*stiffness))
    }

    /// Sets the robot's load in addition to its end effector.
    ///
    /// # Errors
    /// [`FciError::Refused`] and the errors of the connection.
    pub fn set_load(&mut self, load: &Load) -> Result<()> {
        self.set(&Request::SetLoad(*load))
    }

    /// Sets the end effector's frame relative to the nominal one.
    ///
    /// # Errors
    /// [`FciError::Refused`] and the errors of the connection.
    pub fn set_ee(&mut self, ne_from_ee: &Transform) -> Result<()> {
        self.set(&Request::SetNeToEe(*ne_from_ee))
    }

    fn set(&mut self, request: &Request) -> Result<()> {
        let timeout = self.session.timeout();
        self.execute(request, Some(timeout))
    }

    fn execute(&mut self, request: &Request, timeout: Option<Duration>) -> Result<()> {
        let response = execute(&mut self.session, request, self.version, timeout)?;
        accept(&response, request.command())
    }

    /// Receives a state that is newer than the last one; repeated and late datagrams are ignored.
    pub(super) fn receive(&mut self, discard_waiting: bool) -> Result<()> {
        let version = self.version;
        let size = match version {
            Version::V5 => STATE_SIZE_V5,
            Version::V10 => STATE_SIZE_V10,
        };
        let mut discard_waiting = discard_waiting;
        // The deadline is needed because, after a state with a wrong, too large number, all later states look old.
        let deadline = Instant::now() + self.session.timeout();
        loop {
            let state = self.session.receive(size, discard_waiting, |bytes| RobotState::decode(bytes, version))?;
            discard_waiting = false;
            if state.message_id > self.state.message_id || self.recent.is_empty() {
                self.state = state;
                break;
            }
            if Instant::now() >= deadline {
                let (what, waited) = ("state that is newer than the last one", self.session.timeout());
                return Err(FciError::Timeout { what, address: self.session.address, waited });
            }
        }
        if self.recent.len() == NUM_RECENT_STATES {
            self.recent.pop_front();
        }
        self.recent.push_back(self.state.clone());
        Ok(())
    }
}

/// Sends a request and waits for its response.
fn execute(session: &mut Session, request: &Request, version: Version, timeout: Option<Duration>) -> Result<Response> {
    let command = request.command();
    if command.number(version).is_none() {
        return Err(FciError::Refused { command: command.name(), status: Status::NotPossible });
    }
    let id = session.sending.send(|id| request.encode(id, version).unwrap_or_default())?;
    let payload = session.wait_for(id, command.name(), timeout)?;
    decode_response(session, &payload, command, version)
}

pub(super) fn decode_response(
    session: &Session,
    payload: &[u8],
    command: Command,
    version: Version,
) -> Result<Response> {
    Response::decode(payload, command, version).map_err(|source| FciError::Wire { address: session.address, source })
}

fn accept(response: &Response, command: Command) -> Result<()> {
    match response.status {
        Status::Success => Ok(()),
        status => Err(FciError::Refused { command: command.name(), status }),
    }
}

/// The addresses of a host, or of a host with its own port (`HOST:PORT`); at least one.
pub(super) fn resolve(host: &str, port: u16) -> Result<Vec<SocketAddr>> {
    let (host, port) = match host.rsplit_once(':').map(|(name, port)| (name, port.parse())) {
        // An IPv6 address has more than one colon.
        Some((name, Ok(own_port))) if !name.contains(':') => (name, own_port),
        _ => (host, port),
    };
    let unknown = |source| FciError::Socket { action: "find", address: host.to_owned(), source };
    let addresses: Vec<SocketAddr> = (host, port).to_socket_addrs().map_err(unknown)?.collect();
    if addresses.is_empty() {
        return Err(unknown(std::io::ErrorKind::NotFound.into()));
    }
    Ok(addresses)
}
