//! The client: a program that drives a robot and its hand.

mod control;
mod hand;
mod rate_limit;
mod robot;
mod session;
mod statistics;

pub use control::{Answer, InternalController};
pub use hand::{Hand, HandConfig, HandStopHandle};
pub use rate_limit::limit_joint_positions;
pub use robot::{Robot, RobotConfig, StopHandle};
pub use statistics::ControlStatistics;
