//! The addresses of a server, and the timing of its cycles.

use std::net::{IpAddr, Ipv4Addr};
use std::time::Duration;

use crate::limits::Limits;
use crate::wire::{HAND_PORT, ROBOT_PORT};

/// The start of a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// A thousand times per second, as on a robot; later commands are lost.
    RealTime,
    /// During motions after the client's answer, or after `max_wait` as a lost command. Time advances during motions
    /// and while arm or fingers move, so that a run is the same on every machine.
    Lockstep {
        /// Maximum time of a client for an answer.
        max_wait: Duration,
    },
}

impl Pace {
    /// Lockstep with half a second for each answer: libfranka gives up on a robot that is silent for a second.
    pub const LOCKSTEP: Pace = Pace::Lockstep { max_wait: Duration::from_millis(500) };
}

/// The server's addresses and its timing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServerConfig {
    /// Address to listen on.
    pub ip: IpAddr,
    /// TCP port of the robot; 0 for a free one.
    pub robot_port: u16,
    /// TCP port of the hand; 0 for a free one.
    pub hand_port: u16,
    /// The start of a cycle.
    pub pace: Pace,
    /// The limits applied to the client.
    pub limits: Limits,
}

impl Default for ServerConfig {
    /// A Panda on this computer only, in real time, on the robot's own ports.
    fn default() -> Self {
        Self {
            ip: Ipv4Addr::LOCALHOST.into(),
            robot_port: ROBOT_PORT,
            hand_port: HAND_PORT,
            pace: Pace::RealTime,
            limits: Limits::PANDA,
        }
    }
}
