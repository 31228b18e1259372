//! A whole grasp over TCP and UDP: the sequence, our client, the server, MuJoCo. What goes wrong stands in network_faults.rs.
//!
//! The table of all parts is made by `examples/network_grasps.rs` (`make network-grasps`).

#![allow(clippy::unwrap_used)]

mod network;

use network::{Twin, cell, connect, serve};
use sdg_fci::server::Pace;
use sdg_robot::{GraspConfig, GraspOutcome, GraspReport, Robot, Watch, grasp};
use sdg_simulation::Workcell;

fn run(cell: Workcell, watch: Watch) -> (sdg_robot::Result<GraspReport>, Twin) {
    let (server, positions) = serve(&cell, Pace::LOCKSTEP);
    let mount = cell.wrist_mount();
    let mut twin = Twin { cell, positions };
    let mut arm = connect(&server).unwrap();
    let mut robot = Robot::new(&mut arm, Workcell::safety_limits(), watch);
    let report = grasp(&mut robot, &mut twin, &mut (), mount, &GraspConfig::default());
    drop(arm);
    server.stop().unwrap();
    (report, twin)
}

#[test]
fn a_part_is_grasped_over_the_network_in_lockstep() {
    let (report, mut twin) = run(cell("pendulum", 101), Watch::default());
    let report = report.unwrap();
    // The hand's word and the truth agree.
    assert_eq!(report.outcome, GraspOutcome::Held, "{report:?}");
    assert!(twin.is_lifted());
    assert_eq!(report.looks, [1, 1]);
}
