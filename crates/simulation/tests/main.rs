//! One program for all tests of this folder, because every program links the whole crate.
#![allow(clippy::unwrap_used)]

mod attempts;
#[path = "fci_support/bare_client.rs"]
mod bare_client;
mod collision_model;
mod contact;
mod fci;
mod fci_faults;
mod fci_fuzz;
mod fci_support;
#[path = "../../fci/tests/limit_cases/mod.rs"]
mod limit_cases;
mod network;
mod network_faults;
mod network_grasp;
mod network_line;
mod network_way;
mod old_robot;
mod place;
mod placing;
mod planning;
mod robot_faults;
