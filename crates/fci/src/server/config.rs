//! The addresses of a server, and the timing of its cycles.

use std::net::{IpAddr, Ipv4Addr};
use std::time::Duration;

use crate::limits::Limits;
use crate::wire::{HAND_PORT, ROBOT_PORT};

/// The rule that determines when a cycle starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// A thousand cycles per second, as on a robot; late commands are lost.
    RealTime,
    /// During motions, the next cycle starts after the client's answer or, as if a command were lost, after `max_wait`.
    /// The simulation advances only during motions and while arm or fingers move, so that a run is the same on every
    /// machine.
    Lockstep {
        /// Maximum duration of the wait for a client's answer.
        max_wait: Duration,
    },
}

impl Pace {
    /// Lockstep with half a second for each answer: libfranka ends the connection if it receives no state for a second.
    pub const LOCKSTEP: Pace = Pace::Lockstep { max_wait: Duration::from_millis(500) };
}

/// The server's addresses and its timing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServerConfig {
    /// IP address to listen on.
    pub ip: IpAddr,
    /// TCP port of the robot; 0 for a free one.
    pub robot_port: u16,
    /// TCP port of the hand; 0 for a free one.
    pub hand_port: u16,
    /// The rule that determines when a cycle starts.
    pub pace: Pace,
    /// The limits applied to the client.
    pub limits: Limits,
}

impl Default for ServerConfig {
    /// A Panda in real time on the robot's own ports, reachable from this computer only.
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
