//! A whole grasp over TCP and UDP: the sequence, the client, the server, MuJoCo. Faults are in network_faults.rs.
//!
//! `examples/network_grasps.rs` (`make network-grasps`) produces the table of all parts.

use crate::network::{Twin, cell, connect, serve};
use sdg_fci::client::{Robot as Client, RobotConfig};
use sdg_fci::server::Pace;
use sdg_robot::{GraspConfig, GraspOutcome, Load, Robot, Watch, grasp};
use sdg_simulation::Workcell;
use sdg_simulation::objects::ObjectSpec;

/// The centre of mass that is given to the robot for the part, in the flange's frame, m. The measured vertical force
/// does not depend on it.
const TIPS_IN_FLANGE_M: [f64; 3] = [0.0, 0.0, 0.2104];

#[test]
fn a_part_is_grasped_over_the_network_in_lockstep() {
    let cell = cell("pendulum", 101);
    let (server, positions) = serve(&cell, Pace::LOCKSTEP);
    let mount = cell.wrist_camera();
    let mut twin = Twin { cell, positions };
    let mut arm = connect(&server).unwrap();
    let mut robot = Robot::new(&mut arm, Workcell::safety_limits(), Watch::default());
    let mass_kg = ObjectSpec::by_name("pendulum").unwrap().mass_kg;
    let load = Some(Load { mass_kg, center_in_flange_m: TIPS_IN_FLANGE_M });
    let config = GraspConfig { load, ..GraspConfig::default() };
    let report = grasp(&mut robot, &mut twin, &mut (), mount, &config).unwrap();
    // The hand's verdict and the true state agree.
    assert_eq!(report.outcome, GraspOutcome::Held, "{report:?}");
    assert!(twin.is_lifted());
    assert_eq!(report.looks, [1, 1]);
    drop(arm);
    // The robot knows the load, and measures no further force.
    let client = Client::connect(&server.robot_address().to_string(), &RobotConfig::default()).unwrap();
    let state = client.state();
    assert_eq!((state.load_mass, state.load_center), (mass_kg, TIPS_IN_FLANGE_M));
    let felt_n = state.external_wrench_in_base[2];
    assert!(felt_n.abs() < 0.5, "{felt_n} N, and the part weighs {} N", 9.81 * mass_kg);
    drop(client);
    server.stop().unwrap();
}
