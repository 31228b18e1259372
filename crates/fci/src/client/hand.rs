//! A connection to the hand.

use std::time::Duration;

use super::robot::resolve;
use super::session::{Sending, Session};
use crate::error::{FciError, Result};
use crate::wire::{HAND_PORT, HAND_VERSION, HandRequest, HandState, HandStatus, HeaderKind, Status};

/// Size of the hand's state in bytes.
const STATE_SIZE: usize = 23;
/// Timeout of a motion: homing closes and opens the fingers at the hand's own speed.
const MOTION_TIMEOUT: Duration = Duration::from_secs(60);

/// Parameters of a connection to a hand.
#[derive(Debug, Clone)]
pub struct HandConfig {
    /// TCP port of the hand.
    pub port: u16,
    /// Maximum duration of connecting and of each wait for a state.
    pub timeout: Duration,
}

impl Default for HandConfig {
    fn default() -> Self {
        Self { port: HAND_PORT, timeout: Duration::from_secs(1) }
    }
}

/// A connected hand. Calls that move the fingers return after the fingers have stopped.
#[derive(Debug)]
pub struct Hand {
    session: Session,
}

/// Stops a hand from another thread.
#[derive(Debug, Clone)]
pub struct HandStopHandle {
    sending: Sending,
}

impl HandStopHandle {
    /// Asks the hand to stop; a call that waits for the end of a motion returns.
    ///
    /// # Errors
    /// [`FciError::Socket`] if the hand is disconnected.
    pub fn stop(&self) -> Result<()> {
        self.sending.send(|id| HandRequest::Stop.encode(id)).map(drop)
    }
}

impl Hand {
    /// Connects to the hand of a robot by name or IP address, as [`super::Robot::connect`].
    ///
    /// # Errors
    /// [`FciError::Socket`]; [`FciError::Version`] for a hand with another protocol version; [`FciError::Timeout`] or
    /// [`FciError::Closed`] if the hand does not answer; [`FciError::Wire`] or [`FciError::Refused`] for an answer that
    /// is invalid or has no version.
    pub fn connect(host: &str, config: &HandConfig) -> Result<Self> {
        let mut session = Session::connect(&resolve(host, config.port)?, HeaderKind::Hand, config.timeout)?;
        let request = HandRequest::Connect { version: HAND_VERSION, udp_port: session.udp_port()? };
        let id = session.sending.send(|id| request.encode(id))?;
        let payload = session.wait_for(id, request.command().name(), Some(config.timeout))?;
        let status =
            HandStatus::decode(&payload).map_err(|source| FciError::Wire { address: session.address, source })?;
        match (status, &payload[2..]) {
            (HandStatus::Success, _) => Ok(Self { session }),
            (_, [low, high, ..]) => Err(FciError::Version {
                peer: "hand",
                expected: HAND_VERSION.to_string(),
                found: u16::from_le_bytes([*low, *high]),
            }),
            _ => Err(FciError::Refused { command: request.command().name(), status: Status::Error }),
        }
    }

    /// Waits for the hand's next state.
    ///
    /// # Errors
    /// [`FciError::Timeout`], [`FciError::Closed`] or [`FciError::Socket`] if the hand is disconnected,
    /// [`FciError::Wire`] for an invalid state.
    pub fn read_state(&mut self) -> Result<HandState> {
        self.session.receive(STATE_SIZE, true, HandState::decode)
    }

    /// Finds the range of the fingers by closing and opening them. Returns whether this succeeded.
    ///
    /// # Errors
    /// [`FciError::Refused`] if the hand fails or is stopped, and the errors of the connection.
    pub fn homing(&mut self) -> Result<bool> {
        self.execute(&HandRequest::Homing)
    }

    /// Moves the fingers to a width (m) at a speed (m/s). Returns whether this succeeded.
    ///
    /// # Errors
    /// As for [`Hand::homing`].
    pub fn move_to(&mut self, width: f64, speed: f64) -> Result<bool> {
        self.execute(&HandRequest::Move { width, speed })
    }

    /// Moves the fingers towards a width (m) at a speed (m/s) and presses with a force (N). Returns true if the fingers
    /// then press on an object at a width between `width - epsilon_inner` and `width + epsilon_outer`.
    ///
    /// # Errors
    /// As for [`Hand::homing`].
    pub fn grasp(
        &mut self,
        width: f64,
        speed: f64,
        force: f64,
        epsilon_inner: f64,
        epsilon_outer: f64,
    ) -> Result<bool> {
        self.execute(&HandRequest::Grasp { width, epsilon_inner, epsilon_outer, speed, force })
    }

    /// Stops the fingers and ends a grasp.
    ///
    /// # Errors
    /// As for [`Hand::homing`].
    pub fn stop(&mut self) -> Result<bool> {
        self.execute(&HandRequest::Stop)
    }

    /// A handle with which another thread can stop the motion for which this one waits.
    pub fn stop_handle(&self) -> HandStopHandle {
        HandStopHandle { sending: self.session.sending.clone() }
    }

    fn execute(&mut self, request: &HandRequest) -> Result<bool> {
        self.session.forget_responses();
        let command = request.command().name();
        let id = self.session.sending.send(|id| request.encode(id))?;
        let payload = self.session.wait_for(id, command, Some(MOTION_TIMEOUT))?;
        let status =
            HandStatus::decode(&payload).map_err(|source| FciError::Wire { address: self.session.address, source })?;
        match status {
            HandStatus::Success => Ok(true),
            HandStatus::Unsuccessful => Ok(false),
            HandStatus::Fail => Err(FciError::Refused { command, status: Status::Error }),
            HandStatus::Aborted => Err(FciError::Refused { command, status: Status::Aborted }),
        }
    }
}
