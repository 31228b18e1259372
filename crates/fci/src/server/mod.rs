//! The server: makes a [`Plant`], a simulated arm with a hand, available on the network as a Panda (protocol version 5,
//! and version 3 for the hand).
//!
//! [`RobotCore`] and [`HandCore`] are robot and hand without sockets and clock: every cycle takes the client's command,
//! if any, and leads to the next state. [`Server`] connects them to the network.

mod cartesian;
mod communication;
mod config;
mod contact;
mod frames;
mod hand;
mod link;
mod monitor;
mod motion;
mod plant;
mod reference;
mod report;
mod robot;
mod run;
mod settings;
mod statistics;
mod torque;

pub use config::{Pace, ServerConfig};
pub use hand::{HAND_MAX_WIDTH_M, HandCore, HandOutgoing};
pub use plant::{Jacobian, JointVector, Observation, Plant};
pub use reference::PERIOD_SECS;
pub use robot::{Outgoing, RobotCore};
pub use run::Server;
pub use statistics::ServerStatistics;
