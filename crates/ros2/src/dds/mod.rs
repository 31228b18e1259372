//! The network: nodes, topics, services and actions, and a camera and an arm that use them.
//!
//! Calls that wait for the network have a timeout; there is no asynchronous runtime.

mod action;
mod action_server;
mod arm;
mod camera;
mod cancellation;
mod failure;
mod joint_states;
mod node;
mod panics;
mod service;
mod topic;
mod wait;
mod wire;

pub use action::{ActionClient, ActionType, Goal, GoalEnd};
pub use action_server::{ActionServer, Asked};
pub use arm::TrajectoryArm;
pub use camera::{RosCamera, TopicAddress, domain_of_environment, stamp_or_now};
pub use joint_states::ArmConfig;
pub use node::{Node, NodeConfig, Rmw};
pub use panics::{network_panic, network_thread, watch_network_threads};
pub use service::{RequestId, Server, ServiceType};
pub use topic::{Publisher, Qos, Received, Subscription};
